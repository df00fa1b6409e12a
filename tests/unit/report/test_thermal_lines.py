"""Long records are drawn with their extremes, and gaps stay gaps."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as st_numpy

from thermaxis.report.thermal._conditions import extent, lines_panel
from thermaxis.report.thermal._lines import (
    drawn_line,
    envelope_rows,
    largest,
    marked,
    shaded_spans,
    span_of,
)
from thermaxis.report.thermal._panels import LOOKS, MOST_LINES, legend_columns, line_label
from thermaxis.report.thermal._steps import _bode
from thermaxis.thermal import ModalPart, ThermalModel, frequency_response

SERIES = st_numpy.arrays(np.float64, st.integers(1, 400), elements=st.floats(-1e3, 1e3, width=32))


@given(values=SERIES, most=st.integers(4, 60))
@settings(deadline=None)
def test_a_reduced_series_keeps_its_ends_its_order_and_the_extremes_of_every_stretch(
    values: np.ndarray, most: int
) -> None:
    rows = np.array(envelope_rows(values, most))
    assert rows.tolist() == sorted(set(rows.tolist()))
    assert len(rows) <= max(values.size if values.size <= most else most + 2, 1)
    assert (rows[0], rows[-1]) == (0, values.size - 1)
    length = 1 if values.size <= most else -(-values.size // (most // 2))
    for first in range(0, values.size, length):
        stretch = values[first : first + length]
        inside = values[rows[(rows >= first) & (rows < first + length)]]
        assert inside.min() == stretch.min()
        assert inside.max() == stretch.max()


def test_a_spike_of_one_row_in_half_a_million_is_drawn() -> None:
    x = np.arange(500_000.0)
    y = np.sin(x / 40_000.0)
    y[314_159] = 9.0
    line = drawn_line(x, y)
    assert line.x.size < 1100
    assert np.nanmax(line.y) == 9.0
    assert line.x[np.nanargmax(line.y)] == 314_159.0


def test_a_line_is_broken_where_nothing_was_measured() -> None:
    x = np.arange(1000.0)
    y = np.ones(1000)
    y[300:600] = np.nan
    line = drawn_line(x, y)
    broken = np.flatnonzero(np.isnan(line.x))
    assert broken.size == 1
    assert line.x[broken[0] - 1] == 299.0
    assert line.x[broken[0] + 1] == 600.0
    assert line.alone_x.size == 0
    y = np.ones(1000)
    y[::7] = np.nan
    assert not np.isnan(drawn_line(x, y).x).any()


def test_an_output_seen_for_seven_seconds_at_a_time_is_drawn_as_points() -> None:
    x = np.arange(28_800.0)  # 8 h at 1 Hz
    y = np.full(x.size, np.nan)
    for start in range(0, x.size, 1800):
        y[start : start + 7] = start / 100.0
    line = drawn_line(x, y)
    assert line.x.size == 0
    assert line.alone_x.tolist() == [start + 3.0 for start in range(0, x.size, 1800)]
    assert line.alone_y.tolist() == [start / 100.0 for start in range(0, x.size, 1800)]


def test_a_channel_of_a_slow_recorder_is_one_line() -> None:
    x = np.arange(28_800.0)
    y = np.full(x.size, np.nan)
    y[::600] = 1.0
    line = drawn_line(x, y)
    assert line.x.size == 48
    assert not np.isnan(line.y).any()


def test_nothing_measured_draws_nothing_and_the_shortest_series_are_drawn() -> None:
    line = drawn_line(np.arange(5.0), np.full(5, np.nan))
    assert line.x.size == line.alone_x.size == 0
    assert span_of(np.full(5, np.nan)) == 0.0
    for rows in (1, 2, 3):
        line = drawn_line(np.arange(float(rows)), np.ones(rows))
        assert line.x.size + line.alone_x.size >= 1


def test_markers_of_two_lines_that_cover_each_other_stand_apart() -> None:
    line = drawn_line(np.arange(100.0), np.ones(100))
    assert not set(marked(line, 0.25)) & set(marked(line, 0.75))
    assert len(marked(line, 0.25)) == 7


def test_six_series_are_drawn_and_of_seven_the_five_largest() -> None:
    series = {f"t{k}": np.array([0.0, float(k)]) for k in range(7)}
    names, others = largest(series, 6)
    assert names == ["t2", "t3", "t4", "t5", "t6"]
    assert others == ["t0", "t1"]
    del series["t0"]
    assert largest(series, 6) == ([f"t{k}" for k in range(1, 7)], [])


def test_what_is_not_drawn_one_by_one_shows_its_extent() -> None:
    time_s = 3600.0 * np.arange(4.0)
    series = {f"t{k}": k * np.array([0.0, 1.0, -1.0, 2.0]) for k in range(1, 9)}
    panel = lines_panel("Inputs", "temperature [K]", time_s, series)
    assert [t.label for t in panel.traces] == ["t4", "t5", "t6", "t7", "t8"]
    (area,) = panel.areas
    assert area.label == "3 others"
    assert area.low.tolist() == [0.0, 1.0, -3.0, 2.0]
    assert area.high.tolist() == [0.0, 3.0, -1.0, 6.0]
    assert "5 of 8" in panel.title
    assert len(panel.traces) + len(panel.areas) <= MOST_LINES


def test_a_reduced_extent_holds_every_value() -> None:
    random = np.random.default_rng(3)
    x, low = np.arange(10_000.0), random.normal(0.0, 1.0, 10_000)
    area = extent("others", x, low, low + 1.0, most=100)
    assert area.x.size == 100
    assert area.low.min() == low.min()
    assert area.high.max() == low.max() + 1.0


def test_rows_that_do_not_count_are_marked_at_both_ends() -> None:
    x = np.arange(101.0)
    counted = (x >= 20) & (x <= 90)
    counted[50] = False
    assert shaded_spans(x, counted) == ((0.0, 20.0), (90.0, 100.0))
    assert shaded_spans(x, np.ones(101, dtype=np.bool_)) == ()
    assert shaded_spans(x, np.zeros(101, dtype=np.bool_)) == ((0.0, 100.0),)


def test_no_two_lines_of_a_panel_differ_by_colour_alone() -> None:
    assert len({(look.marker, look.line) for look in LOOKS}) == len(LOOKS) == MOST_LINES
    greys = [sum(int(look.colour[i : i + 2], 16) for i in (1, 3, 5)) for look in LOOKS]
    assert max(greys) < 3 * 160, "too pale for paper"


def test_long_names_that_differ_at_their_ends_stay_different() -> None:
    front = line_label("temperature_of_the_spindle_bearing_front_C")
    rear = line_label("temperature_of_the_spindle_bearing_rear_C")
    assert front != rear
    assert len(front) == len(rear) == 22
    assert line_label("Z_um") == "Z_um"
    assert not line_label("_Z_um").startswith("_")


def test_a_legend_has_as_many_columns_as_fit() -> None:
    assert legend_columns(["Z_um"] * 4) == 4
    assert legend_columns(["x" * 22] * 6) == 3
    assert legend_columns(["x" * 22] * 4) == 2
    assert legend_columns(["x"]) == 1


def test_the_phase_of_a_negative_gain_begins_where_it_stays_small() -> None:
    lags, taus_s = np.array([15.0]), np.array([3000.0])
    parts = [ModalPart(f"a{late_s:g}", -20.0, lags, taus_s, late_s) for late_s in (0.0, 200.0)]
    model = ThermalModel((*parts, ModalPart("b", 5.0, -lags / 5.0, taus_s, 600.0)))
    hz = np.geomspace(1e-6, 1e-3, 400)
    _, bode = _bode("Z_um", model, None, hz)
    response = frequency_response(model, hz)
    for k, phase in enumerate(bode.curve.values()):
        turned = np.exp(1j * np.radians(phase)) * np.abs(response[:, k])
        np.testing.assert_allclose(turned, response[:, k], atol=1e-9)
        assert np.max(np.abs(np.diff(phase))) < 30.0
    begins = [phase[0] for phase in bode.curve.values()]
    assert begins == pytest.approx([-180.0, -180.0, 0.0], abs=5.0)
    far = ThermalModel((ModalPart("a", -20.0, lags, taus_s, 900.0),))
    (phase,) = _bode("Z_um", far, None, hz)[1].curve.values()
    assert phase[0] == pytest.approx(180.0, abs=5.0)
