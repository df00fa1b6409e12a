"""For every control: write, read, simulate; no level is missed by more than bound and rounding."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from thermaxis.controls import (
    TableRequest,
    check_options,
    control_by_name,
    control_names,
)
from thermaxis.errors import ThermaxisError
from thermaxis.positioning import (
    AxisLevels,
    FloatArray,
    axis_levels,
    compensation_table,
    interpolation_bound,
    table_points,
)
from thermaxis.quantities import AxisKind


@st.composite
def runs(draw: st.DrawFn) -> tuple[AxisKind, AxisLevels]:
    """Return levels of any axis that a control's numbers can hold."""
    kind = draw(st.sampled_from(list(AxisKind)))
    m = draw(st.integers(2, 15))
    longest = 80.0 if kind is AxisKind.LINEAR else 20.0
    steps = draw(st.lists(st.floats(2.0, longest), min_size=m - 1, max_size=m - 1))
    first = draw(st.floats(-300.0, 300.0)) if kind is AxisKind.LINEAR else 0.0
    target = np.round(first + np.concatenate(([0.0], np.cumsum(steps))), 3)
    rise = draw(st.lists(st.floats(-4.0, 4.0), min_size=m, max_size=m))
    reversal = draw(st.lists(st.floats(-3.0, 3.0), min_size=m, max_size=m))
    mean = np.cumsum(rise)
    half = 0.5 * np.array(reversal)
    return kind, axis_levels(target, np.stack((mean + half, mean - half), axis=1))


def left_over(levels: AxisLevels, correction: FloatArray, bound: FloatArray) -> float:
    """Return by how much the bounds are passed, whatever constant the zero of the table leaves."""
    rest = levels.level + correction
    return float(np.max(rest - bound[:, None]) - np.min(rest + bound[:, None])) / 2.0


def forms() -> list[tuple[str, bool]]:
    """Return every control, and again with the reversal apart where it has a place for it."""
    found: list[tuple[str, bool]] = []
    for name in control_names():
        control = control_by_name(name)
        options = check_options(control, (), purpose="table")
        rule = control.grid_rule(AxisKind.LINEAR, options)
        found += [(name, False), (name, True)] if rule.backlash_apart else [(name, False)]
    return found


@pytest.mark.parametrize(("name", "apart"), forms())
@given(run=runs(), points=st.integers(2, 100), share=st.floats(0.0, 1.0))
@settings(max_examples=60, deadline=None)
def test_what_a_control_reads_in_its_file_leaves_no_more_than_bound_and_rounding(
    name: str,
    apart: bool,
    run: tuple[AxisKind, AxisLevels],
    points: int,
    share: float,
) -> None:
    kind, levels = run
    control = control_by_name(name)
    options = check_options(control, (), purpose="table")
    rule = control.grid_rule(kind, options)
    reference = float(levels.target[0] + share * (levels.target[-1] - levels.target[0]))
    reference = round(reference, 3)
    if rule.equidistant or points % 2:
        position = table_points(
            levels.target,
            points=points,
            through=reference if rule.through_reference else None,
            decimals=rule.decimals,
        )
    else:
        position = levels.target
    assume(rule.most_points is None or position.size <= rule.most_points)
    table = compensation_table(
        levels,
        position,
        kind=kind,
        axis="X" if kind is AxisKind.LINEAR else "C",
        reference_position=reference,
        per_direction=rule.per_direction,
        backlash=apart,
    )
    text = control.format_table(TableRequest(table=table, options=options)).text
    read = control.read_table(text, "table", kind, options)
    assert text.isascii()
    step = rule.resolution if read.resolution is None else read.resolution
    slope = float(np.max(np.abs(np.diff(levels.level, axis=0)) / np.diff(levels.target)[:, None]))
    rounding = step * (0.75 if apart else 0.5) + 2.0 * slope * 10.0**-rule.decimals
    bound = interpolation_bound(levels, position, per_direction=rule.per_direction, backlash=apart)
    correction = control.correction(read.table, levels.target)
    assert left_over(levels, correction, bound + rounding) <= 1e-6


def example_text(name: str) -> str:
    """Return a small table of a control, as it writes it."""
    control = control_by_name(name)
    options = check_options(control, (), purpose="table")
    rule = control.grid_rule(AxisKind.LINEAR, options)
    target = np.array([0.0, 20.0, 40.0, 60.0])
    level = np.array([[0.0, 1.0], [4.0, 4.5], [-3.0, -2.0], [6.0, 6.0]])
    table = compensation_table(
        axis_levels(target, level),
        target,
        kind=AxisKind.LINEAR,
        axis="X",
        reference_position=0.0,
        per_direction=rule.per_direction,
    )
    return control.format_table(TableRequest(table=table, options=options)).text


WORDS = (
    "",
    " ",
    "\n\n",
    ",",
    "n/a",
    "1,5",
    "-",
    "nan",
    "1e999",
    "-1e308",
    "9" * 5000,
    "%",
    "[END]",
)


@pytest.mark.parametrize("name", control_names())
@given(data=st.data())
@settings(max_examples=150, deadline=None)
def test_a_damaged_table_is_refused_in_words_or_read_as_finite_values(
    name: str, data: st.DataObject
) -> None:
    text = example_text(name)
    for _ in range(data.draw(st.integers(1, 3))):
        start = data.draw(st.integers(0, len(text)))
        end = data.draw(st.integers(start, min(len(text), start + 40)))
        latin = st.characters(max_codepoint=255)
        new = data.draw(st.one_of(st.sampled_from(WORDS), st.text(latin, max_size=8)))
        text = text[:start] + new + text[end:]
    control = control_by_name(name)
    options = check_options(control, (), purpose="table")
    kind = data.draw(st.sampled_from(list(AxisKind)))
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # as the commands read
            read = control.read_table(text, "damaged", kind, options)
    except ThermaxisError:
        return
    added = control.correction(read.table, np.array([-1e6, 0.0, 30.0, 1e6]))
    assert bool(np.all(np.isfinite(added)))
    assert all(text.isprintable() for text in read.findings)
