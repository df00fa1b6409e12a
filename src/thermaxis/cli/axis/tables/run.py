"""A measured run as ``correct`` and ``check-table`` need it: readings, axis, drift."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

import numpy as np

from thermaxis import positioning
from thermaxis.cli._reading import Reading
from thermaxis.cli.axis.tables.control import axis_name, is_axis_name
from thermaxis.codes import NOWHERE, Message, Value, printable
from thermaxis.errors import DataError
from thermaxis.files import read_positioning_with_sha256
from thermaxis.quantities import AxisKind

EDITION = positioning.Edition.E2014
"""Edition whose names the figures carry, the default of ``evaluate``."""


def table_warning(code: str, **values: Value) -> Message:
    """Return what the user of a table must know: its sentence is ``warning-`` and the code."""
    return Message(f"warning-{code}", values)


@final
@dataclass(frozen=True, slots=True, eq=False)
class AxisRun:
    """A measured run and what was found about it."""

    name: str
    sha256: str
    test: positioning.PositioningTest
    axis: str
    """Name of the axis on the control."""
    axis_assumed: bool
    """Whether nobody stated the name."""
    drift: positioning.DriftResult | None
    """Its drift, None where that cannot be told from the levels."""
    why_no_drift: Message | None
    axis_refused: str = ""
    """What the file states as the axis, if that is no name of one; empty otherwise."""


def read_run(path: Path, *, axis: str | None, reading: Reading) -> AxisRun:
    """Read a run; its drift is not looked for yet."""
    test, sha256 = read_positioning_with_sha256(path, **reading)
    stated = test.header.get("axis", "").strip() if axis is None else axis_name(axis)
    assumed, refused = not is_axis_name(stated), ""
    if assumed:
        refused, stated = stated, "X" if test.kind is AxisKind.LINEAR else "C"
    unasked = table_warning("drift_left_out")
    return AxisRun(str(path), sha256, test, stated, assumed, None, unasked, refused)


def with_drift(run: AxisRun, *, reference_time_s: float | None = None) -> AxisRun:
    """Return a run with its drift, which takes a minute for some thousand readings."""
    try:
        drift = positioning.evaluate_drift(run.test, reference_time_s=reference_time_s)
    except DataError as error:
        return replace(run, drift=None, why_no_drift=error.at(NOWHERE).message)
    return replace(run, drift=drift, why_no_drift=None)


def run_in_words(run: AxisRun) -> str:
    """Return one line about a run."""
    test = run.test
    unit = test.kind.units.position
    sides = "unidirectional" if test.unidirectional else "bidirectional"
    return (
        f"{printable(run.name)}: {test.kind} axis, {test.target.size} targets from"
        f" {test.target[0]:.9g} to {test.target[-1]:.9g} {unit}, {test.cycles} cycles, {sides}"
    )


def temperature_in_words(test: positioning.PositioningTest) -> str:
    """Return the temperatures of a run, which a table belongs to."""
    said: list[str] = []
    for key, value in test.environment.items():
        ends = [f"{end:g}" for end in (value.start, value.end) if end is not None]
        if key.endswith("_c") and ends:
            name = printable(key.removesuffix("_c").replace("_", " "), 40)
            said.append(f"{name} {' to '.join(dict.fromkeys(ends))} °C")
    return ", ".join(said) if said else "its file states none"


def drift_warning(
    code: str, run: AxisRun, drift: positioning.DriftResult, **values: Value
) -> Message:
    """Return a warning that says how far a run drifts."""
    units, per_m = run.test.kind.units, round(drift.total_per_m, 1) + 0.0  # no minus before zero
    unit, position_unit = units.deviation, units.position
    return table_warning(
        code, total=drift.total, per_m=per_m, unit=unit, position_unit=position_unit, **values
    )


def simulated_without_drift(
    run: AxisRun, correction: positioning.FloatArray
) -> positioning.CorrectionEffect | None:
    """Return what corrections make of the readings without drift."""
    if run.drift is None or not run.drift.significant:
        return None
    return positioning.evaluate_correction(
        replace(run.test, deviation=run.drift.deviation), correction
    )


def shown_figures(
    test: positioning.PositioningTest, figures: positioning.Iso230_2Figures
) -> dict[str, float | None]:
    """Return figures as ``evaluate`` shows them.

    References
    ----------
    GOST ISO 230-2-2016 (ISO 230-2:2014), clause 6.2.
    """
    values = positioning.figures_by_key(figures)
    if positioning.is_single_run_axis(test):
        values |= {key: None for key in positioning.FIGURE_KEYS if key[0] in "RA"}
    return values


def absent_in_words(test: positioning.PositioningTest) -> str:
    """Return which figures a run cannot have, and why."""
    if positioning.is_single_run_axis(test):
        return "R, A: absent, the axis is longer than 2000 mm: one run per direction is the rule"
    forward, backward = test.measured_approaches
    if not (forward and backward):
        side = "forward" if forward else "backward"
        return f"B, M, E, R, A of both directions: absent, measured {side} only"
    return "R, A: absent, too few readings" if test.cycles < 2 else ""


def systematic_range(level: positioning.FloatArray) -> float:
    """Return the range of mean deviations by which tables are compared.

    References
    ----------
    ISO 230-2:2014, clause 3 (bidirectional systematic deviation).
    """
    return float(np.nanmax(level) - np.nanmin(level))
