"""Writing a run as tidy CSV and reading it again gives the same run."""

from dataclasses import replace
from datetime import datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from thermaxis.codes import remark
from thermaxis.errors import DataError
from thermaxis.files import format_tidy_csv, read_positioning, write_tidy_csv
from thermaxis.messages import sentence_of
from thermaxis.positioning import Cycle, PositioningTest, StartEnd, TimeSource
from thermaxis.quantities import AxisKind

quick = settings(
    max_examples=20,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)

numbers = st.floats(-1e9, 1e9, allow_nan=False)
# what no file of text may hold is not promised to survive
characters = st.characters(
    exclude_categories=["Cs"], exclude_characters="".join(map(chr, range(32))) + "\ufffe\uffff"
)
hostile = st.sampled_from(
    (
        *("=1+2", "+A1", "-5", "@SUM(A1)", "a,=b", "a; -1", "\t=cmd", "'quoted", "''=", '"json"'),
        *(
            "line\nbreak",
            "line\r\nbreak",
            "\u2028",
            "# not a comment",
            "key: value",
            " blanks ",
            "",
        ),
        *("µm", "Čeština", "<script>", "channel x", "cycle", "target_mm", "time_s", "5", "Run 3"),
        *(
            "none",
            "\\u002c",
            '"unclosed',
            "a|=b",
            "a,",
            "start",
            "cycle: step",
            "%0",
            "\N{SNOWMAN}",
        ),
    )
)
texts = st.one_of(hostile, st.text(characters, max_size=30), st.text(st.sampled_from(',;"=\n# -')))
zones = st.one_of(st.none(), st.integers(-14 * 60, 14 * 60)).map(
    lambda minutes: None if minutes is None else timezone(timedelta(minutes=minutes))
)
moments = st.datetimes(datetime(1950, 1, 1), datetime(2150, 1, 1))  # noqa: DTZ001  zones come apart


@st.composite
def readings(draw: st.DrawFn, shape: tuple[int, int, int]) -> np.ndarray:
    """Deviations with gaps, at least two per target and measured approach; maybe one approach."""
    values = np.array(draw(st.lists(numbers, min_size=6, max_size=40)))
    # equal values far beyond all others are refused as an instrument's codes
    deviation = np.resize(values, shape) * (1.0 - 1e-4 * np.arange(np.prod(shape)).reshape(shape))
    gaps = np.resize(draw(st.lists(st.booleans(), min_size=1, max_size=40)), shape)
    gaps[:, :2, :] = False
    deviation[gaps] = np.nan
    unmeasured = draw(st.sampled_from((None, None, 0, 1)))
    if unmeasured is not None:
        deviation[..., unmeasured] = np.nan
    return deviation


@st.composite
def orders(draw: st.DrawFn, deviation: np.ndarray) -> np.ndarray:
    given_readings = ~np.isnan(deviation)
    count = int(given_readings.sum())
    order = np.full(deviation.shape, np.nan)
    order[given_readings] = draw(st.permutations(range(1, count + 1)))
    return order


@st.composite
def runs(draw: st.DrawFn) -> PositioningTest:
    shape = (draw(st.integers(2, 5)), draw(st.integers(2, 4)), 2)
    steps = draw(st.lists(st.integers(10, 10**8), min_size=shape[0], max_size=shape[0]))
    target = np.cumsum(steps) / 1e6 - draw(st.integers(-(10**6), 10**6)) / 7
    deviation = draw(readings(shape))
    source = draw(st.sampled_from(list(TimeSource)))
    order = time_s = start = end = None
    if source is not TimeSource.NONE:
        order = draw(orders(deviation))
    if source in {TimeSource.FILE, TimeSource.INTERPOLATED} and order is not None:
        time_s = (order - 1) * draw(st.floats(1e-3, 1e3))
    if draw(st.booleans()):
        start = draw(moments).replace(tzinfo=draw(zones))
        end = start + timedelta(seconds=draw(st.floats(0, 1e6)))
    names = draw(st.lists(texts, max_size=3, unique_by=str))
    channel = np.where(np.isnan(deviation), np.nan, draw(numbers))
    fields = st.dictionaries(texts.filter(bool), texts, max_size=4)
    values = st.one_of(st.none(), numbers)
    return PositioningTest(
        kind=draw(st.sampled_from(list(AxisKind))),
        target=target,
        deviation=deviation,
        time_source=source,
        time_s=time_s,
        order=order,
        order_deduced=source is not TimeSource.NONE and draw(st.booleans()),
        start=start,
        end=end,
        cycle=draw(st.sampled_from(list(Cycle))),
        channels={name: channel + k for k, name in enumerate(names) if name},
        environment=draw(
            st.dictionaries(texts.filter(bool), st.builds(StartEnd, values, values), max_size=3)
        ),
        header=draw(fields),
        remarks=tuple(
            remark("of_file", said=said)
            for said in draw(st.lists(st.sampled_from(("a remark", "=1+2, -3")), unique=True))
        ),
    )


