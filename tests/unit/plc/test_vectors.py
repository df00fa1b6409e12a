"""The test vectors: they replay, reach everything, and are the same bytes every time."""

import csv
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.unit.plc.compiled import Compiled, compiled
from tests.unit.plc.plc_scenarios import random_settings
from thermaxis.compensation import Compensation, Limits, Part, Reason, SampleQuality, SensorRules
from thermaxis.files import read_model
from thermaxis.plc import (
    TOLERANCE_UM,
    CallSequence,
    Kind,
    PlcSettings,
    export_settings,
    interface_of,
    vectors_of,
)
from thermaxis.plc.vectors import ODD
from thermaxis.runtime import read_machine

WHOLE: dict[str, Any] = {}


def whole(settings: PlcSettings) -> Any:
    """Return the vectors as a user gets them, made once for equal settings."""
    key = repr(settings)
    if key not in WHOLE:
        WHOLE[key] = vectors_of(settings)
    return WHOLE[key]


def rows_of(text: str) -> list[dict[str, str]]:
    lines = [line for line in text.splitlines() if not line.startswith("# ")]
    return list(csv.DictReader(lines))


def replayed(settings: PlcSettings, row: dict[str, str], block: Compiled) -> dict[str, Any]:
    """Call the exported block as the row says, from its text alone."""
    kinds = {v.name: v.kind for v in interface_of(settings).inputs}
    told = {n: row[n] == "1" if kinds[n] is Kind.BOOL else float(row[n]) for n in kinds}
    for _ in range(int(row["calls"])):
        said = block.step(told)
    return said


def test_a_reader_of_the_text_alone_gets_every_output_of_the_block_to_the_last_bit() -> None:
    settings = random_settings(3)
    block, rows = compiled(settings), rows_of(whole(settings).text)
    assert len(rows) > 300
    for row in rows:
        said = replayed(settings, row, block)
        assert {name: float(row[name]) for name in said} == said, row


@pytest.mark.proof
@pytest.mark.parametrize("seed", [1, pytest.param(6, marks=pytest.mark.proof)])
def test_in_real_states_and_words_are_equal_and_numbers_within_the_tolerance(seed: int) -> None:
    settings = random_settings(seed, double=False)
    block, rows = compiled(settings), rows_of(vectors_of(settings, most_calls=2000).text)
    numbers = {v.name for v in interface_of(settings).outputs if v.kind is Kind.NUMBER}
    compared = 0
    for row in rows:
        said = replayed(settings, row, block)
        if row["compare"] == "0":
            continue
        compared += 1
        for name, value in said.items():
            away = abs(float(row[name]) - value)
            assert away <= (TOLERANCE_UM if name in numbers else 0.0), (name, row)
    assert compared > 0.97 * len(rows)


MODELS = Path(__file__).parents[3] / "examples" / "models"
LATHE = Path(__file__).parents[3] / "examples" / "machine"


def of_example(path: Path, *, cycle_s: float) -> PlcSettings:
    """A model with limits that it reaches."""
    model = read_model(path)
    compensation = Compensation(
        model=model,
        sensors=dict.fromkeys(model.channels, SensorRules(lowest_c=5.0, highest_c=80.0)),
        limits={output.name: Limits(20.0, 0.5) for output in model.outputs},
    )
    return export_settings(compensation, cycle_s=cycle_s, name=path.stem)


def of_lathe(*, cycle_s: float) -> PlcSettings:
    rules = read_machine(LATHE / "lathe.toml").rules
    applied = rules.applied_to(read_model(LATHE / "models" / "lathe.json"))
    return export_settings(applied, cycle_s=cycle_s, name="lathe")


def bits_of(rows: list[dict[str, str]], word: str) -> int:
    found = 0
    for row in rows:
        found |= int(row[word])
    return found


def require_promised(settings: PlcSettings, *, reaches: bool) -> set[str]:
    """Look for everything that was promised in the rows of the text alone; return what it lacks."""
    found = whole(settings)
    rows = rows_of(found.text)
    model = settings.compensation.model
    assert (len(rows), sum(int(row["calls"]) for row in rows)) == (found.rows, found.calls)
    assert {row["state"] for row in rows} == set("012345")
    for name in (
        "init",
        "standing",
        "other_compensation",
        "refused",
        "enabled",
        "linked",
        "read_ok",
    ):
        assert {row[name] for row in rows} == {"0", "1"}, name
    longest = max(int(row["calls"]) for row in rows)
    assert longest >= 1000
    at_limit = 2 ** list(Reason).index(Reason.LONG_AT_LIMIT)
    faults = bits_of(rows, "fault_word")
    assert faults | at_limit == 2 ** len(Reason) - 1
    # After a fault somebody acknowledges, and the block leaves it.
    assert any(a["state"] == "5" and b["state"] != "5" and b["reset"] == "1"
               for a, b in pairwise(rows))  # fmt: skip
    asked = {("-" if float(row[f"wanted_{stem}"]) < 0.0 else "+") + stem
             for row in rows for stem in settings.names.outputs
             if row[f"limit_{stem}"] == "1"}  # fmt: skip
    both = {sign + stem for stem in settings.names.outputs for sign in "+-"}
    unreached = {f"{'upper' if name[0] == '+' else 'lower'} limit of {name[1:]}"
                 for name in both - asked}  # fmt: skip
    named = set(found.missing)
    # What the rows have not is named, and nothing else.
    assert named - {f"fault_word {at_limit}"} == unreached
    assert (f"fault_word {at_limit}" in named) == (not faults & at_limit)
    assert not (reaches and named)
    assert all(f"# not in the rows: {text}" in found.text for text in found.missing)
    if reaches:
        assert found.cuts == ()
    for part in model.layout.parts:
        if part.gain_by_diameter:
            require_workpieces(rows, part, settings)
    return named


