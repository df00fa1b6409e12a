"""Files of settings: read back as written, and every mistake named with its file and key."""

import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.refusals import check_refusals, refusal_of
from thermaxis.compensation import (
    CompensationModel,
    GainPoint,
    Limits,
    Output,
    Part,
    Provenance,
    Section,
    TrainingLog,
)
from thermaxis.errors import ConfigurationError, MeasurementFileError, ThermaxisError
from thermaxis.files import (
    format_model,
    format_plan,
    model_sha256,
    plan_as_json,
    plan_sha256,
    read_budget,
    read_correction_limits,
    read_figure_limits,
    read_header,
    read_model,
    read_plan,
    read_regions,
    read_thermal_log,
    read_thermal_mapping,
    write_model,
    write_plan,
)
from thermaxis.files.settings import read_toml
from thermaxis.positioning import BACKWARD, FORWARD, Cycle, TestPlan
from thermaxis.quantities import AxisKind

PLAN = TestPlan(
    kind=AxisKind.LINEAR,
    axis="X",
    target=np.array([0.25, 21.5, 38.0]),
    cycles=5,
    feed=300.0,
    dwell_s=2.0,
    overrun=5.0,
    recording_s=1.5,
    pitch=5.0,
    interval=19.5,
    random_part=2.5,
    seed=7,
    title="x) G0 Z-100 <b>ü",
)
CONTENT: dict[str, object] = json.loads("""{
  "format": "thermaxis-plan", "version": 1, "kind": "linear", "axis": "X",
  "title": "x) G0 Z-100 <b>ü", "cycle": "standard", "approaches": ["forward", "backward"],
  "cycles": 5, "targets_mm": [0.25, 21.5, 38.0], "feed_mm_per_min": 300.0, "dwell_s": 2.0,
  "recording_s": 1.5, "overrun_mm": 5.0, "pitch_mm": 5.0, "interval_mm": 19.5,
  "random_part_mm": 2.5, "seed": 7}""")
