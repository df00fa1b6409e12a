import hashlib
import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from thermaxis.errors import ConfigurationError
from thermaxis.files import format_plan, plan_as_json, plan_sha256, read_plan, write_plan
from thermaxis.files.settings.plan_json import LARGEST_PLAN_BYTES
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
CONTENT = {
    "format": "thermaxis-plan",
    "version": 1,
    "kind": "linear",
    "axis": "X",
    "title": "x) G0 Z-100 <b>ü",
    "cycle": "standard",
    "approaches": ["forward", "backward"],
    "cycles": 5,
    "targets_mm": [0.25, 21.5, 38.0],
    "feed_mm_per_min": 300.0,
    "dwell_s": 2.0,
    "recording_s": 1.5,
    "overrun_mm": 5.0,
    "pitch_mm": 5.0,
    "interval_mm": 19.5,
    "random_part_mm": 2.5,
    "seed": 7,
}
FIELDS = (
    *("kind", "axis", "cycles", "feed", "dwell_s", "overrun", "cycle", "approaches"),
    *("recording_s", "pitch", "interval", "random_part", "seed", "title"),
)


def same(one: TestPlan, other: TestPlan) -> bool:
    return np.array_equal(one.target, other.target) and all(
        getattr(one, name) == getattr(other, name) for name in FIELDS
    )


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "plan.json"


def write(path: Path, changes: dict[str, object], *, without: str = "") -> Path:
    content = {k: v for k, v in {**CONTENT, **changes}.items() if k != without}
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def refusal(path: Path) -> ConfigurationError:
    with pytest.raises(ConfigurationError) as caught:
        read_plan(path)
    assert str(path) in str(caught.value)
    return caught.value


def test_the_file_has_the_documented_keys_and_its_hash() -> None:
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
        seed=draw(st.none() | st.integers(0, 2**62)),
        title=draw(st.text(max_size=100).filter(str.isprintable)),
    )


@given(plan=plans())
@settings(derandomize=True, max_examples=100, deadline=None)
def test_a_plan_that_is_written_and_read_is_the_same_and_has_the_same_hash(
    tmp_path_factory: pytest.TempPathFactory, plan: TestPlan
) -> None:
    file = tmp_path_factory.getbasetemp() / "round_trip.json"
    write_plan(plan, file)
    again = read_plan(file)
    assert same(again, plan)
    assert plan_sha256(again) == plan_sha256(plan)
    assert format_plan(again) == file.read_text(encoding="ascii")


def test_every_change_changes_the_hash() -> None:
    changes: list[dict[str, object]] = [
        {"axis": "Y"},
        {"target": np.array([0.25, 21.501, 38.0])},
        {"cycles": 6},
        {"feed": 301.0},
        {"dwell_s": 2.1},
        {"overrun": 4.0},
        {"recording_s": 0.0},
        {"cycle": Cycle.STEP},
        {"approaches": (BACKWARD,)},
        {"pitch": None},
        {"interval": 19.0},
        {"random_part": 2.0},
        {"seed": 8},
        {"title": ""},
        {"kind": AxisKind.ROTARY},
    ]
    plans = [PLAN, *(replace(PLAN, **change) for change in changes)]
    assert len({plan_sha256(plan) for plan in plans}) == len(changes) + 1


def test_a_plan_that_was_changed_by_hand_is_told(path: Path) -> None:
    write(path, {"sha256": plan_sha256(PLAN), "dwell_s": 1.0})
    assert "key sha256: the hash does not fit" in str(refusal(path))
    write(path, {"dwell_s": 1.0})
    assert read_plan(path).dwell_s == 1.0
    write(path, {"sha256": plan_sha256(PLAN), "dwell_s": 2})
    assert same(read_plan(path), PLAN)


def test_what_may_be_left_out_may_be_left_out_or_null(path: Path) -> None:
    for key in ("title", "recording_s", "pitch_mm", "interval_mm", "random_part_mm", "seed"):
        assert read_plan(write(path, {}, without=key)).cycles == 5
        assert read_plan(write(path, {key: None})).cycles == 5


