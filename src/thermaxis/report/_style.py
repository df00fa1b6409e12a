"""How charts look: one style, independent of the machine, with the same bytes every time."""

# matplotlib leaves the types of keyword arguments open
# pyright: reportUnknownMemberType=false

import io
import re
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ft2font import FT2Font
from matplotlib.text import Text

from thermaxis.report._output import NumberTable, write_bytes
from thermaxis.report._text import plain_text

FIGURE_WIDTH_IN = 6.7
"""Width of the text of an A4 certificate. [in]"""
PNG_DPI = 200
"""Dots per inch of a PNG. [1/in]"""
_SETTLED = 7
"""Decimals of the places of the panes, in units of the figure. [1]"""
GREY = "#8c8c8c"
DARK = "#333333"
COLOURS = ("#0072b2", "#c84e00")
"""Forward and backward: told apart with all usual colour deficiencies, and dark on paper."""
MARKERS = ("^", "v")
"""Forward and backward: triangle up and down."""
FACES = ("#0072b2", "#ffffff")
"""Forward markers are filled, backward ones open: readable without colour."""
BOUND_STYLES = ("--", "-.")
"""Line of a bound, forward and backward."""
ARROWS = ("↑", "↓")
"""Index of the approach in the standard's symbols."""

_SETTINGS: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 7.5,
    "axes.titlesize": 8.0,
    "axes.labelsize": 7.5,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.5,
    "legend.fontsize": 7.0,
    "legend.frameon": False,
    "legend.handlelength": 3.0,
    "lines.linewidth": 1.1,
    "lines.markersize": 4.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "figure.titlesize": 8.5,
    "svg.fonttype": "path",
    "text.parse_math": False,
    "text.usetex": False,
    "path.simplify": True,
}
_NO_METADATA = {"Date": None, "Creator": None, "Format": None, "Type": None}


def style_of(approach: int) -> dict[str, Any]:
    """Return colour and marker of an approach."""
    return {
        "color": COLOURS[approach],
        "marker": MARKERS[approach],
        "markerfacecolor": FACES[approach],
    }


@contextmanager
def drawing(name: str) -> Generator[None]:
    """Set the style for the charts drawn and saved inside, whatever the machine's own settings."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_SETTINGS)
        mpl.rcParams["svg.hashsalt"] = f"thermaxis {name}"
        yield


def new_figure(height_in: float) -> Figure:
    """Return an empty figure of the certificate's width."""
    figure = Figure(figsize=(FIGURE_WIDTH_IN, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


@cache
def typeface(name: str) -> FT2Font:
    """Return a typeface that comes with the chart library."""
    return FT2Font(str(Path(mpl.get_data_path(), "fonts", "ttf", f"{name}.ttf")))


def chart_font() -> FT2Font:
    """Return the typeface of all charts."""
    return typeface("DejaVuSans")


def drawable(text: str, limit: int = 120) -> str:
    """Return text from a file so that a chart shows it, and nothing of it is obeyed."""
    return "".join(
        c if ord(c) < 128 or chart_font().get_char_index(ord(c)) else "□"
        for c in plain_text(text, limit)
    )


def set_heading(figure: Figure, first: str, second: str, *, title: str = "") -> None:
    """Put lines above a figure."""
    if title and _fits(figure, f"{first} · {title}"):
        first, title = f"{first} · {title}", ""
    lines = [_fitting(figure, first), *_title_lines(figure, title), _fitting(figure, second)]
    figure.suptitle("\n".join(lines), linespacing=1.35)


def _title_lines(figure: Figure, title: str) -> list[str]:
    """Return a title in one line or two that fit; nothing if it needs more."""
    if not title or _fits(figure, title):
        return [title] if title else []
    words = title.split(" ")
    for count in range(len(words) - 1, 0, -1):
        upper, lower = " ".join(words[:count]), " ".join(words[count:])
        if _fits(figure, upper):
            return [upper, lower] if _fits(figure, lower) else []
    return []


def _drawn_width(figure: Figure, line: str) -> float:
    probe = Text(0, 0, line, fontsize=mpl.rcParams["figure.titlesize"], figure=figure)
    return float(probe.get_window_extent(FigureCanvasAgg(figure).get_renderer()).width)


def _room(figure: Figure) -> float:
    return 0.97 * float(figure.get_figwidth()) * float(figure.dpi)


def _fits(figure: Figure, line: str) -> bool:
    return _drawn_width(figure, line) <= _room(figure)


def _fitting(figure: Figure, line: str) -> str:
    width = _room(figure)
    while len(line) > 8 and (drawn := _drawn_width(figure, line)) > width:
        line = line[: min(len(line) - 2, int(len(line) * width / drawn) - 1)].rstrip() + "…"
    return line


def _settle(figure: Figure) -> None:
    """Lay a figure out once and for all, without the round-off of the solver.

    The round-off differs from time to time, and the identifiers inside an SVG depend on it.
    """
    engine = figure.get_layout_engine()
    if engine is None:
        return
    engine.execute(figure)
    figure.set_layout_engine(None)  # with "none" it would be drawn once more, to nowhere
    for axes in figure.axes:
        x, y, width, height = axes.get_position(original=True).bounds
        place = (round(x, _SETTLED), round(y, _SETTLED))
        axes.set_position((*place, round(width, _SETTLED), round(height, _SETTLED)))


def svg_bytes(figure: Figure) -> bytes:
    """Return a figure as SVG, text as outlines, without date and comments."""
    _settle(figure)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="svg", metadata=_NO_METADATA)
    text = buffer.getvalue().decode("utf-8")
    return re.sub(r"\s*<!--.*?-->", "", text, flags=re.DOTALL).encode("utf-8")


def png_bytes(figure: Figure) -> bytes:
    """Return a figure as PNG, without date and name of the program."""
    _settle(figure)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=PNG_DPI, metadata={"Software": None})
    return buffer.getvalue()


def write_chart(
    folder: Path, name: str, draw: Callable[[], Figure], numbers: Mapping[str, NumberTable]
) -> list[Path]:
    """Write a chart as PNG and SVG, and its numbers as CSV by what is added to the name."""
    with drawing(name):
        figure = draw()
        pictures = {f"{name}.png": png_bytes(figure), f"{name}.svg": svg_bytes(figure)}
    tables = {f"{name}{more}.csv": table.as_csv() for more, table in numbers.items()}
    return [write_bytes(folder / file, data) for file, data in (pictures | tables).items()]


def mark_targets(axes: Axes, target: list[float]) -> None:
    """Draw a tick at every target along the lower edge, also where a number stands."""
    axes.xaxis.remove_overlapping_locs = False
    axes.set_xticks(target, minor=True)
    axes.tick_params(axis="x", which="minor", length=4.5, width=1.1, color="black")


def zero_line(axes: Axes) -> None:
    """Draw the line of no deviation."""
    axes.axhline(0.0, color="black", linewidth=0.7, zorder=1.5)


def legend_below(figure: Figure, axes: Axes, columns: int) -> None:
    """Put the legend of an axes below the figure, outside the data."""
    entries, labels = axes.get_legend_handles_labels()
    figure.legend(entries, labels, loc="outside lower center", ncols=columns)
