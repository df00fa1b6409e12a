from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
import pytest

from tests.refusals import check_refusals
from tests.unit.files.builders import remarks_of
from thermaxis.errors import ThermaxisError
from thermaxis.files import read_positioning
from thermaxis.positioning import PositioningTest, TimeSource
from thermaxis.quantities import AxisKind

Reading = tuple[str, int, int, float]

TARGETS = (-20.0, -7.5, 0.0, 12.25)
SETTINGS = "REF_PV=IOC:Laser\nTGT_SET_PV=IOC:X-PosCmd\nUNIT=mm\nCYCLES=3\nPOSITIONS=4\nDEC=5\n"


def deviation_um(direction: str, target: int, cycle: int) -> float:
    """Deviation that tells where it belongs."""
    return (target + cycle / 10) * (1 if direction == "FWD" else -1)


def all_readings(
    targets: Sequence[float] = TARGETS, cycles: int = 3, directions: Iterable[str] = ("FWD", "BWD")
) -> list[Reading]:
    return [
        (direction, k, cycle, position + deviation_um(direction, k, cycle) / 1000)
        for direction in directions
        for cycle in range(1, cycles + 1)
        for k, position in enumerate(targets, start=1)
    ]


def without(absent: Callable[[Reading], bool]) -> list[Reading]:
    return [reading for reading in all_readings() if not absent(reading)]


def number(value: float) -> str:
    """Print a position as the tool does: sixteen decimals and no zero before the point."""
    text = f"{value:.16f}"
    return text.replace("0.", ".", 1) if text.startswith(("0.", "-0.")) else text


def dat(
    targets: Sequence[float] = TARGETS,
    readings: Iterable[Reading] | None = None,
    *,
    settings: str = SETTINGS,
) -> str:
    readings = all_readings(targets) if readings is None else readings
    return (
        "TEST_DATA=# Input for ISO230-2 calculations, CYCLES=99\n"
        "# UNIT : unit of the positions\n#\n"
        + settings
        + "".join(f"TGT_DATA[{k}]={value:g}\n" for k, value in enumerate(targets, start=1))
        + "".join(f"REF_DATA_{d}[{k},{cycle}]={number(v)}\n" for d, k, cycle, v in readings)
        + "  \n"
    )


def saved(folder: Path, text: str) -> Path:
    path = folder / "run_ISO230.dat"
    path.write_bytes(text.encode())
    return path


def read(folder: Path, text: str) -> PositioningTest:
    return read_positioning(saved(folder, text))


def remark(test: PositioningTest, part: str) -> str:
    found = [text for text in remarks_of(test) if part in text]
    assert len(found) == 1, remarks_of(test)
    return found[0]


def test_every_reading_comes_to_its_target_cycle_and_direction(tmp_path: Path):
    text = dat()
    assert "]=.00" in text  # the tool writes no zero before the point
    assert "]=-.00" in text
    test = read(tmp_path, text)
    assert test.kind is AxisKind.LINEAR
    assert test.time_source is TimeSource.NONE
    assert test.time_s is None
    assert test.order is None
    assert test.target.tolist() == list(TARGETS)
    assert test.deviation.shape == (4, 3, 2)
    for k in range(4):
        for cycle in range(3):
            for approach, direction in enumerate(("FWD", "BWD")):
                expected = deviation_um(direction, k + 1, cycle + 1)
                assert test.deviation[k, cycle, approach] == pytest.approx(expected, abs=1e-9)
    assert remarks_of(test) == ()


def test_readings_are_filled_in_by_index_and_not_by_row(tmp_path: Path):
    rows = all_readings()
    shuffled = [rows[k] for k in np.random.default_rng(3).permutation(len(rows))]
    first, second = read(tmp_path, dat()), read(tmp_path, dat(readings=shuffled))
    assert np.array_equal(first.deviation, second.deviation)


def test_names_of_variables_become_the_header(tmp_path: Path):
    header = read(tmp_path, dat(settings=SETTINGS + "PLACE= hall <2>\x07 # by the door\n")).header
    assert dict(header) == {
        "ref_pv": "IOC:Laser",
        "tgt_set_pv": "IOC:X-PosCmd",
        "dec": "5",
        "place": "hall <2>",
    }


