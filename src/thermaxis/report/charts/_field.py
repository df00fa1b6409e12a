"""Charts of thermal fields in plan view (figures 8 and 9 of the paper) and of regions over time."""

# matplotlib leaves the types of keyword arguments open
# pyright: reportUnknownMemberType=false

from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.contour import QuadContourSet
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator

from thermaxis.codes import printable
from thermaxis.files.table import protected
from thermaxis.report._output import NumberTable, make_folder
from thermaxis.report._style import (
    FIGURE_WIDTH_IN,
    drawable,
    legend_below,
    new_figure,
    set_heading,
    write_chart,
)
from thermaxis.thermal import FloatArray, ThermalFieldsResult, default_regions

_MOST_DRAWN = 800
"""Pixels along an edge of a drawn image; a larger image is averaged. [1]"""
_CONTOUR_CELLS = 40
"""Cells along the longer edge from which contours are drawn: finer ones follow the noise. [1]"""
_LEVEL_IN_NOISE = 10.0
"""An image whose extent is less than that many times the noise of its cells has no contours. [1]"""
_MOST_IMAGES = 6
"""Images that are drawn side by side. [1]"""
_MOST_REGIONS = 12
"""Regions that are drawn. [1]"""
_LINES = ("-", "--", "-.", ":")
_MARKERS = ("o", "s", "^", "D", "v", "P")
_COLOURS = ("#000000", "#0072b2", "#c84e00", "#5a7d00", "#7a4fa0", "#666666")
_COLOUR_MAP = "cividis"
"""Its lightness grows steadily: readable without colour."""
_HALO = (withStroke(linewidth=2.0, foreground="white"),)


class _Scale(NamedTuple):
    """Length of the edge of a pixel."""

    per_pixel: float
    unit: str


def write_field_figures(
    result: ThermalFieldsResult, folder: Path, *, mm_per_pixel: float | None = None
) -> tuple[Path, ...]:
    """Write the charts of thermal fields, and the numbers behind them, as `write_figures` does.

    Parameters
    ----------
    mm_per_pixel : float, optional
        Scale of the images. Default: axes count pixels. [mm]

    References
    ----------
    Stejskal et al. 2017, figures 8 and 9.
    """
    make_folder(folder)
    scale = _Scale(1.0, "px") if mm_per_pixel is None else _Scale(mm_per_pixel, "mm")
    difference = _difference_numbers(result, scale)
    charts = (
        ("field_difference", partial(draw_difference, result, scale), difference),
        ("field_images", partial(draw_images, result, scale), _image_numbers(result)),
        ("field_regions", partial(draw_regions, result), _region_numbers(result)),
    )
    return tuple(
        path
        for name, draw, numbers in charts
        for path in write_chart(folder, name, draw, {"": numbers})
    )


# ---- plan views ---------------------------------------------------------------------------------