MAY_BE_LEFT_OUT = {"title", "recording_s", "pitch_mm", "interval_mm", "random_part_mm", "seed"}
TABLE = Part(
    *("table", "T_table_c", "T_column_c", -45.5),
    (Section(17.9, 25899.5), Section(1e-9, 0.5)),
    90.0,
    (GainPoint(0.0, 1.0), GainPoint(3000.0, 2.2)),
    *(1.1, -0.25, 14.7),
)
MODEL = CompensationModel(
    outputs=(
        Output("Z_um", (Part("spindle", "T_spindle_c", "T_column_c", 7.9126), TABLE), 0.1),
        Output("X_um", (Part("spindle", "T_spindle_c", "", 0.1 + 0.2),)),
    ),
    sample_time_s=10.0,
    reference_c={"T_column_c": 22.1},
    input_filter_s=60.0,
    provenance=Provenance(
        *("modal", "thermaxis 0.1.0", "2026-03-31"),
        (TrainingLog("heating.csv", "ab" * 32, 6669, 2),),
        {"Z_um.fit_percent": 91.25},
    ),
    warnings=("the slow mode is not supported by the record",),
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "settings"


def with_key(path: Path, key: str, *value: object) -> Path:
    """Write the plan with another value of a key, or without the key."""
    content = {k: v for k, v in CONTENT.items() if k != key}
    content |= dict.fromkeys([key] if value else [], *value)
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def same(one: TestPlan, other: TestPlan) -> bool:
    return plan_as_json(one) == plan_as_json(other)


def test_a_plan_has_the_documented_keys_and_its_hash() -> None:
    plain = json.dumps(CONTENT, sort_keys=True, separators=(",", ":"))
    expected = hashlib.sha256(plain.encode()).hexdigest()
    assert plan_sha256(PLAN) == expected
    assert json.loads(format_plan(PLAN)) == {**CONTENT, "sha256": expected} == plan_as_json(PLAN)
    assert list(plan_as_json(PLAN)) == [*CONTENT, "sha256"]
    assert format_plan(PLAN).isascii()


def test_the_hash_of_a_plan_never_changes_between_versions_of_the_program() -> None:
    plan = TestPlan(AxisKind.ROTARY, "C", np.array([0.0, 90.0]), 5, 360.0, 2.0, 3.0)
    assert plan_sha256(plan) == "4e146e3d725f489e5db7007a88abdb4326f59d39d77b5f6a78714acf5239cd94"


@st.composite
def plans(draw: st.DrawFn) -> TestPlan:
    start = draw(st.integers(-(10**6), 10**6))
    steps = draw(st.lists(st.integers(1, 10**5), min_size=2, max_size=30))
    chosen = st.none() | st.floats(1e-3, 100.0)
    return TestPlan(
        kind=draw(st.sampled_from(AxisKind)),
        axis="X",
        target=(start + np.cumsum(steps)) / 1000.0,
        cycles=3,
        feed=draw(st.floats(1e-3, 1e5)),
        dwell_s=draw(st.floats(0, 100)),
        overrun=2.5,
        cycle=draw(st.sampled_from(Cycle)),
        approaches=draw(st.sampled_from([(FORWARD, BACKWARD), (FORWARD,), (BACKWARD,)])),
        recording_s=draw(st.floats(0, 100)),
        pitch=draw(chosen),
        interval=draw(chosen),
        random_part=draw(chosen),
        seed=draw(st.none() | st.integers(0, 2**32)),
        title=draw(st.text(max_size=100).filter(str.isprintable)),
    )


@given(plan=plans())
@settings(derandomize=True, max_examples=15, deadline=None)
def test_a_plan_that_is_written_and_read_is_the_same(
    tmp_path_factory: pytest.TempPathFactory, plan: TestPlan
) -> None:
    file = tmp_path_factory.getbasetemp() / "round_trip.json"
    write_plan(plan, file)
    again = read_plan(file)
    np.testing.assert_array_equal(again.target, plan.target)
    assert same(again, plan)
    assert (again.kind, again.cycle, again.approaches) == (plan.kind, plan.cycle, plan.approaches)
    assert format_plan(again) == file.read_text(encoding="ascii")


def test_every_change_of_a_plan_changes_its_hash() -> None:
    changes: list[dict[str, Any]] = [
        *({"axis": "Y"}, {"target": np.array([0.25, 21.501, 38.0])}, {"cycles": 6}),
        *({"feed": 301.0}, {"dwell_s": 2.1}, {"overrun": 4.0}, {"recording_s": 0.0}),
        *({"cycle": Cycle.STEP}, {"approaches": (BACKWARD,)}, {"pitch": None}),
        *({"interval": 19.0}, {"random_part": 2.0}, {"seed": 8}, {"title": ""}),
        {"kind": AxisKind.ROTARY},
    ]
    hashes = {plan_sha256(plan) for plan in (PLAN, *(replace(PLAN, **c) for c in changes))}
    assert len(hashes) == len(changes) + 1


def test_a_stated_hash_must_fit_and_may_be_left_out(path: Path) -> None:
    stated = {**CONTENT, "sha256": plan_sha256(PLAN)}
    path.write_text(json.dumps({**stated, "dwell_s": 1.0}), encoding="utf-8")
    assert refusal_of(read_plan, path) == "sha256: hash_mismatch"
    path.write_text(json.dumps({**stated, "dwell_s": 2}), encoding="utf-8")
    assert same(read_plan(path), PLAN)
    assert read_plan(with_key(path, "dwell_s", 1.0)).dwell_s == 1.0


def test_what_a_plan_needs_must_be_there_and_the_rest_may_be_null(path: Path) -> None:
    for key in CONTENT:
        for value in ((), (None,)):
            with_key(path, key, *value)
            if key in MAY_BE_LEFT_OUT:
                assert read_plan(path).cycles == 5
            else:
                assert refusal_of(read_plan, path).startswith(key)


WRONG_VALUES: dict[str, list[object]] = {
    "format": ["thermaxis-model"],
    "version": [2, True],
    "kind": ["round"],
    "axis": ["X G0", 7, "X" * 300],
    "title": ["a\nb"],
    "cycle": ["bidirectional"],
    "approaches": ["forward", ["backward", "forward"], ["up"], []],
    "cycles": [0, 2.0, -1, 10**30, 10**9],
    "targets_mm": [
        *("0, 1", [0.0], [0.0, "1"], [0.0, True], [1.0, 0.0], [0.0, 1.00049]),
        *([0.0, 1e300], [0.0, 10**400]),
    ],
    "feed_mm_per_min": [0, "300"],
    "dwell_s": [-1],
    "overrun_mm": [0],
    "seed": [1.5],
}


def test_a_wrong_value_of_a_plan_is_refused_with_its_key(path: Path) -> None:
    for key, values in WRONG_VALUES.items():
        for value in values:
            assert refusal_of(read_plan, with_key(path, key, value)).startswith(key), value


def test_an_unknown_key_is_refused_with_the_nearest_known_one(path: Path) -> None:
    for key, nearest in (("dwel_s", "dwell_s"), ("feed_deg_per_min", "feed_mm_per_min")):
        with pytest.raises(ConfigurationError) as caught:
            read_plan(with_key(path, key, 2.0))
        assert (caught.value.code, caught.value.values["near"]) == ("unknown_key_near", nearest)


def test_the_largest_plan_is_read(path: Path) -> None:
    plan = replace(PLAN, target=np.round(-99_999.999 + 19.997 * np.arange(10_000), 3))
    write_plan(plan, path)
    assert same(read_plan(path), plan)


def test_a_model_that_is_written_and_read_is_the_same(path: Path) -> None:
    write_model(MODEL, path)
    again = read_model(path)
    assert again == MODEL
    assert format_model(again) == path.read_text(encoding="ascii")
    assert model_sha256(again) == json.loads(path.read_text(encoding="ascii"))["sha256"]


def test_only_what_a_model_needs_is_enough(path: Path) -> None:
    part = {"name": "s", "plus": "a", "direct_gain_um_per_k": 2, "sections": []}
    outputs = [{"name": "Z_um", "parts": [part]}]
    content = {"format": "thermaxis-compensation-model", "version": 1, "outputs": outputs}
    path.write_text(json.dumps(content), encoding="utf-8")
    expected = CompensationModel(outputs=(Output("Z_um", (Part("s", "a", "", 2.0),)),))
    assert read_model(path) == expected


def test_a_mistake_in_a_model_is_named_with_its_place(path: Path) -> None:
    changes: list[tuple[Callable[[Any], object], str]] = [
        (lambda t: t.update(version=2), "version: other_version"),
        (lambda t: t.update(version=True), "version: other_version"),
        (lambda t: t.update(format="thermaxis-plan"), "format: other_format"),
        (lambda t: t.update(extra=1), "extra: unknown_key"),
        (lambda t: t.update(limits={"largest_um": 5}), "limits: limits_in_model"),
        (lambda t: t.update(sign="the other way round"), "sign: other_sign_convention"),
        (lambda t: t.pop("outputs"), "outputs: key_needed"),
        (lambda t: t["outputs"][0].update(offset_um="0"), "outputs[0].offset_um: no_number"),
        (
            lambda t: t["outputs"][0]["parts"][1].update(delay=1),
            "outputs[0].parts[1].delay: unknown_key",
        ),
        (
            lambda t: t["outputs"][0]["parts"][1]["sections"][0].update(time_constant_s=-1),
            "time_constant_s: ",
        ),
        (
            lambda t: t["outputs"][0]["parts"][0].update(direct_gain_um_per_k=True),
            "outputs[0].parts[0].direct_gain_um_per_k",
        ),
        (
            lambda t: t["outputs"][0]["parts"][0].update(direct_gain_um_per_k=1e13),
            "outputs[0].parts[0].direct_gain_um_per_k",
        ),
        (
            lambda t: t["outputs"][0]["parts"][0].update(direct_gain_um_per_k=5),
            "sha256: hash_mismatch",
        ),
        (lambda t: t["outputs"].clear(), "outputs: "),
        (lambda t: t["warnings"].append(5), "warnings[1]"),
        (lambda t: t["warnings"].append("a\nb"), "warnings[1]"),
        (lambda t: t["provenance"].update(logs=[5]), "provenance.logs[0]: not_a_table"),
        (lambda t: t["provenance"].update(logs=5), "provenance.logs: not_a_list"),
        (lambda t: t["provenance"]["logs"][0].update(rows=-1), "provenance.logs[0].rows: negative"),
        (lambda t: t.update(reference="stated", reference_c={}), "reference_c: "),
    ]
    for change, said in changes:
        table = json.loads(format_model(MODEL))
        change(table)
        path.write_text(json.dumps(table), encoding="utf-8")
        assert refusal_of(read_model, path).startswith(said)


READERS = {
    "plan": (read_plan, lambda path: write_plan(PLAN, path)),
    "model": (read_model, lambda path: write_model(MODEL, path)),
}


@pytest.mark.parametrize("read", [read_plan, read_model])
def test_what_is_no_json_object_is_refused(path: Path, read: Callable[[Path], object]) -> None:
    wrong = {
        b"": "line 1, column 1: not_json",
        b"{\n  'format': 1}": "line 2, column 3: not_json",
        b"[1, 2]": "not_a_table",
        b"\xff\xfe{": "not_utf8",
        b'{"format": NaN}': "not_a_number",
        b'{"format": 1, "format": 2}': "stated_twice",
        b"[" * 200_000: "not_json",
        b'{"cycles": ' + b"9" * 20_000 + b"}": "not_json",
        b" " * 5_000_001: "file_too_large",
    }
    check_refusals(read, path, wrong)


@pytest.mark.parametrize("kind", READERS)
def test_json_is_written_whole_or_not_at_all(
    tmp_path: Path, path: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    read, write = READERS[kind]
    write(path)
    (tmp_path / "other").touch()
    assert path.stat().st_mode == (tmp_path / "other").stat().st_mode
    (tmp_path / "other").unlink()
    content = path.read_bytes()
    path.write_bytes(b"\xef\xbb\xbf" + content)  # a byte order mark does no harm
    read(path)
    path.chmod(0o640)
    write(path)
    assert path.read_bytes() == content
    assert path.stat().st_mode & 0o777 == 0o640
    link, loop = tmp_path / "link", tmp_path / "loop"
    link.symlink_to(path)
    loop.symlink_to(loop)
    write(link)
    assert link.is_symlink()
    for place in (tmp_path, tmp_path / "no" / "file.json", Path("a\0b"), loop):
        with pytest.raises(ConfigurationError) as caught:
            write(place)
        assert caught.value.code == "file_unwritable"
    write(Path("/dev/null"))
    assert not Path("/dev/null").is_file()

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    path.write_text("{}")
    with pytest.raises(ConfigurationError, match="No space left"):
        write(path)
    assert path.read_text() == "{}"
    assert sorted(tmp_path.iterdir()) == sorted([path, link, loop])


TOML_READERS: list[Callable[[Path], object]] = [
    read_correction_limits,
    read_header,
    partial(read_budget, kind=AxisKind.LINEAR),
    partial(read_figure_limits, kind=AxisKind.LINEAR),
    partial(read_regions, mm_per_pixel=None),
]


def test_what_cannot_be_read_is_named(tmp_path: Path, path: Path) -> None:
    readers = (read_plan, read_model, *TOML_READERS)
    for read in readers:
        assert refusal_of(read, path) == "file_not_found"
        assert refusal_of(read, tmp_path) == "not_a_file"
        assert refusal_of(read, Path("a\0b")) == "file_unreadable"
    if hasattr(os, "mkfifo"):
        os.mkfifo(path)  # is not waited for
        for read in readers:
            assert refusal_of(read, path) == "not_a_file"


def test_what_is_no_toml_is_refused(path: Path) -> None:
    wrong = {
        b"[Z_um": "not_toml",
        b"\xff" * 3: "not_utf8",
        b"a = " + b"[" * 9_000: "not_toml",
        b"a = " + b"[" * 20_000: "line 1: not_toml",
        b"a = " + b"9" * 9_000: "not_toml",
        b"a." * 200 + b"b = 1": "line 1: not_toml",
        b"11." * 300 + b"b = 1": "line 1: not_toml",
        b"#" * 1_000_001: "file_too_large",
    }
    for read in TOML_READERS:
        check_refusals(read, path, wrong)


def test_a_line_may_have_hundreds_of_decimals(path: Path) -> None:
    numbers = [k / 8 for k in range(1000)]
    path.write_text(f"a = {numbers}\n", encoding="utf-8")
    assert read_toml(path) == {"a": numbers}


LIMITS = "[Z_um]\nlargest_um = 100\nlargest_rate_um_per_s = 0.05\n"


def test_limits_are_read_by_output(path: Path) -> None:
    path.write_text("\ufeff" + LIMITS + LIMITS.replace("Z_um", '"X um"'), encoding="utf-8")
    assert read_correction_limits(path) == {n: Limits(100.0, 0.05) for n in ("Z_um", "X um")}


def test_a_mistake_in_limits_is_named(path: Path) -> None:
    for text, said in (
        ("", "no_limits"),
        ("Z_um = 5", "Z_um: not_a_table"),
        (LIMITS.replace("largest_um = 100\n", ""), "Z_um.largest_um: missing_key"),
        (LIMITS + "largest = 5\n", "line 4, Z_um.largest: unknown_key_near"),
        (LIMITS.replace("100", "0"), "Z_um.largest_um: "),
        (LIMITS.replace("100", "nan"), "Z_um.largest_um: "),
        (LIMITS.replace("100", '"a"'), "Z_um.largest_um: no_number"),
        (LIMITS.replace("100", "true"), "Z_um.largest_um: no_number"),
    ):
        path.write_text(text, encoding="utf-8")
        assert said in refusal_of(read_correction_limits, path)


def mapped(path: Path, mapping: str, log: str) -> Any:
    (path.parent / "log.csv").write_text(log)
    path.write_text(mapping)
    return read_thermal_log(path.parent / "log.csv", mapping=path)


def test_a_mapping_names_converts_and_leaves_out_columns(path: Path) -> None:
    log = mapped(
        path,
        """
        [time]
        column = "when"
        format = "%m/%d/%Y %H:%M:%S"
        [columns]
        "Temp 2" = "T_hall_C"
        [columns."Temp 1"]
        name = "T_spindle_c"
        unit = "degC"
        factor = 0.5555555555555556
        offset = -17.77777777777778
        [columns.Pos]
        unit = "um"
        factor = 1000
        [columns.junk]
        leave_out = true
        """,
        "when,Temp 1,Temp 2,junk,Pos\n"
        "01/02/2026 10:00:00,68,1,9,0.5\n01/02/2026 10:00:05,86,2,9,1\n",
    )
    assert dict(log.units) == {"T_spindle_c": "degC", "T_hall_C": "degC", "Pos": "um"}
    np.testing.assert_allclose(log.columns["T_spindle_c"], [20.0, 30.0])
    np.testing.assert_allclose(log.columns["Pos"], [500.0, 1000.0])
    assert log.duration_s == 5.0
    assert (log.start.month, log.start.day) == (1, 2)


def test_a_mapping_states_the_times(path: Path) -> None:
    log = mapped(path, "[time]\nsample_time_s = 0.5\n", "u,y\n1,2\n3,4\n5,6\n")
    np.testing.assert_array_equal(log.time_s, [0.0, 0.5, 1.0])
    np.testing.assert_array_equal(log.columns["u"], [1.0, 3.0, 5.0])
    log = mapped(path, "[time]\nsample_time_s = 2\n", "u\n1\n3\n")
    assert (list(log.columns), log.duration_s) == (["u"], 2.0)
    log = mapped(path, '[time]\ncolumn = "tick"\nunit = "ms"\n', "tick,y\n0,2\n250,4\n")
    assert log.duration_s == 0.25


def test_what_a_mapping_cannot_say_is_an_error(path: Path) -> None:
    for text, said in (
        ("[colums]\n", "colums: unknown_key"),
        ("[columns.a]\nnme = 'x'\n", "columns.a.nme: unknown_key"),
        ("[time]\nzone = 'x'\n", "time.zone: unknown_key"),
        *((f"[columns.a]\nfactor = {v}\n", "columns.a.") for v in ("'x'", "true", "0")),
        *((f"[columns.a]\noffset = {v}\n", "columns.a.") for v in ("nan", "1e400", "1e13")),
        ("[columns.a]\nunit = 'parsec'\n", "columns.a.unit: unknown_unit"),
        ("[columns.a]\nname = 3\n", "columns.a.name: not_a_text"),
        ("[columns.a]\nleave_out = 1\n", "columns.a.leave_out: no_boolean"),
        ("[columns]\na = 3\n", "columns.a: not_a_table"),
        ("columns = 3\n", "columns: not_a_table"),
        ("[columns]\na = 'x'\nb = 'x'\n", "columns: stated_twice"),
        ("[time]\nunit = 'years'\n", "time.unit: unknown_choice"),
        ("[time]\nsample_time_s = -1\n", "time.sample_time_s: not_positive"),
        ("[time]\nsample_time_s = 1\ncolumn = 't'\n", "time.column: times_stated_twice"),
        ("not toml", "not_toml"),
    ):
        path.write_text(text)
        assert said in refusal_of(read_thermal_mapping, path)


def test_a_mapping_that_does_not_fit_the_log_or_is_none_is_an_error(path: Path) -> None:
    with pytest.raises(MeasurementFileError) as caught:
        mapped(path, "[columns]\nghost = 'x'\n[time]\ncolumn = 'u'\n", "u,y\n1,2\n")
    assert (caught.value.code, caught.value.values["name"]) == ("no_such_column", "ghost")
    path.write_bytes(b"\x00\xff" * 50)
    for mapping in (path, path.with_name("none.toml")):
        with pytest.raises(ThermaxisError):
            read_thermal_log(path.parent / "log.csv", mapping=mapping)
