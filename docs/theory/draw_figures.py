"""Draw the two figures of the theory page from made readings, the same bytes every time.

python docs/theory/draw_figures.py [--folder DIR] [--format svg|png]
"""

import argparse
import io
from collections.abc import Callable
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from thermaxis.positioning import FloatArray, adjacent_differences

BLUE, ORANGE, GREY, DARK = "#0072B2", "#D55E00", "#9a9a9a", "#333333"
STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "thermaxis theory",
}
POSITIONS = 8
CYCLES = 30


def made_readings() -> tuple[FloatArray, FloatArray]:
    """Make readings of one approach that warm up together.

    Returns
    -------
    deviation : FloatArray
        Readings, (8, 30): position, cycle. [µm]
    state : FloatArray
        Deviations without noise during the first cycle, (8,). [µm]
    """
    level = np.array([2.0, 4.5, 3.0, 7.0, 6.0, 9.5, 8.0, 11.0])
    drift = 13.0 * (1.0 - np.exp(-np.arange(CYCLES) / 9.0))
    share = 1.0 + 0.004 * np.arange(POSITIONS)
    noise = np.random.default_rng(9).normal(0.0, 0.55, (POSITIONS, CYCLES))
    return level[:, None] + share[:, None] * drift + noise, level


def draw_neighbours(figure: Figure) -> None:
    """Draw figure 2: why the mean mutual deviations are added to one cycle.

    Parameters
    ----------
    figure : Figure
        Empty figure.
    """
    deviation, state = made_readings()
    mean_difference, uncertainty, _ = adjacent_differences(deviation)
    figure.set_size_inches(10.0, 5.4)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.15), height_ratios=(1.4, 1.0))
    _draw_two_positions(figure.add_subplot(grid[0, 0]), deviation)
    _draw_difference(figure.add_subplot(grid[1, 0]), deviation, float(mean_difference[2]))
    chart = deviation[0, 0] - np.concatenate(([0.0], np.cumsum(mean_difference)))
    bound = 2.0 * np.concatenate((uncertainty[:1], uncertainty))
    _draw_chart(figure.add_subplot(grid[:, 1]), deviation, state, chart, bound)


def _draw_two_positions(axes: Axes, deviation: FloatArray) -> None:
    cycle = np.arange(1, CYCLES + 1)
    axes.vlines(cycle, deviation[2], deviation[3], color=GREY, linewidth=0.8)
    axes.plot(cycle, deviation[3], "s-", color=ORANGE, markersize=3.5, linewidth=0.8)
    axes.plot(cycle, deviation[2], "^-", color=BLUE, markersize=4.0, linewidth=0.8)
    axes.annotate("position 4", (30, deviation[3, -1]), (30, 23.0), ha="right", color=ORANGE)
    axes.annotate("position 3", (30, deviation[2, -1]), (30, 11.5), ha="right", color=BLUE)
    axes.set_title("(a) Both positions carry the drift")
    axes.set_ylabel("deviation, µm")
    axes.set_ylim(0.0, 25.0)
    axes.set_xlim(0.0, CYCLES + 1.0)
    axes.tick_params(labelbottom=False)


def _draw_difference(axes: Axes, deviation: FloatArray, mean: float) -> None:
    cycle = np.arange(1, CYCLES + 1)
    axes.axhline(mean, color=DARK, linewidth=1.2)
    axes.plot(cycle, deviation[2] - deviation[3], "o", color=DARK, markersize=3.5)
    axes.annotate("mean mutual deviation, equation (4)", (1, mean), (1, -0.6), color=DARK)
    axes.set_title("(b) Their difference hardly does")
    axes.set_ylabel("$x_{3,j}-x_{4,j}$, µm")
    axes.set_xlabel("cycle j")
    axes.set_ylim(-8.0, 0.5)
    axes.set_xlim(0.0, CYCLES + 1.0)


def _draw_chart(
    axes: Axes, deviation: FloatArray, state: FloatArray, chart: FloatArray, bound: FloatArray
) -> None:
    position = np.arange(1, POSITIONS + 1)
    mean = np.mean(deviation, axis=1)
    s = np.std(deviation, axis=1, ddof=1)
    axes.fill_between(position, mean - 2 * s, mean + 2 * s, color="#e6e6e6", linewidth=0.0)
    axes.plot(position, mean, "--", color=GREY, linewidth=1.6)
    axes.plot(position, state, ":", color=DARK, linewidth=1.6, label="state during the first cycle")
    axes.plot(
        position,
        deviation[:, 0],
        "o",
        color=DARK,
        markerfacecolor="white",
        label="readings of the first cycle",
    )
    axes.errorbar(
        position,
        chart,
        yerr=bound,
        color=BLUE,
        linewidth=1.6,
        elinewidth=1.0,
        capsize=3.0,
        label="first reading, then mean mutual deviations;\nbounds of equation (6)",
    )
    axes.text(4.9, 20.4, "mean of all cycles ±2s", color=DARK, ha="center")
    axes.annotate(
        "noise of the first reading:\nshifts the whole chart",
        (1.0, 0.5 * float(chart[0] + state[0])),
        (1.6, -0.5),
        arrowprops={"arrowstyle": "->", "color": DARK},
    )
    axes.set_title("(c) Added to the first cycle they give its state")
    axes.set_xlabel("position i")
    axes.set_ylabel("deviation, µm")
    axes.set_xticks(position)
    axes.set_ylim(-1.0, 33.0)
    axes.legend(loc="upper left")


