"""The numbers behind each chart."""

from collections.abc import Mapping
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermaxis.positioning import APPROACHES, FIGURE_KEYS, DifferenceMonteCarlo, FloatArray
from thermaxis.report._output import NumberTable
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report.charts._parts import adjacent_of

IntArray: TypeAlias = NDArray[np.int64]
TextArray: TypeAlias = NDArray[np.str_]


def _suffixes(report: PositioningReport) -> tuple[str, str]:
    units = report.test.kind.units
    return units.position_suffix, units.deviation_suffix


def _columns(
    named: Mapping[str, FloatArray | IntArray | TextArray], decimals: int | None = 9
) -> NumberTable:
    rows = list(zip(*(values.tolist() for values in named.values()), strict=True))
    return NumberTable(tuple(named), rows, decimals)


def _counts(values: FloatArray) -> IntArray:
    return np.round(values).astype(np.int64)


def iso230_2_numbers(report: PositioningReport) -> NumberTable:
    """Return the results of each target."""
    position, unit = _suffixes(report)
    result = report.iso230_2
    named = {f"target_{position}": result.target}
    for key, values in (("mean", result.mean), ("s", result.s)):
        for approach, name in enumerate(APPROACHES):
            named[f"{key}_{name}_{unit}"] = values[:, approach]
    named[f"mean_{unit}"] = result.mean_bidirectional
    named[f"B_{unit}"] = result.B_i
    for approach, name in enumerate(APPROACHES):
        named[f"R_{name}_{unit}"] = result.R_i_unidirectional[:, approach]
    named[f"R_{unit}"] = result.R_i
    return _columns(named)


def reading_numbers(report: PositioningReport, deviation: FloatArray, name: str) -> NumberTable:
    """Return one row per reading."""
    position, unit = _suffixes(report)
    test = report.test
    every = np.indices((test.cycles, len(test.approaches), test.target.size)).reshape(3, -1)
    cycle, approach, i = every[0], np.array(test.approaches)[every[1]], every[2]
    named: dict[str, FloatArray | IntArray | TextArray] = {
        "cycle": cycle + 1,
        "direction": np.array(APPROACHES)[approach],
        f"target_{position}": test.target[i],
        f"{name}_{unit}": deviation[i, cycle, approach],
    }
    if test.time_s is not None:
        named["time_s"] = test.time_s[i, cycle, approach]
    return _columns(named)


def one_position_numbers(report: PositioningReport, position: int) -> NumberTable:
    """Return the readings of one position over the cycles."""
    where, unit = _suffixes(report)
    test = report.test
    named: dict[str, FloatArray | IntArray] = {
        "cycle": np.arange(1, test.cycles + 1),
        f"target_{where}": np.full(test.cycles, test.target[position]),
    }
    for approach, name in enumerate(APPROACHES):
        named[f"{name}_{unit}"] = test.deviation[position, :, approach]
        if test.time_s is not None:
            named[f"time_{name}_s"] = test.time_s[position, :, approach]
    return _columns(named)


def pair_numbers(report: PositioningReport, keys: tuple[str, ...]) -> NumberTable:
    """Return results of the adjacent-difference method for each pair of neighbours."""
    result, (position, unit) = adjacent_of(report), _suffixes(report)
    m = result.target.size
    named: dict[str, FloatArray | IntArray] = {
        "first_position": np.arange(1, m),
        "second_position": np.arange(2, m + 1),
        f"first_target_{position}": result.target[:-1],
        f"second_target_{position}": result.target[1:],
    }
    for key in keys:
        for found, name in zip(result.approaches, APPROACHES, strict=True):
            values = np.full(m - 1, np.nan) if found is None else getattr(found, key)
            named[f"{key}_{name}" + (f"_{unit}" if key != "s_ratio" else "")] = values
    return _columns(named)


def deviation_chart_numbers(report: PositioningReport) -> NumberTable:
    """Return the deviation chart and the half width of its bounds."""
    result, (position, unit) = adjacent_of(report), _suffixes(report)
    named = {f"target_{position}": result.target}
    absent = np.full(result.target.size, np.nan)
    for found, name in zip(result.approaches, APPROACHES, strict=True):
        named[f"chart_{name}_{unit}"] = absent if found is None else found.chart
        named[f"bound_{name}_{unit}"] = absent if found is None else found.bound
    return _columns(named)


def against_cycles_numbers(report: PositioningReport) -> NumberTable:
    """Return the figures against the number of cycles used."""
    against = report.against_cycles
    assert against is not None  # noqa: S101 - asked for only then
    _, unit = _suffixes(report)
    named: dict[str, FloatArray | IntArray] = {"cycles": _counts(against.cycles)}
    named |= {f"{key}_{unit}": against.figures[key] for key in FIGURE_KEYS}
    for approach, name in enumerate(APPROACHES):
        named[f"s_rms_{name}_{unit}"] = against.s_rms[:, approach]
        named[f"difference_rms_{name}_{unit}"] = against.difference_rms[:, approach]
    return _columns(named)


def montecarlo_numbers(result: DifferenceMonteCarlo) -> NumberTable:
    """Return the histograms of the source and of the derived sequence."""
    edges = result.histogram_edges
    return _columns(
        {
            "class_from": edges[:-1],
            "class_to": edges[1:],
            "source_count": _counts(result.source_counts),
            "derived_count": _counts(result.derived_counts),
        },
        decimals=None,  # classes are as wide as the sigma that was asked for
    )