def test_nanometres_survive_the_subtraction(tmp_path: Path):
    readings = [(d, k, c, v) for d, k, c, v in all_readings((10000.0, 10001.0))]
    readings[0] = ("FWD", 1, 1, 10000.000000123)
    test = read(tmp_path, dat((10000.0, 10001.0), readings, settings="CYCLES=3\nPOSITIONS=2\n"))
    assert test.deviation[0, 0, 0] == pytest.approx(0.000123, abs=1e-8)


def test_every_unit_gives_the_same_run(tmp_path: Path):
    for unit, per_mm, scale in (
        *(("MM", 1.0, 1.0), ("um", 1e3, 1.0), ("µm", 1e3, 1.0)),
        *(("nm", 1e6, 1.0), ("m", 1e-3, 1.0), ("deg", 1.0, 3.6)),
    ):
        targets = [value * per_mm for value in TARGETS]
        readings = [(d, k, c, v * per_mm) for d, k, c, v in all_readings()]
        settings = SETTINGS.replace("UNIT=mm", f"UNIT={unit}")
        test = read(tmp_path, dat(targets, readings, settings=settings))
        assert test.kind is (AxisKind.ROTARY if unit == "deg" else AxisKind.LINEAR)
        assert test.target.tolist() == list(TARGETS)
        assert test.deviation[3, 1, 1] == pytest.approx(-4.2 * scale, abs=1e-7)


def test_a_file_without_settings_has_the_defaults_of_the_tool(tmp_path: Path):
    targets = [float(k) for k in range(8)]
    test = read(tmp_path, dat(targets, all_readings(targets, 5), settings=""))
    assert test.kind is AxisKind.LINEAR
    assert test.deviation.shape == (8, 5, 2)


def test_a_file_with_one_direction_is_unidirectional(tmp_path: Path):
    for direction, approaches in (("FWD", (True, False)), ("BWD", (False, True))):
        test = read(tmp_path, dat(readings=all_readings(directions=[direction])))
        assert test.measured_approaches == approaches
        assert remark(test, "readings only")


def test_targets_from_the_largest_to_the_smallest_are_turned_round(tmp_path: Path):
    test = read(tmp_path, dat(TARGETS[::-1]))
    assert test.target.tolist() == list(TARGETS)
    assert test.deviation[0, 0, 0] == pytest.approx(deviation_um("FWD", 4, 1), abs=1e-9)
    assert remark(test, "largest to the smallest")


def lines_changed(old: str, new: str) -> str:
    assert old in dat()
    return dat().replace(old, new)


@pytest.mark.parametrize(
    ("text", "missing", "part"),
    [
        (
            dat(readings=without(lambda r: r[:3] == ("FWD", 2, 3))),
            1,
            "1 of 24 readings are missing: target 2 cycle 3 forward",
        ),
        (
            dat(readings=without(lambda r: r[2] == 3 and (r[0] == "BWD" or r[1] > 2))),
            6,
            "6 of 24 readings are missing",
        ),
        (lines_changed("CYCLES=3\n", "CYCLES=6\n"), 0, "24 of 48"),
        (dat() + "TEST_DATA_FWD[1,1]=4\n", 0, "TEST_DATA_FWD (line 39)"),
    ],
)
def test_what_is_odd_is_read_with_a_remark(tmp_path: Path, text: str, missing: int, part: str):
    test = read(tmp_path, text)
    assert remark(test, part)
    assert int(np.isnan(test.deviation).sum()) == missing
    assert test.deviation[3, 1, 1] == pytest.approx(-4.2, abs=1e-9)


def test_what_is_no_whole_run_is_refused(tmp_path: Path):
    wrong = {
        lines_changed("UNIT=mm", f"UNIT={unit}"): "line 6, column UNIT: unknown_length_or_angle"
        for unit in ("inch", "rad", "5")
    }
    wrong |= {
        lines_changed("CYCLES=3", "CYCLES=7"): "line 7, column CYCLES: cycles_cut_short",
        lines_changed("CYCLES=3", "CYCLES=999999999"): "line 7, column CYCLES: cycles_cut_short",
        dat(readings=without(lambda r: r[0] == "BWD" and r[1] == 2 and r[2] > 1)): (
            "too_few_readings_of_target"
        ),
        dat(readings=all_readings()[:-3]): "line 34: readings_cut_short",
        "# only a comment\n": "no_run_headings",
        "UNIT=mm\nTGT_DATA[1]=2\n": "no_readings_in_file",
    }
    check_refusals(read_positioning, tmp_path / "run_ISO230.dat", wrong)


