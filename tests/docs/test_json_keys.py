"""docs/json.md names every key of the JSON, and the JSON has every key that it names."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from thermaxis.cli import main

PROMISED = {
    "test": "targets cycles unidirectional kind start end header environment time_source",
    "iso230_2": "edition B B_mean M E_forward E_backward E R_forward R_backward R"
    " A_forward A_backward A targets",
    "iso230_2.targets[]": "position mean_forward mean_backward mean s_forward s_backward"
    " B R_forward R_backward R",
    "adjacent_difference": "reference_cycle student_factor forward backward",
    "adjacent_difference.forward": "mean_difference standard_uncertainty standard_deviation"
    " s_ratio chart bound anomalies",
    "adjacent_difference.forward.anomalies[]": "position position_mm statistic",
    "Top level": "test iso230_2 adjacent_difference warnings version",
}
FREE = ("test.header", "test.environment")
"""Objects whose keys come from the file."""

SAME_KEYS = {
    "adjacent_difference.backward": "adjacent_difference.forward",
    **dict.fromkeys(
        (f"montecarlo.{name}" for name in ("two_sequences", "to_larger", "to_smaller")),
        "montecarlo.one_sequence",
    ),
}
"""Objects with the keys of another one, which the page describes once."""


@pytest.fixture(scope="module")
def documented(root: Path) -> dict[str, set[str]]:
    page = (root / "docs" / "json.md").read_text(encoding="utf-8")
    parts = re.split(r"^## (.*)$", page, flags=re.MULTILINE)
    return {
        title.strip("` "): set(re.findall(r"^\| `([^`]+)`", body, re.MULTILINE))
        for title, body in zip(parts[1::2], parts[2::2], strict=True)
    }


@pytest.mark.parametrize("place", PROMISED)
def test_every_promised_key_is_documented(documented: dict[str, set[str]], place: str) -> None:
    assert set(PROMISED[place].split()) <= documented[place]


def keys_by_place(value: object, place: str, found: dict[str, set[str]]) -> None:
    if isinstance(value, dict) and place not in FREE:
        found.setdefault(place or "Top level", set()).update(value)
        for key, part in value.items():
            same = SAME_KEYS.get(f"{place}.{key}", f"{place}.{key}" if place else key)
            keys_by_place(part, same, found)
    elif isinstance(value, list):
        for part in value:
            keys_by_place(part, f"{place}[]", found)


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> dict[str, set[str]]:
    """Evaluate a run with an anomaly, limits, and both older standards, and collect the keys."""
    folder = tmp_path_factory.mktemp("json")
    rng = np.random.default_rng(5)
    readings = rng.normal(0.0, 0.3, (8, 40, 2))
    readings[3] *= 6.0
    lines = ["cycle,direction,target_mm,deviation_um"]
    for j in range(40):
        for a, word in enumerate(("forward", "backward")):
            lines += [f"{j + 1},{word},{20 * i},{readings[i, j, a]:.3f}" for i in range(8)]
    run = folder / "run.csv"
    run.write_text("\n".join(lines) + "\n", encoding="utf-8")
    limits = folder / "limits.toml"
    limits.write_text("[limits]\nA_um = 12.0\nM_um = 4.0\n", encoding="utf-8")
    found: dict[str, set[str]] = {}
    for edition in ("2014", "1988", "vdi3441"):
        destination = folder / f"{edition}.json"
        words = ["evaluate", str(run), "--limits", str(limits), "--edition", edition]
        assert main([*words, "--json", str(destination)]) == 0
        keys_by_place(json.loads(destination.read_text(encoding="ascii")), "", found)
    for options in ((), ("--sigma-b", "2")):
        destination = folder / "montecarlo.json"
        words = ["montecarlo", "--repetitions", "40", *options, "--json", str(destination)]
        assert main(words) == 0
        keys_by_place(json.loads(destination.read_text(encoding="ascii")), "montecarlo", found)
    return found


def test_the_json_and_its_page_have_the_same_keys(
    documented: dict[str, set[str]], written: dict[str, set[str]]
) -> None:
    assert "adjacent_difference.forward.anomalies[]" in written
    assert {place: written[place] - documented.get(place, set()) for place in written} == {
        place: set() for place in written
    }
    tables = {place: keys for place, keys in documented.items() if keys}
    assert {place: tables[place] - written.get(place, set()) for place in tables} == {
        place: set() for place in tables
    }