@pytest.mark.parametrize(
    "key",
    [
        *("format", "version", "kind", "axis", "cycle", "approaches", "cycles", "targets_mm"),
        *("feed_mm_per_min", "dwell_s", "overrun_mm"),
    ],
)
def test_what_a_plan_needs_must_be_there_and_not_null(path: Path, key: str) -> None:
    assert key in str(refusal(write(path, {}, without=key)))
    assert key in str(refusal(write(path, {key: None})))


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("format", "thermaxis-model", "this is no plan"),
        ("version", 2, "version 2"),
        ("version", True, "version True"),
        ("kind", "round", "neither linear nor rotary"),
        ("axis", "X G0", "no name of an axis"),
        ("axis", 7, "not a text"),
        ("axis", "X" * 300, "longer than 200"),
        ("title", "a\nb", "none that prints"),
        ("cycle", "bidirectional", "none of standard, pilgrim, step"),
        ("approaches", "forward", "not a list"),
        ("approaches", ["backward", "forward"], "in this order"),
        ("approaches", ["up"], "neither forward nor backward"),
        ("approaches", [], "not a list of approaches"),
        ("cycles", 0, "at least one cycle"),
        ("cycles", 2.0, "not a whole number"),
        ("cycles", -1, "not a whole number"),
        ("cycles", 10**30, "not a whole number"),
        ("cycles", 10**9, "more than 1000000"),
        ("targets_mm", "0, 1", "not a list"),
        ("targets_mm", [0.0], "at least two targets"),
        ("targets_mm", [0.0, "1"], "not a number"),
        ("targets_mm", [0.0, True], "not a number"),
        ("targets_mm", [1.0, 0.0], "not strictly increasing"),
        ("targets_mm", [0.0, 1.00049], "three decimals"),
        ("targets_mm", [0.0, 1e300], "at most 1e9"),
        ("targets_mm", [0.0, 10**400], "at most 1e9"),
        ("feed_mm_per_min", 0, "not positive"),
        ("feed_mm_per_min", "300", "not a number"),
        ("dwell_s", -1, "negative"),
        ("overrun_mm", 0, "not positive"),
        ("seed", 1.5, "not a whole number"),
    ],
)
def test_a_wrong_value_is_refused_with_file_and_key(
    path: Path, key: str, value: object, words: str
) -> None:
    error = refusal(write(path, {key: value}))
    assert key in str(error)
    assert words in str(error)


def test_an_unknown_key_is_refused_with_the_nearest_known_one(path: Path) -> None:
    error = refusal(write(path, {"dwel_s": 2.0}))
    assert "unknown key dwel_s" in error.what
    assert "The nearest known key is dwell_s" in error.remedy
    error = refusal(write(path, {"feed_deg_per_min": 300.0}))
    assert "unknown key feed_deg_per_min in the plan of a linear axis" in error.what
    assert "\\n" in str(refusal(write(path, {"a\nb": 1})))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "line 1, column 1: the file is not JSON"),
        (b"{\n  'format': 1}", "line 2"),
        (b"[1, 2]", "no JSON object"),
        (b"\xff\xfe{", "not UTF-8"),
        (b'{"format": NaN}', "NaN is not a number"),
        (b'{"format": 1, "format": 2}', "twice"),
        (b"[" * 200_000, "nested too deeply"),
        (b'{"cycles": ' + b"9" * 20_000 + b"}", "too long"),
        (b" " * (LARGEST_PLAN_BYTES + 1), "larger than 1 MB"),
    ],
)
def test_what_is_no_plan_at_all_is_refused(path: Path, content: bytes, words: str) -> None:
    path.write_bytes(content)
    assert words in str(refusal(path))


def test_a_byte_order_mark_does_no_harm(path: Path) -> None:
    path.write_bytes(b"\xef\xbb\xbf" + format_plan(PLAN).encode())
    assert same(read_plan(path), PLAN)


def test_files_that_cannot_be_read_or_written_are_named(path: Path, tmp_path: Path) -> None:
    assert "No such file" in str(refusal(path))
    assert "not a regular file" in str(refusal(tmp_path))
    for place in (tmp_path, tmp_path / "no" / "plan.json", Path("a\0b")):
        with pytest.raises(ConfigurationError, match="cannot be written"):
            write_plan(PLAN, place)
    with pytest.raises(ConfigurationError, match="cannot be read"):
        read_plan("a\0b")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_does_not_keep_the_reader_waiting(path: Path) -> None:
    os.mkfifo(path)
    assert "not a regular file" in str(refusal(path))


def test_the_largest_plan_is_read(path: Path) -> None:
    plan = replace(PLAN, target=np.round(-99_999.999 + 19.997 * np.arange(10_000), 3))
    write_plan(plan, path)
    assert path.stat().st_size < LARGEST_PLAN_BYTES
    assert same(read_plan(path), plan)
