"""Chart of the Monte Carlo of differences (figure 1 of the paper)."""

# matplotlib leaves the types of keyword arguments open
# pyright: reportUnknownMemberType=false

import numpy as np
from matplotlib.figure import Figure

from thermaxis.positioning import DifferenceMonteCarlo, FloatArray
from thermaxis.report._style import COLOURS, legend_below, new_figure, set_heading


def draw_montecarlo(result: DifferenceMonteCarlo) -> Figure:
    """Draw the distributions of the source and of the derived sequence."""
    figure = new_figure(3.6)
    axes = figure.subplots()
    edges = result.histogram_edges
    estimate = result.one_sequence
    sequences = (
        ("source a", result.source_counts, result.source_deviation, result.sigma_a, "-", None),
        (
            "derived aₖ - aₖ₊₁",
            result.derived_counts,
            result.derived_deviation,
            result.sigma_a * estimate.theory,
            "--",
            "////",
        ),
    )
    x = np.linspace(float(edges[0]), float(edges[-1]), 401)
    for number, (name, counts, s, sigma, line, hatch) in enumerate(sequences):
        axes.stairs(
            counts,
            edges,
            fill=True,
            facecolor=COLOURS[number] + "30" if hatch is None else "none",
            edgecolor=COLOURS[number],
            hatch=hatch,
            linewidth=0.9,
            linestyle=line,
            label=f"{name}: s = {s:.4g}",
        )
        axes.plot(
            x,
            _normal_counts(x, sigma, float(np.sum(counts)), float(edges[1] - edges[0])),
            color=COLOURS[number],
            linestyle=line,
            linewidth=1.4,
            label=f"normal distribution, σ = {sigma:.4g}",
        )
    axes.set_xlabel("value [any unit]")
    axes.set_ylabel("numbers per class")
    set_heading(
        figure,
        f"Source and derived sequence: s ratio {estimate.first:.4f}, theory {estimate.theory:.4f}",
        f"{result.samples} numbers, seed {result.seed} · mean of {result.repetitions} repetitions"
        f" {estimate.mean:.4f} · 95 % of single experiments"
        f" {estimate.single_interval[0]:.3f} to {estimate.single_interval[1]:.3f}",
    )
    legend_below(figure, axes, 2)
    return figure


def _normal_counts(x: FloatArray, sigma: float, total: float, width: float) -> FloatArray:
    density = np.exp(-0.5 * (x / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi))
    return np.asarray(total * width * density, dtype=np.float64)
