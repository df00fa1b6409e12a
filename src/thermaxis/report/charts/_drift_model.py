"""Chart of the drift that was eliminated: the run before and after, and the drift with bands."""

# matplotlib leaves the types of keyword arguments open
# pyright: reportUnknownMemberType=false

import re
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize, to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from thermaxis.positioning import APPROACHES, DriftResult, FloatArray, TimeSource
from thermaxis.positioning.diagnosis import is_temperature
from thermaxis.report._output import NumberTable
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._style import ARROWS, DARK, GREY, MARKERS, drawable, new_figure, zero_line
from thermaxis.report.charts._parts import add_scale, at_position, position_label, put_heading

_MOST_DRAWN = 2000
"""More readings than these are one grey area, and a file of many megabytes. [1]"""
_FEW = 120
"""Fewer readings than these are drawn larger, and above the lines. [1]"""
_MOST_CHANNELS = 6
_STEPS = 16
"""Colours along the axis; few enough that the scale beside the chart is no image. [1]"""
_COLOURS: list[str] = [
    to_hex(tuple(rgba)) for rgba in colormaps["cividis"](np.linspace(0.0, 0.86, _STEPS)).tolist()
]
_COLOUR_MAP = ListedColormap(_COLOURS)
_LEAST_SHARE = 0.3
"""Height of the pane without drift, as a share of that of the pane with it, at least. [1]"""
_BAND = "#d0d0d0"
_LINES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (5, 1.5, 1, 1.5)))
"""Of the drift at the first target, at mid-axis and at the last target."""
_CHANNEL_LINES: tuple[Any, ...] = ("-", "--", "-.", ":", (0, (6, 2, 1, 2, 1, 2)), (0, (1, 3)))


def drift_result(report: PositioningReport) -> DriftResult:
    """Return the drift of a report that has one."""
    assert report.drift is not None  # noqa: S101 - asked for only then
    return report.drift


def growth_unit(report: PositioningReport) -> str:
    """Return the unit of b(t) as it is printed."""
    unit = report.test.kind.units.deviation
    return "µm/m" if unit == "µm" else f"{unit} per 1000°"


def reference_place(report: PositioningReport) -> float:
    """Return t0 as the curves count time. [s, or number of the reading]"""
    drift, order = drift_result(report), report.test.order
    if drift.reference_time_s is not None or order is None:
        return drift.reference_time_s or 0.0
    return float(np.mean(order[np.isfinite(drift.drift)]))


def drift_at(report: PositioningReport, position: float) -> FloatArray:
    """Return the drift at a position relative to t0, at the times of the curves, (T,)."""
    drift, target = drift_result(report), report.test.target
    from_mean = position - float(np.mean(target))
    found = drift.common + drift.slope * from_mean
    if drift.bow is None:
        return found
    scale = float(np.std(target))
    places, place = (target - np.mean(target)) / scale, from_mean / scale
    first, second = np.polynomial.polynomial.polyfit(places, places**2, 1).tolist()
    half = 0.5 * report.test.measured_length / scale
    return found - drift.bow / half**2 * (place**2 - first - second * place)


def _marked_positions(report: PositioningReport) -> tuple[float, float, float]:
    first, last = float(report.test.target[0]), float(report.test.target[-1])
    return first, 0.5 * (first + last), last


def temperature_channels(report: PositioningReport) -> list[str]:
    """Return the names of the temperatures that were read at the stops, at most six."""
    channels = report.test.channels
    found = [n for n, v in channels.items() if is_temperature(n) and np.any(np.isfinite(v))]
    return found[:_MOST_CHANNELS]


def time_words(report: PositioningReport) -> str:
    """Return what the times of the readings rest on; empty where the file states each."""
    source = drift_result(report).time_source
    if source is TimeSource.ORDER:
        assumed = "assumed " * report.test.order_deduced
        return f"no times: the {assumed}order of the readings serves as time"
    if source is not TimeSource.INTERPOLATED or report.test.time_s is None:
        return ""
    known = np.sort(report.test.time_s[np.isfinite(report.test.time_s)])
    step = float(np.median(np.diff(known))) if known.size > 1 else 0.0
    return f"times interpolated between start and end, one reading every {step:.3g} s"


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Scale:
    """The axis of time."""

    label: str
    unit: float
    """Seconds, or readings, per unit of the axis."""
    at: FloatArray
    """Place of each reading, (m, n, 2). [unit of the axis]"""
    curve: FloatArray
    """Places of the curves, (T,). [unit of the axis]"""
    reference: float
    """Place of t0. [unit of the axis]"""


