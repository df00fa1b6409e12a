"""How the figures depend on the number of cycles that are used."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import final

import numpy as np

from thermaxis.errors import DataError
from thermaxis.positioning.run import FloatArray, PositioningTest, freeze_arrays
from thermaxis.positioning.standard._iso230_2 import FIGURE_KEYS, iso230_2_figures

MOST_EVALUATIONS = 200
"""Numbers of cycles that are evaluated at most; a chart shows no more. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class FiguresAgainstCycles:
    """Figures of a run evaluated from its first k cycles only."""

    cycles: FloatArray
    """Numbers k of cycles used, 2 ... n, (K,). [1]"""
    figures: Mapping[str, FloatArray]
    """Figures of ISO 230-2 by key, (K,) each; NaN where absent. [µm or arcsec]"""
    s_rms: FloatArray
    """Root mean square over the targets of the standard's s, (K, 2). [µm or arcsec]"""
    difference_rms: FloatArray
    """Root mean square over the pairs of the standard deviation of the adjacent differences,
    (K, 2). [µm or arcsec]"""

    def __post_init__(self) -> None:
        freeze_arrays(self)


def evaluate_against_cycles(test: PositioningTest) -> FiguresAgainstCycles:
    """Evaluate the first 2, 3, ... n cycles of a run, at most 200 of these numbers.

    With thermal drift the standard's repeatability grows with the duration of the test, while
    the spread of adjacent differences settles.

    Parameters
    ----------
    test : PositioningTest
        The measured run, at least two cycles.

    Returns
    -------
    FiguresAgainstCycles
        Figures against the number of cycles.

    Raises
    ------
    DataError
        If the run has fewer than two cycles.

    References
    ----------
    Stejskal et al. 2017, section "Order of measurements": the result of the standard's method
    depends on the duration of the measurement and the number of repetitions.
    """
    if test.cycles < 2:
        raise DataError("too_few_cycles", cycles=test.cycles, needed=2)
    points = min(test.cycles - 1, MOST_EVALUATIONS)
    counts = np.unique(np.round(np.linspace(2, test.cycles, points)).astype(np.intp)).tolist()
    rows: list[list[float]] = []
    spread: list[FloatArray] = []
    difference_spread: list[FloatArray] = []
    for k in counts:
        first = test.deviation[:, :k]
        f = iso230_2_figures(first)
        rows.append([float(getattr(f, key)) for key in FIGURE_KEYS])
        difference = iso230_2_figures(first[:-1] - first[1:]) if test.target.size > 1 else f
        spread.append(np.sqrt(np.mean(f.s**2, axis=0)))
        difference_spread.append(np.sqrt(np.mean(difference.s**2, axis=0)))
    table = np.array(rows)
    return FiguresAgainstCycles(
        cycles=np.array(counts, dtype=np.float64),
        figures=MappingProxyType({key: table[:, i] for i, key in enumerate(FIGURE_KEYS)}),
        s_rms=np.array(spread),
        difference_rms=np.array(difference_spread),
    )