def test_a_file_cut_short_is_never_read_as_the_whole(tmp_path: Path):
    text = dat()
    whole = read(tmp_path, text).deviation
    end_of_forward = text.index("REF_DATA_BWD")
    end_of_readings = text.rindex("\n  ")
    ends = (range(1, end_of_readings, 9), range(end_of_readings - 60, end_of_readings))
    for length in {*ends[0], *ends[1], *range(end_of_forward - 30, end_of_forward + 30)}:
        path = saved(tmp_path, text[:length])
        try:
            test = read_positioning(path)
        except ThermaxisError:
            continue
        # what is left is a unidirectional run, and says so
        assert end_of_forward - 1 <= length < end_of_forward + len("REF_DATA_BWD[1,1]=-2")
        assert remark(test, "forward readings only")
        assert np.array_equal(test.deviation[:, :, 0], whole[:, :, 0])


def test_a_contradiction_is_refused_with_its_place(tmp_path: Path):
    text = dat()
    changes = (
        ("UNIT=mm", "UNIT mm", "line 6: not_key_and_value"),
        ("UNIT=mm", "=mm", "line 6: not_key_and_value"),
        ("UNIT=mm", "UNIT=mm\nUNIT=um", "line 7: stated_differently"),
        ("CYCLES=3", "CYCLES=2", "line 22: reading_outside_plan"),
        ("CYCLES=3", "CYCLES=0", "line 7, column CYCLES: not_positive"),
        ("CYCLES=3", "CYCLES=three", "line 7, column CYCLES: not_a_whole_number"),
        ("POSITIONS=4", "POSITIONS=3", "line 17: reading_outside_plan"),
        ("POSITIONS=4", "POSITIONS=5", "column POSITIONS: target_count"),
        ("POSITIONS=4\n", "", "column POSITIONS: target_count"),
        ("TGT_DATA[2]=-7.5\n", "", "column POSITIONS: target_count"),
        ("TGT_DATA[2]=-7.5", "TGT_DATA[3]=-7.5", "line 12: stated_twice"),
        ("TGT_DATA[2]=-7.5", "TGT_DATA[2]=nan", "line 11, column TGT_DATA[2]: not_a_number"),
        ("TGT_DATA[2]=-7.5", "TGT_DATA[2]=", "line 11, column TGT_DATA[2]: number_missing"),
        ("TGT_DATA[2]=-7.5", "TGT_DATA[2]=0", "line 12: targets_not_in_order"),
        ("TGT_DATA[2]=-7.5", "TGT_DATA[2,1]=-7.5", "line 11: number_of_indices"),
        (
            "TGT_DATA[2]=-7.5",
            "TGT_DATA[two]=-7.5",
            "line 11, column TGT_DATA[two]: not_a_whole_number",
        ),
        ("REF_DATA_FWD[2,2]=-", "REF_DATA_FWD[2]=-", "line 19: number_of_indices"),
        ("REF_DATA_FWD[2,2]=-", "REF_DATA_FWD[0,2]=-", "line 19: reading_outside_plan"),
        ("REF_DATA_FWD[2,2]=-", "REF_DATA_FWD[2,1]=-", "line 19: reading_twice"),
        (
            "REF_DATA_FWD[2,2]=-",
            "REF_DATA_FWD[2,2]=x",
            "line 19, column REF_DATA_FWD[2,2]: not_a_number",
        ),
        (
            "REF_DATA_FWD[2,2]=-",
            "REF_DATA_FWD[2,2]=-9999999999",
            "line 19, column REF_DATA_FWD[2,2]: magnitude_too_large",
        ),
    )
    assert all(old in text for old, _, _ in changes)
    wrong = {text.replace(old, new, 1): said for old, new, said in changes}
    check_refusals(read_positioning, tmp_path / "run_ISO230.dat", wrong)
