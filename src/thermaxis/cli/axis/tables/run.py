"""A measured run as ``correct`` and ``check-table`` need it: readings, axis, drift."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

import numpy as np

from thermaxis.cli.axis.tables.control import axis_name, is_axis_name
from thermaxis.codes import NOWHERE, printable
from thermaxis.errors import DataError
from thermaxis.files import read_positioning_with_sha256
from thermaxis.positioning import (
    FIGURE_KEYS,
    CorrectionEffect,
    DriftResult,
    Edition,
    FloatArray,
    Iso230_2Figures,
    PositioningTest,
    evaluate_correction,
    evaluate_drift,
    figures_by_key,
    is_single_run_axis,
)
from thermaxis.quantities import AxisKind

EDITION = Edition.E2014
"""Edition whose names the figures carry, the default of ``evaluate``."""
NO_DRIFT_ASKED = "--no-drift leaves the drift model out"
"""Why a run has no drift result where none was asked for."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class AxisRun:
    """A measured run and what was found about it."""

    name: str
    """Its file."""
    sha256: str
    """Hash of that file."""
    test: PositioningTest
    """The run."""
    axis: str
    """Name of the axis on the control."""
    axis_assumed: bool
    """Whether nobody stated the name."""
    drift: DriftResult | None
    """Its drift, None where that cannot be told from the levels."""
    why_no_drift: str
    """Why it cannot, in words; empty if it can."""
    axis_refused: str = ""
    """What the file states as the axis, if that is no name of one; empty otherwise."""


def read_run(path: Path, *, axis: str | None, encoding: str) -> AxisRun:
    """Read a run; its drift is not looked for yet."""
    test, sha256 = read_positioning_with_sha256(path, fallback_encoding=encoding)
    stated = test.header.get("axis", "").strip() if axis is None else axis_name(axis)
    assumed, refused = not is_axis_name(stated), ""
    if assumed:
        refused, stated = stated, "X" if test.kind is AxisKind.LINEAR else "C"
    return AxisRun(str(path), sha256, test, stated, assumed, None, NO_DRIFT_ASKED, refused)


def with_drift(run: AxisRun, *, reference_time_s: float | None = None) -> AxisRun:
    """Return a run with its drift, which takes a minute for some thousand readings."""
    try:
        drift = evaluate_drift(run.test, reference_time_s=reference_time_s)
    except DataError as error:
        return replace(run, drift=None, why_no_drift=str(error.at(NOWHERE)))
    return replace(run, drift=drift, why_no_drift="")


def axis_warning(run: AxisRun) -> str:
    """Return what is said where the name of the axis was assumed."""
    if not run.axis_assumed:
        return ""
    if run.axis_refused:
        return (
            f"the run names its axis '{printable(run.axis_refused, 60)}', which is no name of an"
            f" axis on a control: {run.axis} was assumed. Check it, or give --axis"
        )
    return f"neither the run nor --axis names the axis: {run.axis} was assumed. Check it"


def run_in_words(run: AxisRun) -> str:
    """Return one line about a run."""
    test = run.test
    unit = test.kind.units.position
    sides = "unidirectional" if test.unidirectional else "bidirectional"
    return (
        f"{printable(run.name)}: {test.kind} axis, {test.target.size} targets from"
        f" {test.target[0]:.9g} to {test.target[-1]:.9g} {unit}, {test.cycles} cycles, {sides}"
    )


def temperature_in_words(test: PositioningTest) -> str:
    """Return the temperatures of a run, which a table belongs to."""
    said: list[str] = []
    for key, value in test.environment.items():
        ends = [f"{end:g}" for end in (value.start, value.end) if end is not None]
        if key.endswith("_c") and ends:
            name = printable(key.removesuffix("_c").replace("_", " "), 40)
            said.append(f"{name} {' to '.join(dict.fromkeys(ends))} °C")
    return ", ".join(said) if said else "its file states none"


def drift_in_words(run: AxisRun) -> str:
    """Return how far a run drifts."""
    drift, units = run.drift, run.test.kind.units
    if drift is None or not drift.significant:
        return ""
    growth = round(drift.total_per_m, 1) + 0.0  # no minus before zero
    return (
        f"the run drifts, by {drift.total:+.2f} {units.deviation} in common and {growth:+.1f}"
        f" {units.deviation} per 1000 {units.position} of length"
    )


def simulated_without_drift(run: AxisRun, correction: FloatArray) -> CorrectionEffect | None:
    """Return what corrections make of the readings without drift."""
    if run.drift is None or not run.drift.significant:
        return None
    return evaluate_correction(replace(run.test, deviation=run.drift.deviation), correction)


def shown_figures(test: PositioningTest, figures: Iso230_2Figures) -> dict[str, float | None]:
    """Return figures as ``evaluate`` shows them.

    References
    ----------
    GOST ISO 230-2-2016 (ISO 230-2:2014), clause 6.2.
    """
    values = figures_by_key(figures)
    if is_single_run_axis(test):
        values |= {key: None for key in FIGURE_KEYS if key[0] in "RA"}
    return values


def absent_in_words(test: PositioningTest) -> str:
    """Return which figures a run cannot have, and why."""
    if is_single_run_axis(test):
        return "R, A: absent, the axis is longer than 2000 mm: one run per direction is the rule"
    forward, backward = test.measured_approaches
    if not (forward and backward):
        side = "forward" if forward else "backward"
        return f"B, M, E, R, A of both directions: absent, measured {side} only"
    return "R, A: absent, too few readings" if test.cycles < 2 else ""


def systematic_range(level: FloatArray) -> float:
    """Return the range of mean deviations by which tables are compared.

    References
    ----------
    ISO 230-2:2014, clause 3 (bidirectional systematic deviation).
    """
    return float(np.nanmax(level) - np.nanmin(level))