def _scale(report: PositioningReport) -> _Scale:
    test, drift = report.test, drift_result(report)
    label, unit = "number of the reading", 1.0
    if test.time_s is not None:
        hours = float(drift.time_s[-1]) >= 3600.0
        label, unit = ("h", 3600.0) if hours else ("min", 60.0)
        label = f"time since the first reading [{label}]"
    at = test.time_s if test.time_s is not None else test.order
    assert at is not None  # noqa: S101 - without both there is no drift
    return _Scale(label, unit, at / unit, drift.time_s / unit, reference_place(report) / unit)


def _drawn(report: PositioningReport) -> NDArray[np.bool_]:
    """Return which readings are drawn, (m, n, 2): all, or those of cycles spread evenly."""
    test = report.test
    drawn = ~np.isnan(test.deviation)
    if int(np.sum(drawn)) <= _MOST_DRAWN:
        return drawn
    per_cycle = test.target.size * len(report.test.approaches)
    number = max(1, min(test.cycles, _MOST_DRAWN // per_cycle))
    kept = np.zeros(drawn.shape, dtype=np.bool_)
    cycles = np.unique(np.round(np.linspace(0, test.cycles - 1, number)).astype(np.int64))
    every = -(-per_cycle * cycles.size // _MOST_DRAWN)
    for cycle in cycles.tolist():
        kept[::every, cycle] = True
    return drawn & kept


def draw_drift(report: PositioningReport) -> Figure:
    """Draw the run in time order as measured and without drift, and the drift with its bands."""
    drift, scale, drawn = drift_result(report), _scale(report), _drawn(report)
    level = drift.level[:, None, :]
    raw, free = report.test.deviation - level, drift.deviation - level
    names = ["raw", "free", "a", "b"]
    names += ["bow"] if drift.bow is not None else []
    names += ["channels"] if temperature_channels(report) else []
    raw_limits, free_limits = _limits(report, raw, free)
    share = (free_limits[1] - free_limits[0]) / (raw_limits[1] - raw_limits[0])
    heights = [1.75, 1.75 * share] + [0.85] * (len(names) - 2)
    figure = new_figure(sum(heights) + 1.9)
    grid = figure.subplots(len(names), 1, sharex=True, height_ratios=heights)
    panels: dict[str, Axes] = dict(zip(names, grid, strict=True))
    unit = report.test.kind.units.deviation
    entries = _draw_readings(panels["raw"], report, scale, raw, drawn)
    _draw_readings(panels["free"], report, scale, free, drawn)
    entries += _draw_left_out(panels["raw"], scale, np.clip(raw, *raw_limits), drift)
    entries += _draw_estimate(panels["raw"], report, scale)
    panels["raw"].set_ylim(*raw_limits)
    panels["free"].set_ylim(*free_limits)
    panels["raw"].set_ylabel(f"as measured,\nless mean [{unit}]")
    panels["free"].set_ylabel(f"drift-free,\nless mean\n[{unit}]")
    entries += _draw_curves(panels, report, scale)
    if "channels" in panels:
        entries += _draw_channels(panels["channels"], report, scale, drawn)
    entries += _mark_reference(list(panels.values()), scale)
    rests_on = time_words(report)
    grid[-1].set_xlabel(f"{scale.label} ({rests_on})" if rests_on else scale.label)
    _add_order(panels["raw"], report, scale)
    colours = ScalarMappable(Normalize(*report.test.target[[0, -1]].tolist()), _COLOUR_MAP)
    bar = figure.colorbar(colours, ax=[panels["raw"], panels["free"]], pad=0.02, aspect=30)
    bar.set_label(position_label(report))
    if bar.solids is not None:
        bar.solids.set_edgecolor("face")
    _head(figure, report, int(np.sum(drawn)))
    figure.align_ylabels()
    figure.legend(
        entries, [str(e.get_label()) for e in entries], loc="outside lower center", ncols=3
    )
    return figure


def _head(figure: Figure, report: PositioningReport, drawn: int) -> None:
    drift = drift_result(report)
    readings = int(np.sum(report.test.readings))
    what = "Drift eliminated" if drift.significant else "Drift: none is seen"
    part = f"{drawn} of {readings} readings drawn" if drawn < readings else ""
    put_heading(figure, report, f"{what} (no result of ISO 230-2)", after=part)


def _limits(
    report: PositioningReport, raw: FloatArray, free: FloatArray
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the extents in y of the panes with and without drift, of the same scale.

    An outlier that was left out does not count: it may lie so far out that nothing else is seen.
    """
    raw = np.where(np.isnan(free), np.nan, raw)
    ends = np.concatenate([drift_at(report, p) for p in _marked_positions(report)])
    high = max(float(np.nanmax(raw)), float(np.max(ends)))
    low = min(float(np.nanmin(raw)), float(np.min(ends)))
    span = 1.1 * (high - low) or 1.0
    top, bottom = float(np.nanmax(free)), float(np.nanmin(free))
    share = min(1.0, max(_LEAST_SHARE, 1.1 * (top - bottom) / span))
    middle, other = 0.5 * (high + low), 0.5 * (top + bottom)
    half = 0.5 * span
    return (middle - half, middle + half), (other - share * half, other + share * half)


def _draw_readings(
    axes: Axes,
    report: PositioningReport,
    scale: _Scale,
    values: FloatArray,
    drawn: NDArray[np.bool_],
) -> list[Line2D | Patch]:
    """Draw readings, the colour by position, the marker by approach; return the legend's marks."""
    target = report.test.target
    share = (target - target[0]) / (target[-1] - target[0])
    step = np.minimum((share * _STEPS).astype(np.int64), _STEPS - 1)
    few = int(np.sum(drawn)) <= _FEW
    marks: list[Line2D | Patch] = []
    for approach in report.test.approaches:
        for number, colour in enumerate(_COLOURS):
            here = drawn[:, :, approach] & (step == number)[:, None]
            if not np.any(here):
                continue
            axes.plot(
                scale.at[:, :, approach][here],
                values[:, :, approach][here],
                linestyle="none",
                marker=MARKERS[approach],
                markersize=3.4 if few else 2.2,
                zorder=4.0 if few else 2.0,
                markeredgewidth=0.5,
                markeredgecolor=colour,
                markerfacecolor=colour if approach == 0 else "white",
            )
        mark = Line2D([], [], linestyle="none", marker=MARKERS[approach], markersize=4.0)
        mark.set(markeredgewidth=0.7, color=DARK)
        mark.set_markerfacecolor(DARK if approach == 0 else "white")
        mark.set_label(f"readings {APPROACHES[approach]} {ARROWS[approach]}")
        marks.append(mark)
    zero_line(axes)
    return marks


def _draw_left_out(
    axes: Axes, scale: _Scale, raw: FloatArray, drift: DriftResult
) -> list[Line2D | Patch]:
    if not drift.outliers:
        return []
    places = [(o.target - 1, o.cycle - 1, o.approach) for o in drift.outliers]
    return list(
        axes.plot(
            [scale.at[place] for place in places],
            [raw[place] for place in places],
            linestyle="none",
            marker="x",
            markersize=6.0,
            markeredgewidth=1.2,
            color="black",
            zorder=5,
            clip_on=False,
            label="outliers, left out (on the edge: farther out)",
        )
    )


def _draw_estimate(axes: Axes, report: PositioningReport, scale: _Scale) -> list[Line2D | Patch]:
    """Draw the drift at both ends of the axis and in its middle; one line where there is none."""
    places = ("first target", "mid-axis", "last target")
    named = [
        (position, style, f"drift, {place} ({at_position(report, round(position, 3))})")
        for position, place, style in zip(_marked_positions(report), places, _LINES, strict=True)
    ]
    if not drift_result(report).significant:
        named = [(*named[1][:2], "drift: none is seen")]
    marks: list[Line2D | Patch] = []
    for position, style, label in named:
        values = drift_at(report, position)
        axes.plot(scale.curve, values, color="white", linewidth=2.2, zorder=3)
        marks += axes.plot(
            scale.curve,
            values,
            color="black",
            linestyle=style,
            linewidth=1.2,
            zorder=3.5,
            label=label,
        )
    return marks


def _draw_curves(
    panels: dict[str, Axes], report: PositioningReport, scale: _Scale
) -> list[Line2D | Patch]:
    drift = drift_result(report)
    unit, factor = report.test.kind.units.deviation, drift.coverage_factor
    curves = [
        ("a", drift.common, drift.common_std, f"a(t) - a(t₀)\n[{unit}]"),
        (
            *("b", 1e3 * drift.slope, 1e3 * drift.slope_std),
            f"b(t) - b(t₀)\n[{growth_unit(report)}]",
        ),
    ]
    for name, values, std, label in curves:
        axes = panels[name]
        axes.fill_between(
            scale.curve, values - factor * std, values + factor * std, color=_BAND, linewidth=0.0
        )
        for bound in (-factor, factor):
            axes.plot(scale.curve, values + bound * std, color=GREY, linestyle="--", linewidth=0.7)
        axes.plot(scale.curve, values, color="black")
        axes.set_ylabel(label)
        zero_line(axes)
    if drift.bow is not None:
        panels["bow"].plot(scale.curve, drift.bow, color="black")
        panels["bow"].set_ylabel(f"bow: middle\nto ends [{unit}]")
        zero_line(panels["bow"])
    label = f"±{factor:g} standard uncertainties"
    return [Patch(facecolor=_BAND, edgecolor=GREY, linestyle="--", linewidth=0.7, label=label)]


def _draw_channels(
    axes: Axes, report: PositioningReport, scale: _Scale, drawn: NDArray[np.bool_]
) -> list[Line2D | Patch]:
    marks: list[Line2D | Patch] = []
    names = temperature_channels(report)
    for number, name in enumerate(names):
        values = report.test.channels[name]
        here = drawn & np.isfinite(values) & np.isfinite(scale.at)
        order = np.argsort(scale.at[here], kind="stable")
        marks += axes.plot(
            scale.at[here][order],
            values[here][order],
            color=(DARK, "#0072b2", "#c84e00")[number % 3],
            linestyle=_CHANNEL_LINES[number],
            linewidth=0.9,
            label=drawable(name, 32) or "channel",
        )
    celsius = all(name.lower().endswith("_c") for name in names)
    axes.set_ylabel(f"temperature\n[{'°C' if celsius else 'unit of file'}]")
    return marks


def _mark_reference(panels: list[Axes], scale: _Scale) -> list[Line2D | Patch]:
    lines = [
        axes.axvline(
            scale.reference,
            color="black",
            linestyle=":",
            linewidth=1.0,
            zorder=2.5,
            label="t₀, thermal state of the figures",
        )
        for axes in panels
    ]
    panels[0].annotate(
        "t₀",
        (scale.reference, 1.0),
        xycoords=("data", "axes fraction"),
        xytext=(3.0, -2.0),
        textcoords="offset points",
        va="top",
        fontweight="bold",
        zorder=5,
    )
    return list(lines[:1])


def _add_order(axes: Axes, report: PositioningReport, scale: _Scale) -> None:
    """Add a second scale with the number of the reading, where times make the first one."""
    order, time_s = report.test.order, report.test.time_s
    if order is None or time_s is None:
        return
    known = np.isfinite(order) & np.isfinite(time_s)
    place, first = np.unique(scale.at[known], return_index=True)
    number = np.maximum.accumulate(order[known][first])
    if place.size >= 2 and bool(np.all(np.diff(number) > 0.0)):
        add_scale(axes, place, number, "number of the reading")


# ---- numbers -------------------------------------------------------------------------------------


def drift_numbers(report: PositioningReport) -> NumberTable:
    """Return one row per reading, in time order: before and after."""
    test, drift = report.test, drift_result(report)
    units = test.kind.units
    unit = units.deviation_suffix
    i, j, a = np.nonzero(~np.isnan(test.deviation))
    at = test.time_s if test.time_s is not None else test.order
    if at is not None:
        sequence = np.argsort(at[i, j, a], kind="stable")
        i, j, a = i[sequence], j[sequence], a[sequence]
    named: dict[str, list[float] | list[int] | list[str]] = {}
    if test.order is not None:
        named["order"] = [int(n) for n in np.round(test.order[i, j, a]).tolist()]
    if test.time_s is not None:
        named["time_s"] = test.time_s[i, j, a].tolist()
    level, raw, free = drift.level[i, a], test.deviation[i, j, a], drift.deviation[i, j, a]
    named |= {
        "cycle": (j + 1).tolist(),
        "direction": [APPROACHES[approach] for approach in a.tolist()],
        f"target_{units.position_suffix}": test.target[i].tolist(),
        f"deviation_{unit}": raw.tolist(),
        f"level_{unit}": level.tolist(),
        f"drift_{unit}": drift.drift[i, j, a].tolist(),
        f"drift_free_{unit}": free.tolist(),
        f"deviation_less_level_{unit}": (raw - level).tolist(),
        f"drift_free_less_level_{unit}": (free - level).tolist(),
    }
    for number, name in enumerate(temperature_channels(report), start=1):
        plain = re.sub(r"[^A-Za-z0-9]+", "_", name)[:40].strip("_")
        named[f"channel_{number}_{plain}".rstrip("_")] = test.channels[name][i, j, a].tolist()
    return NumberTable(tuple(named), list(zip(*named.values(), strict=True)))


def drift_curve_numbers(report: PositioningReport) -> NumberTable:
    """Return a(t) and b(t) relative to t0 with their standard uncertainties."""
    test, drift = report.test, drift_result(report)
    unit = test.kind.units.deviation_suffix
    growth = "um_per_m" if unit == "um" else f"{unit}_per_1000_deg"
    named = {
        "order" if test.time_s is None else "time_s": drift.time_s,
        f"a_{unit}": drift.common,
        f"a_std_{unit}": drift.common_std,
        f"b_{growth}": 1e3 * drift.slope,
        f"b_std_{growth}": 1e3 * drift.slope_std,
    }
    if drift.bow is not None:
        named[f"bow_{unit}"] = drift.bow
    for place, position in zip(("first", "middle", "last"), _marked_positions(report), strict=True):
        named[f"drift_{place}_{unit}"] = drift_at(report, position)
    return NumberTable(tuple(named), np.column_stack(list(named.values())).tolist())
