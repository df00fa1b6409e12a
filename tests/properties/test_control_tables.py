"""For every control: write, read, simulate; no level is missed by more than bound and rounding."""

import re

import numpy as np
import pytest
from hypothesis import assume, given, settings, strategies as st

from thermaxis.controls import (
    TableRequest,
    check_options,
    control_by_name,
    control_names,
)
from thermaxis.errors import ThermaxisError
from thermaxis.messages import text_of
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


# ---- what the files say, read without the product's readers; 1000 µm/mm or 3600 arcsec/deg -------


def linuxcnc(text: str, _: float, per: float) -> tuple[np.ndarray, np.ndarray]:
    """Type 0: nominal, actual forward, actual backward."""
    rows = np.array([line.split() for line in text.splitlines()], dtype=float)
    return rows[:, 0], per * (rows[:, :1] - rows[:, 1:])


def sinumerik(text: str, _: float, per: float) -> tuple[np.ndarray, np.ndarray]:
    """Values plus the deviation at MIN + i * STEP; MD32450 positive for lost motion."""
    said = dict(re.findall(r"^\$([A-Z_]+\[0,[^\]]*)\]=(\S+)\r$", text, re.MULTILINE))
    by_word = {key.split(",")[0]: float(v) for key, v in said.items() if key.count(",") == 1}
    value = [float(v) for key, v in said.items() if key.count(",") == 2]
    half = 0.5 * by_word.get("MA_BACKLASH[0", 0.0)
    position = by_word["AA_ENC_COMP_MIN[0"] + by_word["AA_ENC_COMP_STEP[0"] * np.arange(len(value))
    return position, per * (np.array([half, -half]) - np.array(value)[:, None])


def tnc640(text: str, _: float, per: float) -> tuple[np.ndarray, np.ndarray]:
    """Columns number, position, backward deviation, forward deviation."""
    rows = np.array([line.split() for line in text.splitlines()[2:-1]], dtype=float)
    return rows[:, 1], -per * rows[:, [-1, 2]]  # an empty column: the same for both


def itnc530(text: str, _: float, per: float) -> tuple[np.ndarray, np.ndarray]:
    """Columns number, position, deviation of both directions."""
    rows = np.array([line.split() for line in text.splitlines()[2:]], dtype=float)
    return rows[:, 1], -per * rows[:, [2, 2]]


def fanuc(text: str, reference: float, per: float) -> tuple[np.ndarray, np.ndarray]:
    """Increments of the correction, point n for the section that ends at grid position n."""
    value = {
        int(n): int(v) for n, v in re.findall(r"^N(\d{5})(?:A\d)?P(-?\d+)", text, re.MULTILINE)
    }
    at, first, last = value[3620], value[3621], value[3622]
    total = np.cumsum([0, *(value[10000 + point] for point in range(first, last + 1))])
    ends = np.arange(first - 1, last + 1)
    along = (total - total[at - first + 1]) * value[3623] * per / 1000.0
    half = 0.5 * value.get(1851, 0) * per / 1000.0
    position = reference + (ends - at) * value[3624] / 1000.0
    return position, along[:, None] + np.array([half, -half])


PARSERS = {
    "fanuc": fanuc,
    "heidenhain-itnc530": itnc530,
    "heidenhain-tnc640": tnc640,
    "linuxcnc": linuxcnc,
    "sinumerik": sinumerik,
}


def forms() -> list[tuple[str, bool, tuple[str, ...]]]:
    """Return every control, again with the reversal apart, and with options that change a file."""
    found: list[tuple[str, bool, tuple[str, ...]]] = []
    for name in control_names():
        control = control_by_name(name)
        options = check_options(control, (), purpose="table")
        rule = control.grid_rule(AxisKind.LINEAR, options)
        found += [(name, apart, ()) for apart in (False, True) if rule.backlash_apart or not apart]
    return [
        *found,
        ("fanuc", False, ("bidirectional=1",)),
        ("fanuc", False, ("bidirectional=1", "return_direction=negative")),
        ("fanuc", True, ("detection_unit=2.5", "largest_value=127")),
        ("linuxcnc", False, ("type=1",)),
        ("linuxcnc", False, ("units=inch",)),
    ]


@pytest.mark.parametrize(("name", "apart", "stated"), forms())
@given(run=runs(), points=st.integers(2, 100), share=st.floats(0.0, 1.0))
@settings(max_examples=12, deadline=None)
def test_what_a_control_reads_in_its_file_leaves_no_more_than_bound_and_rounding(
    name: str,
    apart: bool,
    stated: tuple[str, ...],
    run: tuple[AxisKind, AxisLevels],
    points: int,
    share: float,
) -> None:
    kind, levels = run
    rotary = kind is AxisKind.ROTARY
    control = control_by_name(name)
    options = check_options(control, stated, purpose="table")
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
    zero = float(np.mean(control.correction(read.table, np.array([reference]))))
    assert abs(zero) <= rounding + 1e-6
    if name in PARSERS and not stated:
        own_position, own_correction = PARSERS[name](text, reference, 3600.0 if rotary else 1000.0)
        kept = slice(len(own_position) - read.table.position.size, None)  # Fanuc's way to its zero
        np.testing.assert_allclose(own_position[kept], read.table.position, atol=1e-6)
        found = control.correction(read.table, read.table.position)
        np.testing.assert_allclose(own_correction[kept], found, atol=1e-6)


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
@settings(max_examples=40, deadline=None)
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
        read = control.read_table(text, "damaged", kind, options)
    except ThermaxisError:
        return
    added = control.correction(read.table, np.array([-1e6, 0.0, 30.0, 1e6]))
    assert bool(np.all(np.isfinite(added)))
    assert all(text_of(one).isprintable() for one in read.findings)
