"""What a chart draws of its values, by the scripts of the charts alone."""

import math
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from tests.unit.screen.page_script import said_by
from thermaxis.web import asset_folder

BENCH = """
import { readFileSync } from "node:fs";
const scale = await import("file://FOLDER/scale.js");
const { numberTicks, rangeOf, linePath, areaPath } = scale;
const given = JSON.parse(readFileSync(0, "utf8"));
process.stdout.write(JSON.stringify((() => { BODY })()));
"""
Point = tuple[float, float]


def said(body: str, given: object = None) -> Any:
    """Return what a script says that has the functions of the charts."""
    folder = str(asset_folder() / "chart")
    return said_by(BENCH.replace("FOLDER", folder).replace("BODY", body), given)


def stretches(path: str) -> list[list[Point]]:
    """Return the points of a path by its stretches."""
    found: list[list[Point]] = []
    for stretch in path.split("M")[1:]:
        pairs = (pair.split() for pair in stretch.removesuffix("h0").removesuffix("Z").split("L"))
        found.append([(float(x), float(y)) for x, y in pairs])
    return found


def line(x: list[float], y: list[float | None], width: float) -> list[list[Point]]:
    """Return the stretches of a line, x in pixels of so wide a drawing, y as it is."""
    body = "return linePath(given.x, given.y, (x) => x * given.scale, (y) => y);"
    return stretches(said(body, {"x": x, "y": y, "scale": width / max(x[-1], 1.0)}))


def test_no_line_goes_over_a_gap_and_a_value_between_two_gaps_is_a_point() -> None:
    y: list[float | None] = [1.0, 2.0, None, 3.0, None, None, 4.0, 5.0]
    assert line([10.0 * k for k in range(8)], y, 70.0) == [
        [(0.0, 1.0), (10.0, 2.0)],
        [(30.0, 3.0)],
        [(60.0, 4.0), (70.0, 5.0)],
    ]


def test_ten_thousand_values_are_drawn_with_no_more_points_than_pixels_and_every_peak() -> None:
    y: list[float | None] = [math.sin(0.01 * k) for k in range(10_000)]
    y[7321] = 50.0
    y[1234] = -50.0
    (drawn,) = line([float(k) for k in range(10_000)], y, 500.0)
    assert len(drawn) <= 4 * (2 * 500 + 1)
    assert max(drawn, key=lambda point: point[1]) == (pytest.approx(7321 / 20, abs=0.3), 50.0)
    assert min(drawn, key=lambda point: point[1]) == (pytest.approx(1234 / 20, abs=0.3), -50.0)
    assert drawn[0][1] == pytest.approx(0.0, abs=0.05)
    assert drawn[-1][1] == pytest.approx(math.sin(99.99), abs=0.05)


def test_a_band_has_an_outline_for_each_stretch_that_holds_both_edges() -> None:
    body = "return areaPath([0, 1, 2, 3], [0, null, -2, -3], [1, 1, 2, 3], (x) => x, (y) => y);"
    assert stretches(said(body)) == [
        [(0.0, 1.0), (0.0, 0.0)],
        [(2.0, 2.0), (3.0, 3.0), (3.0, -3.0), (2.0, -2.0)],
    ]


@settings(max_examples=4, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6), st.integers(3, 20)),
        min_size=1,
        max_size=50,
    )
)
def test_ticks_are_round_within_the_axis_and_no_more_than_have_room(
    axes: list[tuple[float, float, int]],
) -> None:
    body = "return given.map(([low, span, most]) => numberTicks(low, low + span, most));"
    for (low, span, most), found in zip(axes, said(body, axes), strict=True):
        at = found["at"]
        assert 1 <= len(at) <= most + 1
        assert low - 1e-6 * span <= at[0]
        assert at[-1] <= low + span * (1.0 + 1e-6)
        for tick in at:
            assert round(tick, found["digits"]) == pytest.approx(tick, rel=1e-9, abs=1e-9 * span)


def test_an_axis_has_a_margin_and_at_least_the_span_that_keeps_noise_small() -> None:
    body = """return [rangeOf([0, null, 10]), rangeOf([4.9, 5.1], 10), rangeOf([3, 3]),
      rangeOf([null])];"""
    wide, least, one, none = said(body)
    assert wide == [-0.5, 10.5]
    assert least == pytest.approx([0.0, 10.0])
    assert one == [2, 4]
    assert none is None