def averaged(values: FloatArray, most: int) -> tuple[FloatArray, int]:
    """Average square blocks of pixels until no edge is longer than `most`."""
    size = max(1, -(-max(values.shape) // most))
    if size == 1:
        return values, 1
    rows, columns = values.shape
    present = ~np.isnan(values)

    def summed(array: FloatArray) -> FloatArray:
        over_rows = np.add.reduceat(array, list(range(0, rows, size)), axis=0)
        return np.asarray(np.add.reduceat(over_rows, list(range(0, columns, size)), axis=1))

    count = summed(present.astype(np.float64))
    total = summed(np.where(present, values, 0.0))
    return np.where(count > 0.0, total / np.maximum(count, 1.0), np.nan), size


def _centres(blocks: FloatArray, edge: float) -> tuple[FloatArray, FloatArray]:
    """Return the places of the blocks' centres, from the left and from the top."""
    rows, columns = blocks.shape
    x: FloatArray = (np.arange(columns, dtype=np.float64) + 0.5) * edge
    y: FloatArray = (np.arange(rows, dtype=np.float64) + 0.5) * edge
    return x, y


def _show(axes: Axes, values: FloatArray, scale: _Scale, limits: tuple[float, float]) -> None:
    """Draw an image in plan view; missing pixels let the hatching through."""
    height, width = (pixels * scale.per_pixel for pixels in values.shape)
    blocks, size = averaged(values, _MOST_DRAWN)
    edge = size * scale.per_pixel
    axes.imshow(
        np.ma.masked_invalid(blocks),
        cmap=colormaps[_COLOUR_MAP],
        vmin=limits[0],
        vmax=limits[1],
        extent=(0.0, blocks.shape[1] * edge, blocks.shape[0] * edge, 0.0),
        interpolation="nearest",
        zorder=1.0,
    )
    axes.set_xlim(0.0, width)
    axes.set_ylim(height, 0.0)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set_facecolor("#ffffff")
    hatched = Rectangle((0.0, 0.0), width, height, facecolor="none", edgecolor="#999999")
    hatched.set(hatch="xxxx", linewidth=0.0, zorder=0.5)
    axes.add_patch(hatched)


def _limits_of(values: FloatArray) -> tuple[float, float]:
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _smooth(blocks: FloatArray) -> FloatArray:
    """Average each block with its neighbours (1 2 1, twice); missing ones stay missing."""
    present = ~np.isnan(blocks)
    total, weight = np.where(present, blocks, 0.0), present.astype(np.float64)
    for axis in (0, 1, 0, 1):
        total, weight = _with_neighbours(total, axis), _with_neighbours(weight, axis)
    return np.where(present, total / np.where(weight > 0.0, weight, 1.0), np.nan)


def _with_neighbours(values: FloatArray, axis: int) -> FloatArray:
    first = np.take(values, [0], axis=axis)
    last = np.take(values, [-1], axis=axis)
    padded = np.moveaxis(np.concatenate((first, values, last), axis=axis), axis, 0)
    mixed = 0.25 * padded[:-2] + 0.5 * padded[1:-1] + 0.25 * padded[2:]
    return np.asarray(np.moveaxis(mixed, 0, axis), dtype=np.float64)


def _is_level(blocks: FloatArray) -> bool:
    """Say whether an image varies no more than noise does: contours would be a maze."""
    steps = np.abs(np.concatenate([np.diff(blocks, axis=axis).ravel() for axis in (0, 1)]))
    known = steps[~np.isnan(steps)]
    if known.size == 0:
        return True
    noise = 1.48 * float(np.median(known)) / np.sqrt(2.0)
    return float(np.nanmax(blocks) - np.nanmin(blocks)) <= _LEVEL_IN_NOISE * noise


def _levels_of(limits: tuple[float, float], most: int = 9) -> list[float]:
    steps = MaxNLocator(most, steps=[1, 2, 2.5, 5, 10]).tick_values(*limits)
    return [float(v) for v in steps]


def _contours(
    axes: Axes, values: FloatArray, scale: _Scale, levels: list[float]
) -> QuadContourSet | None:
    """Draw labelled contour lines of the averaged image; none where it is level."""
    blocks, size = averaged(values, _CONTOUR_CELLS)
    if min(blocks.shape) < 2 or _is_level(blocks):
        return None
    blocks = _smooth(blocks)
    low, high = float(np.nanmin(blocks)), float(np.nanmax(blocks))
    inner = [v for v in levels if low < v < high]
    if not inner:
        return None
    x, y = _centres(blocks, size * scale.per_pixel)
    drawn = axes.contour(
        x, y, np.ma.masked_invalid(blocks), levels=inner, colors="black", linewidths=0.8, zorder=2.0
    )
    for label in axes.clabel(drawn, fmt="%g", fontsize=7.0, inline=True):
        label.set_path_effects(list(_HALO))
    return drawn


def _outline_regions(axes: Axes, result: ThermalFieldsResult, scale: _Scale) -> None:
    edge = scale.per_pixel
    rows, columns = result.fields[0].shape
    named = result.regions != default_regions((rows, columns))  # quarters need no names
    for region in result.regions[:_MOST_REGIONS]:
        width, height = region.right_px - region.left_px, region.bottom_px - region.top_px
        if width >= columns and height >= rows:
            continue
        corner = (region.left_px * edge, region.top_px * edge)
        outline = Rectangle(
            corner, width * edge, height * edge, facecolor="none", edgecolor="black"
        )
        outline.set(linestyle=(0, (4, 3)), linewidth=0.7, zorder=3.0)
        outline.set_path_effects([withStroke(linewidth=1.8, foreground="#ffffffa0")])
        axes.add_patch(outline)
        axes.annotate(
            drawable(region.name, 24) if named else "",
            corner,
            xytext=(3.0, -3.0),
            textcoords="offset points",
            verticalalignment="top",
            fontsize=6.5,
            bbox={"boxstyle": "square,pad=0.15", "facecolor": "#ffffffd0", "linewidth": 0.0},
            zorder=4.0,
        )


def _label_edges(axes: Axes, scale: _Scale) -> None:
    axes.set_xlabel(f"from the left edge [{scale.unit}]")
    axes.set_ylabel(f"from the upper edge [{scale.unit}]")


def _names(result: ThermalFieldsResult) -> str:
    count = len(result.fields)
    first, last = (drawable(result.fields[k].name or f"image {k + 1}", 50) for k in (0, count - 1))
    return f"{last} minus {first}"


def draw_difference(result: ThermalFieldsResult, scale: _Scale) -> Figure:
    """Draw the difference of the last image to the first one in plan view."""
    rows, columns = result.fields[0].shape
    height = min(max(FIGURE_WIDTH_IN * 0.82 * rows / columns + 0.9, 2.2), 8.5)
    figure = new_figure(height)
    figure.set_layout_engine("compressed")
    axes = figure.subplots()
    limits = _limits_of(result.difference_k)
    _show(axes, result.difference_k, scale, limits)
    drawn = _contours(axes, result.difference_k, scale, _levels_of(limits))
    _outline_regions(axes, result, scale)
    _label_edges(axes, scale)
    bar = figure.colorbar(
        ScalarMappable(Normalize(*limits), colormaps[_COLOUR_MAP]), ax=axes, fraction=0.05
    )
    bar.set_label("temperature difference [K]")
    if drawn is not None:
        bar.add_lines(drawn)
    missing = int(np.count_nonzero(np.isnan(result.difference_k)))
    hatched = f" · {missing} pixels missing (hatched)" if missing else ""
    mean = float(np.nanmean(result.difference_k))
    set_heading(
        figure,
        "Thermal field in plan view: difference",
        f"{_names(result)} · mean {mean:+.2f} K{hatched}",
    )
    return figure


def _not_drawn(count: int) -> str:
    return f" · {count} more are not drawn" if count else ""


def _drawn_images(result: ThermalFieldsResult) -> list[int]:
    count = len(result.fields)
    spread = np.linspace(0, count - 1, min(count, _MOST_IMAGES))
    return [int(k) for k in np.unique(np.round(spread))]


def draw_images(result: ThermalFieldsResult, scale: _Scale) -> Figure:
    """Draw the images in plan view with one scale of temperature."""
    drawn = _drawn_images(result)
    across = min(len(drawn), 2 if len(drawn) in (2, 4) else 3)
    down = -(-len(drawn) // across)
    rows, columns = result.fields[0].shape
    one = (FIGURE_WIDTH_IN * 0.86 / across) * rows / columns
    figure = new_figure(min(max(down * (one + 0.35) + 0.8, 2.2), 8.5))
    figure.set_layout_engine("compressed")
    grid: list[list[Axes]] = figure.subplots(
        down, across, squeeze=False, sharex=True, sharey=True
    ).tolist()
    panels = [axes for line in grid for axes in line]
    limits = _limits_of(
        np.array([bound for k in drawn for bound in _limits_of(result.fields[k].temperature_c)])
    )
    for axes, k in zip(panels, drawn, strict=False):
        _show(axes, result.fields[k].temperature_c, scale, limits)
        _contours(axes, result.fields[k].temperature_c, scale, _levels_of(limits, 18))
        axes.set_title(_image_title(result, k, 80 // across - 10))
    for axes in panels[len(drawn) :]:
        axes.set_visible(False)
    for axes in panels[::across]:
        _label_edges(axes, scale)
        axes.set_xlabel("")
    for axes in panels[max(len(drawn) - across, 0) : len(drawn)]:
        axes.set_xlabel(f"from the left edge [{scale.unit}]")
        axes.tick_params(axis="x", labelbottom=True)
    bar = figure.colorbar(
        ScalarMappable(Normalize(*limits), colormaps[_COLOUR_MAP]), ax=panels, fraction=0.04
    )
    bar.set_label("temperature [°C]")
    more = _not_drawn(len(result.fields) - len(drawn))
    set_heading(
        figure,
        "Thermal fields in plan view",
        f"{len(result.fields)} images of {columns} x {rows} pixels, one scale{more}",
    )
    return figure


def _image_title(result: ThermalFieldsResult, k: int, limit: int) -> str:
    name = drawable(result.fields[k].name or f"image {k + 1}", limit)
    if result.time_s is None:
        return f"{k + 1}: {name}"
    return f"{k + 1}: {name}, {float(result.time_s[k]) / 3600.0:.2f} h"


# ---- regions over time --------------------------------------------------------------------------


def draw_regions(result: ThermalFieldsResult) -> Figure:
    """Draw the regions' mean temperatures over time."""
    drawn = result.regions[:_MOST_REGIONS]
    columns = 3 if len(drawn) > 2 else len(drawn)
    figure = new_figure(2.9 + 0.16 * -(-len(drawn) // columns))
    axes = figure.subplots()
    images = np.arange(1.0, len(result.fields) + 1.0)
    time = images if result.time_s is None else result.time_s / 3600.0
    for r, region in enumerate(drawn):
        axes.plot(
            time,
            result.region_mean_c[:, r],
            color=_COLOURS[r % len(_COLOURS)],
            linestyle=_LINES[r % len(_LINES)],
            marker=_MARKERS[r % len(_MARKERS)],
            markerfacecolor="none",
            markersize=8.5 - 6.0 * r / _MOST_REGIONS,  # one inside the other where they coincide
            label=f"{drawable(region.name, 24)}: {result.region_change_k[r]:+.2f} K",
        )
    if result.time_s is None:
        axes.set_xlabel("image")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    else:
        axes.set_xlabel("time of the image [h]")
    axes.set_ylabel("mean temperature [°C]")
    legend_below(figure, axes, columns)
    more = _not_drawn(len(result.regions) - len(drawn))
    set_heading(
        figure,
        "Mean temperature of the regions",
        f"{_names(result)}: change beside each name{more}",
    )
    return figure


# ---- the numbers behind them --------------------------------------------------------------------


def _difference_numbers(result: ThermalFieldsResult, scale: _Scale) -> NumberTable:
    """Return the difference as it is drawn: one row per block of pixels."""
    blocks, size = averaged(result.difference_k, _MOST_DRAWN)
    x, y = _centres(blocks, size * scale.per_pixel)
    rows = np.column_stack((np.tile(x, y.size), np.repeat(y, x.size), blocks.ravel()))
    return NumberTable((f"x_{scale.unit}", f"y_{scale.unit}", "difference_k"), rows.tolist())


def _image_numbers(result: ThermalFieldsResult) -> NumberTable:
    rows: list[list[float | int | str]] = []
    for k, field in enumerate(result.fields):
        values = field.temperature_c
        time = float("nan") if result.time_s is None else float(result.time_s[k])
        missing = int(np.count_nonzero(np.isnan(values)))
        figures = [float(f(values)) for f in (np.nanmin, np.nanmean, np.nanmax)]
        rows.append([k + 1, protected(printable(field.name, 300)), time, missing, *figures])
    return NumberTable(
        ("image", "name", "time_s", "missing_pixels", "min_c", "mean_c", "max_c"), rows
    )


def _region_numbers(result: ThermalFieldsResult) -> NumberTable:
    columns = ("region", "left_px", "right_px", "top_px", "bottom_px", "pixels")
    rows: list[list[float | int | str]] = []
    for r, region in enumerate(result.regions):
        edges = [region.left_px, region.right_px, region.top_px, region.bottom_px]
        means: list[float] = result.region_mean_c[:, r].tolist()
        change = float(result.region_change_k[r])
        name = protected(printable(region.name, 300))
        rows.append([name, *edges, int(result.region_pixels[r]), *means, change])
    images = tuple(f"mean_{k + 1}_c" for k in range(len(result.fields)))
    return NumberTable((*columns, *images, "change_k"), rows)