def draw_positioning_model(figure: Figure) -> None:
    """Draw figure 3: the positioning model of the method.

    Parameters
    ----------
    figure : Figure
        Empty figure.
    """
    figure.set_size_inches(8.2, 4.6)
    axes = figure.add_subplot()
    target = np.array([0.0, 21.0, 39.0, 61.0, 80.0])
    level = np.array([2.4, 6.4, 4.4, 8.8, 11.0])
    spread = np.array([0.0, 0.7, 1.5, 0.8, 0.7])
    axes.axhline(0.0, color=DARK, linewidth=0.8)
    for i in range(1, target.size):
        _draw_pair(axes, target[i - 1 : i + 1], level[i - 1 : i + 1], float(spread[i]), i)
    axes.plot(target, level, "o", color=DARK, markersize=5.0, zorder=4)
    axes.annotate(
        "anchor: reading at the reference\nposition in the reference cycle",
        (target[0], level[0]),
        (-6.0, 9.2),
        arrowprops={"arrowstyle": "->", "color": DARK},
    )
    axes.annotate(
        "band of the\nmutual spread",
        (target[2] + 2.0, level[2] - 2.4),
        (target[2] + 7.5, 1.0),
        arrowprops={"arrowstyle": "->", "color": ORANGE},
        color=ORANGE,
    )
    axes.annotate(
        "systematic part\nof a pair",
        (target[3] - 4.4, 5.4),
        (target[3] + 2.5, 4.0),
        arrowprops={"arrowstyle": "->", "color": BLUE},
        color=BLUE,
    )
    axes.set_xticks(target, [f"$P_{i}$" for i in range(1, target.size + 1)])
    axes.set_xlabel("target position (spacing as measured, not equal)")
    axes.set_ylabel("deviation")
    axes.set_yticks([0.0])
    axes.set_xlim(-8.0, 92.0)
    axes.set_ylim(-0.8, 14.0)


def _draw_pair(axes: Axes, target: FloatArray, level: FloatArray, spread: float, i: int) -> None:
    """Draw the step from one position to the next and the band around its end."""
    end, arrow = float(target[1]), float(target[1]) - 4.6
    axes.plot((target[0], arrow), (level[0], level[0]), "--", color=GREY, linewidth=0.9)
    axes.plot((arrow, end), (level[1], level[1]), "--", color=GREY, linewidth=0.9)
    axes.annotate(
        "",
        (arrow, float(level[1])),
        (arrow, float(level[0])),
        arrowprops={
            "arrowstyle": "-|>",
            "color": BLUE,
            "linewidth": 1.8,
            "shrinkA": 0.0,
            "shrinkB": 0.0,
        },
    )
    middle = float(np.mean(level))
    axes.text(arrow - 0.8, middle, rf"$-{{}}^*\bar x_{i}$", color=BLUE, ha="right", va="center")
    half = 2.0 * spread
    axes.fill_between(
        (end - 2.2, end + 2.2),
        float(level[1]) - half,
        float(level[1]) + half,
        color=ORANGE,
        alpha=0.22,
        linewidth=0.0,
    )
    height = np.linspace(-half * 1.3, half * 1.3, 81)
    bell = 3.4 * np.exp(-0.5 * (height / spread) ** 2)
    axes.plot(end + 2.2 + bell, level[1] + height, color=ORANGE, linewidth=1.2)
    for edge in (-half, half):
        axes.hlines(float(level[1]) + edge, end - 2.2, end + 2.2, color=ORANGE, linewidth=1.2)
    axes.text(
        end + 2.8,
        float(level[1]) + half,
        rf"$\pm 2\,{{}}^*s_{i}$",
        color=ORANGE,
        ha="left",
        va="bottom",
    )


FIGURES: dict[str, Callable[[Figure], None]] = {
    "figure_02": draw_neighbours,
    "figure_03": draw_positioning_model,
}


def rendered(name: str, file_format: str = "svg") -> bytes:
    """Return a figure as the bytes of its file.

    Parameters
    ----------
    name : str
        `figure_02` or `figure_03`.
    file_format : str
        `svg` or `png`. Default: what the page shows.

    Returns
    -------
    bytes
        The same for the same version of matplotlib: no date, no random names, fonts as paths.
    """
    with mpl.rc_context({**mpl.rcParamsDefault, **STYLE}):
        figure = Figure(layout="constrained")
        FIGURES[name](figure)
        stream = io.BytesIO()
        metadata = {"Date": None, "Creator": None} if file_format == "svg" else {"Software": None}
        figure.savefig(stream, format=file_format, dpi=130, metadata=metadata)
    return stream.getvalue().replace(b"\r\n", b"\n") if file_format == "svg" else stream.getvalue()


def main() -> int:
    """Write the figures.

    Returns
    -------
    int
        Exit code 0.
    """
    parser = argparse.ArgumentParser(description="Draw the figures of the theory page.")
    parser.add_argument("--folder", type=Path, default=Path(__file__).parent)
    parser.add_argument("--format", choices=("svg", "png"), default="svg")
    arguments = parser.parse_args()
    for name in FIGURES:
        path: Path = arguments.folder / f"{name}.{arguments.format}"
        path.write_bytes(rendered(name, arguments.format))
        print(path)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