def require_workpieces(rows: list[dict[str, str]], part: Part, settings: PlcSettings) -> None:
    """The gain of a part acts in the rows: within its table, outside, and without a diameter."""
    edges = [point.diameter_mm for point in part.gain_by_diameter]
    stem = settings.names.parts[[*settings.compensation.model.layout.parts].index(part)]
    kinds: set[str] = set()
    for row in rows:
        if float(row[f"part_{stem}"]) == 0.0:
            continue
        if row["diameter_known"] == "0":
            kinds.add("unknown")
        else:
            inside = edges[0] <= float(row["diameter_mm"]) <= edges[-1]
            kinds.add("inside" if inside else "outside")
    assert kinds == {"inside", "outside", "unknown"}


@pytest.mark.proof
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(path.stem, marks=[] if path.stem == "eps1" else pytest.mark.proof)
        for path in sorted(MODELS.glob("*.json"))
    ],
)
def test_the_vectors_of_an_example_have_everything_that_was_promised(name: str) -> None:
    require_promised(of_example(MODELS / f"{name}.json", cycle_s=10.0), reaches=True)


@pytest.mark.proof
def test_the_vectors_of_the_lathe_name_the_limits_that_it_cannot_reach() -> None:
    assert require_promised(of_lathe(cycle_s=10.0), reaches=False) == {
        "upper limit of z_um",
        "lower limit of z_um",
        "fault_word 512",
    }


def test_the_vectors_of_a_random_model_have_everything_or_name_it() -> None:
    require_promised(random_settings(3), reaches=False)


# At 0.5 s a value that is frozen after hours does not fit, as a gap is no time in which it stands.
@pytest.mark.parametrize("cycle_s", [pytest.param(1.0, marks=pytest.mark.proof), 10.0])
def test_a_trim_expires_and_a_value_is_frozen_in_rows_that_are_compared(cycle_s: float) -> None:
    settings = of_example(MODELS / "eps1.json", cycle_s=cycle_s)
    (stem,) = settings.names.outputs
    rows = rows_of(whole(settings).text)
    pairs = [(a, b) for a, b in pairwise(rows) if b["init"] == "0" and b["compare"] == "1"]
    trim, added = f"trim_{stem}", f"added_{stem}"
    assert any(float(a[added]) and not float(b[added]) and a[trim] == b[trim] for a, b in pairs)
    frozen = str(list(SampleQuality).index(SampleQuality.FROZEN))
    assert all(frozen in {b[f"quality_{c}"] for _, b in pairs} for c in settings.names.channels)


def test_what_does_not_fit_into_the_calls_is_named_and_said_where_it_was_cut() -> None:
    found = vectors_of(of_lathe(cycle_s=0.1), most_calls=3000)
    assert "fault_word 1024" in found.missing
    assert found.cuts
    for cut in found.cuts:
        assert re.fullmatch(r"[\w -]+ after \d+ calls for want of calls", cut)
        assert f"# cut: {cut}\n" in found.text
    assert found.calls <= 3000


def test_the_same_settings_give_the_same_bytes() -> None:
    assert len({vectors_of(random_settings(5), most_calls=2000).text for _ in range(2)}) == 1


def test_every_channel_reads_every_odd_value_alone_and_then_jumps() -> None:
    settings = random_settings(3)
    names = [f"t_{stem}" for stem in settings.names.channels]
    seen = [[told[name] for name in names] for told, _ in CallSequence(settings).steps()]
    assert len(seen[0]) > 1
    rules = settings.compensation.rules
    for k, rule in enumerate(rules):
        alone = [
            row[k]
            for row in seen
            if all(rules[i].lowest_c < c < rules[i].highest_c for i, c in enumerate(row) if i != k)
        ]
        odd = {*ODD, rule.lowest_c - 0.5, rule.highest_c + 0.5}
        assert {repr(value) for value in alone} >= {repr(value) for value in odd}
        believed_k = rule.step_k + rule.largest_rate_k_per_s * settings.cycle_s
        jumps_k = [abs(b - a) for a, b in pairwise(alone) if rule.lowest_c < b < rule.highest_c]
        assert any(believed_k < jump_k < 10.0 for jump_k in jumps_k)