def said(test: PositioningTest) -> list[str]:
    return [sentence_of(one) for one in test.remarks]


def same(first: np.ndarray | None, second: np.ndarray | None) -> bool:
    if first is None or second is None:
        return first is second
    return np.array_equal(first, second, equal_nan=True)


def assert_same_run(again: PositioningTest, test: PositioningTest) -> None:
    assert again.kind is test.kind
    assert same(again.target, test.target)
    assert same(again.deviation, test.deviation)
    assert again.time_source is test.time_source
    assert same(again.time_s, test.time_s)
    assert same(again.order, test.order)
    assert again.order_deduced == test.order_deduced
    assert again.cycle is test.cycle
    assert (again.start, again.end) == (test.start, test.end)
    assert dict(again.environment) == dict(test.environment)
    assert dict(again.header) == dict(test.header)
    assert set(again.channels) == set(test.channels)
    assert all(same(again.channels[name], test.channels[name]) for name in test.channels)
    assert said(again)[: len(test.remarks)] == said(test)


@given(test=runs())
@quick
def test_what_is_written_is_read_again_as_it_was(tmp_path: Path, test: PositioningTest) -> None:
    path = tmp_path / "run.csv"
    write_tidy_csv(test, path)
    assert_same_run(read_positioning(path), test)


@given(test=runs())
@quick
def test_a_file_that_was_read_and_written_again_is_the_same(
    tmp_path: Path, test: PositioningTest
) -> None:
    path = tmp_path / "run.csv"
    write_tidy_csv(test, path)
    once = read_positioning(path)
    path.write_text(format_tidy_csv(once), encoding="utf-8", newline="")
    assert format_tidy_csv(read_positioning(path)) == format_tidy_csv(once)


@given(test=runs(), seed=st.integers(0, 1000))
@quick
def test_the_order_of_rows_and_columns_does_not_matter(
    tmp_path: Path, test: PositioningTest, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    test = replace(test, channels={}, remarks=())
    lines = format_tidy_csv(test).splitlines()
    comments = [line for line in lines if line.startswith("#")]
    cells = [line.split(",") for line in lines[len(comments) :]]
    columns = rng.permutation(len(cells[0]))
    rows = [",".join(cells[row][k] for k in columns) for row in 1 + rng.permutation(len(cells) - 1)]
    heading = ",".join(cells[0][k] for k in columns)
    path = tmp_path / "run.csv"
    path.write_text("\n".join([*comments, heading, *rows, ""]), encoding="utf-8")
    assert_same_run(read_positioning(path), test)


@given(test=runs())
@quick
def test_no_cell_that_a_spreadsheet_program_sees_starts_like_a_formula(
    test: PositioningTest,
) -> None:
    lines = format_tidy_csv(test).splitlines()
    body = next(k for k, line in enumerate(lines) if not line.startswith("#"))
    for line in lines[:body]:
        for separator in (",", ";", "\t", "|"):
            for cell in line.split(separator)[1:]:
                assert not cell.strip().startswith(("=", "+", "-", "@")), line
    for cell in lines[body].replace('"', "").split(","):
        assert not cell.startswith(("=", "+", "-", "@")), lines[body]


@pytest.mark.parametrize("changed", ["target", "deviation", "environment"])
def test_what_could_not_be_read_again_is_not_written(changed: str) -> None:
    test = PositioningTest(AxisKind.LINEAR, np.array([0.0, 1.0]), np.zeros((2, 2, 2)))
    wrong = {
        "target": replace(test, target=np.array([0.0, 1e-7])),
        "deviation": replace(test, deviation=np.full((2, 2, 2), 2e9)),
        "environment": replace(test, environment={"a": StartEnd(None, 1e12)}),
    }
    with pytest.raises(DataError):
        format_tidy_csv(wrong[changed])
