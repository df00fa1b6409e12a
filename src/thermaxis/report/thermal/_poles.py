"""Charts of time constants and of poles and zeros."""

# matplotlib leaves the types of keyword arguments open
# pyright: reportUnknownMemberType=false

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from matplotlib.axes import Axes  # noqa: TC002  as in the other charts
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FormatStrFormatter, NullFormatter

from thermaxis.report._output import NumberTable
from thermaxis.report._style import DARK, GREY, drawable, new_figure
from thermaxis.report.thermal._panels import ThermalChart, shown_text
from thermaxis.report.thermal._steps import INTERVAL
from thermaxis.thermal import IdentifiedOutput, ModalPart, PoleZeroMap, pole_zero_map

_MOST_ROWS = 20
_MOST_MAPS = 6
_HOUR_S = 3600.0
_LARGEST_SHOWN = 2.5
"""Poles and zeros further out are left out of the chart; the table has them. [1]"""


@final
@dataclass(frozen=True, slots=True)
class _Lag:
    """A lag in the chart of time constants."""

    row: str
    time_constant_s: float
    std_s: float | None
    gain: float


def time_constant_chart(
    outputs: Sequence[IdentifiedOutput], *, sample_time_s: float, record_s: float
) -> ThermalChart | None:
    """Return the time constants of lags, the poles at z = exp(-sample time / time constant)."""
    lags = [lag for output in outputs for lag in _lags(output)]
    if not lags:
        return None
    rows = list(dict.fromkeys(lag.row for lag in lags))
    shown = rows[:_MOST_ROWS]
    lags = [lag for lag in lags if lag.row in shown]
    table = NumberTable(
        ("row", "time_constant_s", "half_interval_s", "gain_um_per_k"),
        [
            (
                shown_text(lag.row),
                lag.time_constant_s,
                float("nan") if lag.std_s is None else INTERVAL * lag.std_s,
                lag.gain,
            )
            for lag in lags
        ],
    )
    caption = (
        "Time constants of the lags, the poles at z = exp(-sample time / time constant), with 95 %"
        " intervals where the record supports them; filled: the gain is positive, open:"
        " negative (of a row for all inputs, their sum)."
    )
    if len(rows) > len(shown):
        caption += f" The first {len(shown)} of {len(rows)} rows."
    return ThermalChart(
        "poles", caption, lambda: _draw_lags(shown, lags, sample_time_s, record_s), table
    )


def _lags(output: IdentifiedOutput) -> list[_Lag]:
    model = output.model
    if model is None:
        return []
    taus = {tuple(part.time_constants_s.tolist()) for part in model.parts}
    if len(taus) == 1 and len(model.parts) > 1:
        common = model.parts[0].time_constants_s
        gains = np.sum([part.gains for part in model.parts], axis=0)
        row = f"{output.name}: all {len(model.parts)} inputs"
        return [_Lag(row, float(t), None, float(g)) for t, g in zip(common, gains, strict=True)]
    found: list[_Lag] = []
    for k, part in enumerate(model.parts):
        std = output.std[k].time_constants_s if output.std else (None,) * part.gains.size
        found += _of_part(f"{output.name}: {part.input_name}", part, std)
    return found


def _of_part(row: str, part: ModalPart, std: Sequence[float | None]) -> list[_Lag]:
    return [
        _Lag(row, float(tau), s, float(gain))
        for tau, s, gain in zip(part.time_constants_s, std, part.gains, strict=True)
    ]


