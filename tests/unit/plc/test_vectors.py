"""The test vectors: they replay, reach everything, and are the same bytes every time."""

import csv
import re

import pytest

from tests.unit.plc.plc_scenarios import random_settings
from thermaxis.errors import ConfigurationError
from thermaxis.plc._scenario import course_steps, scenario_steps
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc._twin import PlcInputs, PlcOutputs, Twin
from thermaxis.plc._twin_numbers import rounding
from thermaxis.plc._vectors import MOST_ROWS, vectors_csv


def rows_of(text: str) -> list[dict[str, str]]:
    lines = [line for line in text.splitlines() if not line.startswith("# ")]
    return list(csv.DictReader(lines))


def replayed(settings: PlcSettings, row: dict[str, str], twin: Twin) -> PlcOutputs:
    """Call the block as the row says, from its text alone."""
    names, rounded = settings.names, rounding(double=settings.double)

    def numbers(prefix: str, stems: tuple[str, ...]) -> tuple[float, ...]:
        return tuple(rounded(float(row[f"{prefix}_{stem}"])) for stem in stems)

    inputs = PlcInputs(
        float(row["cycle_time_s"]),
        row["enable"] == "1",
        row["hold"] == "1",
        row["reset"] == "1",
        float(row["diameter_mm"]),
        row["diameter_known"] == "1",
        numbers("t", names.channels),
        tuple(row[f"ok_{stem}"] == "1" for stem in names.channels),
        numbers("trim", names.outputs),
        row["interlocks_met"] == "1",
        row["connected"] == "1",
        row["other_compensation"] == "1",
        numbers("read", names.outputs),
        row["read_ok"] == "1",
        row["restart"] == "1",
    )
    said = twin.step(inputs)
    for _ in range(int(row["calls"]) - 1):
        said = twin.step(inputs._replace(restart=False))
    return said


@pytest.mark.parametrize("double", [True, False])
def test_a_reader_of_the_text_alone_gets_every_output_again(double: bool) -> None:
    settings = random_settings(3, double=double)
    names, twin = settings.names, Twin(settings)
    rounded = rounding(double=double)
    rows = rows_of(vectors_csv(settings))
    assert len(rows) > 300
    for row in rows:
        said = replayed(settings, row, twin)
        wanted = (
            *(rounded(float(row[f"correction_{stem}"])) for stem in names.outputs),
            *(rounded(float(row[f"model_{stem}"])) for stem in names.outputs),
            *(rounded(float(row[f"wanted_{stem}"])) for stem in names.outputs),
            *(rounded(float(row[f"weight_{stem}"])) for stem in names.outputs),
            *(row[f"limit_{stem}"] == "1" for stem in names.outputs),
            *(rounded(float(row[f"part_{stem}"])) for stem in names.parts),
            *(int(row[f"quality_{stem}"]) for stem in names.channels),
            int(row["state"]),
            row["enabled"] == "1",
            row["linked"] == "1",
            int(row["fault_word"]),
            int(row["model_quality"]),
            int(row["outcome_word"]),
            row["refused"] == "1",
            int(row["heartbeat"]),
        )
        flat: list[float] = []
        for value in said:
            flat.extend(value if isinstance(value, tuple) else (value,))
        assert tuple(flat) == wanted, row


def test_the_default_is_the_whole_course_within_its_rows() -> None:
    settings = random_settings(4, quick=False)
    text = vectors_csv(settings)
    rows = rows_of(text)
    assert len(rows) <= MOST_ROWS
    assert "- cut" not in text
    assert sum(int(row["calls"]) for row in rows) == sum(1 for _ in course_steps(settings, seed=1))
    assert {row["state"] for row in rows} == set("012345")
    assert {"0", "1"} == {row["restart"] for row in rows}
    words = 0
    for row in rows:
        words |= int(row["fault_word"])
    # An offset outside its total never becomes a fault: nobody can enable.
    assert words == 2**11 - 1


def test_the_same_settings_give_the_same_bytes() -> None:
    assert vectors_csv(random_settings(5)) == vectors_csv(random_settings(5))


def test_a_table_ends_after_its_rows_and_says_so() -> None:
    settings = random_settings(5)
    text = vectors_csv(settings, most_rows=20)
    assert len(rows_of(text)) == 20
    assert "- cut" in text
    with pytest.raises(ConfigurationError):
        vectors_csv(settings, most_rows=0)


def test_the_head_says_model_cycle_numbers_and_units() -> None:
    settings = random_settings(6, double=False)
    steps = scenario_steps(settings, hours=0.01, seed=1)
    lines = vectors_csv(settings, steps).splitlines()
    head = [line for line in lines if line.startswith("# ") and not line.startswith("# unit")]
    assert "# model sha256: not stated" in head
    assert "# cycle: 1 s" in head
    assert any("REAL binary32 - 9 digits" in line for line in head)
    names, units = lines[len(head)].split(","), lines[len(head) + 1].split(",")
    assert len(names) == len(set(names)) == len(units)
    assert all(line.count(",") == len(names) - 1 for line in lines[len(head) :])
    assert all(re.fullmatch(r"# [\w .:+-]+", line) for line in head)