def _draw_lags(
    rows: Sequence[str], lags: Sequence[_Lag], sample_time_s: float, record_s: float
) -> Figure:
    figure = new_figure(1.45 + 0.22 * len(rows))
    axes = figure.subplots()
    for lag in lags:
        place = rows.index(lag.row)
        half = None if lag.std_s is None else INTERVAL * lag.std_s
        if half is not None:
            low = max(lag.time_constant_s - half, 0.05 * lag.time_constant_s)
            ends = [low / _HOUR_S, (lag.time_constant_s + half) / _HOUR_S]
            axes.plot(ends, [place, place], "|-", color=DARK, markersize=5.0)
        axes.plot(
            [lag.time_constant_s / _HOUR_S],
            [place],
            marker="o",
            color=DARK,
            markerfacecolor=DARK if lag.gain > 0 else "white",
        )
    marks = ((sample_time_s, "sample time", ":"), (record_s, "length of the record", "--"))
    entries = [
        Line2D([], [], color="black", marker="o", linestyle="", markerfacecolor=face)
        for face in ("black", "white")
    ]
    labels = ["positive gain", "negative gain"]
    for at_s, label, line in marks:
        entries.append(axes.axvline(at_s / _HOUR_S, color=GREY, linewidth=1.0, linestyle=line))
        labels.append(label)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))  # the default one is a formula
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_yticks(range(len(rows)), [drawable(row, 34) for row in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.set_xlabel("time constant [h]")
    figure.legend(entries, labels, loc="outside lower center", ncols=4)
    figure.suptitle("Time constants of the model")
    return figure


def pole_maps(output: IdentifiedOutput) -> tuple[PoleZeroMap, ...]:
    """Return poles and zeros of an output of ARX or output error; none of modal."""
    return () if output.polynomials is None else pole_zero_map(output.polynomials)


def pole_zero_chart(outputs: Sequence[IdentifiedOutput]) -> ThermalChart | None:
    """Return poles and zeros of ARX and output error in the plane of z."""
    maps = [
        (f"{output.name}: {found.input_name}", found)
        for output in outputs
        for found in pole_maps(output)
        if found.poles.size + found.zeros.size
    ]
    if not maps:
        return None
    rows: list[tuple[str | float, ...]] = []
    for name, found in maps:
        for kind, values in (("pole", found.poles), ("zero", found.zeros)):
            rows += [(shown_text(name), kind, float(z.real), float(z.imag)) for z in values]
    shown = maps[:_MOST_MAPS]
    caption = (
        "Poles (crosses) and zeros (circles) of every part in the plane of z; a pole outside the"
        " circle is unstable."
    )
    if len(maps) > len(shown):
        caption += f" The first {len(shown)} of {len(maps)} parts."
    table = NumberTable(("part", "kind", "real", "imaginary"), rows, None)
    return ThermalChart("poles", caption, lambda: _draw_maps(shown), table)


def _draw_maps(maps: Sequence[tuple[str, PoleZeroMap]]) -> Figure:
    across = 2 if len(maps) == 4 else min(3, len(maps))
    down = -(-len(maps) // across)
    figure = new_figure(0.7 + 2.35 * down)
    table: list[list[Axes]] = figure.subplots(down, across, squeeze=False).tolist()
    axes = [a for row in table for a in row]
    angle = np.linspace(0.0, 2.0 * np.pi, 181)
    for place, (name, found) in zip(axes, maps, strict=False):
        place.plot(np.cos(angle), np.sin(angle), color=GREY, linewidth=0.8)
        for values, marker in ((found.poles, "x"), (found.zeros, "o")):
            near = values[np.abs(values) <= _LARGEST_SHOWN]
            place.plot(
                near.real,
                near.imag,
                marker,
                color=DARK,
                markerfacecolor="none",
                markersize=6.0,
                markeredgewidth=1.2,
            )
        everything = np.concatenate([found.poles, found.zeros])
        far = [float(abs(z)) for z in everything if abs(z) <= _LARGEST_SHOWN]
        limit = 1.15 * max([1.0, *far])
        place.set_xlim(-limit, limit)
        place.set_ylim(-limit, limit)
        place.set_aspect("equal")
        place.set_title(drawable(name, 34))
        place.set_xlabel("real part")
        place.set_ylabel("imaginary part")
    for unused in axes[len(maps) :]:
        unused.set_visible(False)
    figure.suptitle("Poles (crosses) and zeros (circles) in the plane of z")
    return figure
