"""Axes over the years: the figures of positioning runs, and what of them changes for good.

Runs of one axis that measured the same part of it as the newest one are compared. A figure changes
steadily (straight line over the years) or at once (two levels, the best of all places): what is
less likely by chance is named, if it is less likely than `LEVEL`, all figures and places counted.
The variance is that of the runs about line or levels, and never less than their own uncertainty
makes: with few runs that seem to agree by chance nothing is named.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from itertools import groupby
from typing import Any, Final, final

import numpy as np

from thermaxis.codes import Message, message_as_json, value_of_json
from thermaxis.positioning import FIGURE_KEYS, Finding, PositioningTest, diagnose
from thermaxis.positioning.drift import special
from thermaxis.quantities import AxisKind
from thermaxis.report.trend import (
    TrendChange,
    TrendFigure,
    air_differs,
    change_of,
    evaluate_trend,
    mean_air_c,
    shown_figures,
)

LEVEL: Final = 0.01
"""What is less likely by chance is named: own choice. [1]"""
_COVERAGE: Final = 0.95
_FEWEST: Final = 3
_YEAR: Final = timedelta(days=365.25)
_NO_FAULTS: Final = frozenset({"drift_reversal", "temperature_channel", "hidden_period"})
"""Findings on the thermal state of a run and on its targets."""
_PLAIN = (
    *("axis", "name", "sha256", "kind", "targets"),
    *("first_target", "last_target", "cycles", "air_c"),
)


@final
@dataclass(frozen=True, slots=True)
class AxisRun:
    """A positioning run of a machine's axis, as the registry keeps it."""

    machine: str
    """Name of the machine."""
    axis: str
    """Name of the axis."""
    name: str
    """Name of the file."""
    sha256: str
    """SHA-256 of the file."""
    start: datetime
    """Start of the first reading, to the minute; without a zone it is taken as UTC."""
    kind: str
    """``linear`` (mm, µm) or ``rotary`` (deg, arcsec)."""
    targets: int
    """Number of targets. [1]"""
    first_target: float
    """First target. [mm or deg]"""
    last_target: float
    """Last target. [mm or deg]"""
    cycles: int
    """Number of cycles. [1]"""
    air_c: float | None
    """Mean temperature of the air at start and end; None if not stated. [°C]"""
    measured: Mapping[str, TrendFigure]
    """Figures of ISO 230-2 as measured, by key. [µm or arcsec]"""
    drift_free: Mapping[str, TrendFigure]
    """Figures without drift, by key; empty if the drift is not known. [µm or arcsec]"""
    findings: tuple[Finding, ...] = ()
    """What the diagnosis has found, faults of the axis first."""


@final
@dataclass(frozen=True, slots=True)
class AxisChange:
    """How a figure changes over the runs of an axis; None with fewer than three runs."""

    ends: TrendChange
    """From the first run to the last."""
    per_year: float | None = None
    """Slope of the straight line. [µm or arcsec per year]"""
    per_year_low: float | None = None
    """Its interval of 95 %, from. [µm or arcsec per year]"""
    per_year_high: float | None = None
    """To. [µm or arcsec per year]"""
    per_year_p_value: float | None = None
    """Probability of so much by chance. [1]"""
    step: float | None = None
    """The likeliest step: mean from a run on minus mean before it. [µm or arcsec]"""
    step_at: datetime | None = None
    """Start of that run."""
    step_p_value: float | None = None
    """Probability of so much by chance at any run. [1]"""


@final
@dataclass(frozen=True, slots=True)
class AxisTrend:
    """An axis over the years."""

    axis: str
    """Its name."""
    kind: str
    """``linear`` or ``rotary``."""
    runs: tuple[AxisRun, ...]
    """Runs that are compared, in the order of time; the last one is the newest."""
    apart: tuple[AxisRun, ...]
    """Runs of another part of the axis than the newest one's, which are not compared."""
    changes: tuple[AxisChange, ...]
    """Changes of the shown figures; empty with one run."""
    remarks: tuple[Message, ...]
    """What is named: a steady change, a step, a fault that the newest run is the first to show; and
    what makes the runs hard to compare."""


def axis_run(
    machine: str, axis: str, test: PositioningTest, start: datetime, name: str, sha256: str
) -> AxisRun:
    """Evaluate a positioning run for the registry.

    Parameters
    ----------
    machine : str
        Name of the machine.
    axis : str
        Name of the axis.
    test : PositioningTest
        The run.
    start : datetime
        Its start.
    name : str
        Name of its file.
    sha256 : str
        Hash of its file.

    Returns
    -------
    AxisRun
        Its figures, with and without drift, and findings.

    Raises
    ------
    DataError
        If it cannot be evaluated.
    """
    run = evaluate_trend([(name, test)]).runs[0]
    aware = start.replace(tzinfo=UTC) if start.tzinfo is None else start.astimezone(UTC)
    return AxisRun(
        machine=machine,
        axis=axis,
        name=name,
        sha256=sha256,
        start=aware.replace(second=0, microsecond=0),
        kind=str(test.kind),
        targets=int(test.target.size),
        first_target=float(test.target[0]),
        last_target=float(test.target[-1]),
        cycles=test.cycles,
        air_c=mean_air_c(test),
        measured=run.measured,
        drift_free=run.drift_free,
        findings=diagnose(test, run.drift),
    )


def axis_run_as_json(run: AxisRun) -> dict[str, Any]:
    """Return a run as JSON has it, and the registry keeps it."""
    return {
        **{key: getattr(run, key) for key in _PLAIN},
        "start": run.start.isoformat(),
        **_by_key(run.measured),
        "drift": _by_key(run.drift_free) if run.drift_free else None,
        "findings": [
            {key: getattr(one, key) for key in ("finding", "value", "unit", "p_value")}
            | {"message": message_as_json(one.message)}
            for one in run.findings
        ],
    }


def _by_key(figures: Mapping[str, TrendFigure]) -> dict[str, object]:
    values = {key: getattr(figures.get(key), "value", None) for key in FIGURE_KEYS}
    stated = {key: getattr(figures.get(key), "expanded_uncertainty", None) for key in FIGURE_KEYS}
    return {"iso230_2": values, "uncertainty": stated}


def _figures(side: Mapping[str, Any]) -> dict[str, TrendFigure]:
    values, stated = side["iso230_2"], side["uncertainty"]
    return {k: TrendFigure(values[k], stated[k]) for k in FIGURE_KEYS if values[k] is not None}


def axis_run_of_json(machine: str, content: Mapping[str, Any]) -> AxisRun:
    """Return the run of a machine that `axis_run_as_json` has written."""
    findings: list[Any] = [
        {**one, "message": value_of_json(one["message"])} for one in content["findings"]
    ]
    return AxisRun(
        **{key: content[key] for key in _PLAIN},
        machine=machine,
        start=datetime.fromisoformat(content["start"]),
        measured=_figures(content),
        drift_free=_figures(content["drift"]) if content["drift"] else {},
        findings=tuple(Finding(**one) for one in findings),
    )


def axis_trends(runs: Sequence[AxisRun]) -> tuple[AxisTrend, ...]:
    """Compare the runs of each axis of a machine.

    Parameters
    ----------
    runs : sequence of AxisRun
        Runs of one machine, in any order.

    Returns
    -------
    tuple of AxisTrend
        One for each axis, by name. Linear and rotary runs of one name are two axes.
    """
    ordered = sorted(runs, key=lambda run: (run.axis, run.kind, run.start))
    return tuple(
        _trend(tuple(group)) for _, group in groupby(ordered, lambda run: (run.axis, run.kind))
    )


def _trend(every: tuple[AxisRun, ...]) -> AxisTrend:
    newest = every[-1]
    interval = (newest.last_target - newest.first_target) / max(newest.targets - 1, 1)

    def same_part(run: AxisRun) -> bool:
        ends = (run.first_target - newest.first_target, run.last_target - newest.last_target)
        return max(map(abs, ends)) <= interval

    runs = tuple(run for run in every if same_part(run))
    apart = tuple(run for run in every if not same_part(run))
    sides = [(run.measured, run.drift_free) for run in runs]
    ends = [one for key in shown_figures(sides) if (one := change_of(sides, key)) is not None]
    changes = tuple(_change(runs, one) for one in ends)
    remarks = [said for one in changes if (said := _named(one, len(changes), newest))]
    if apart:
        names = tuple(run.name for run in apart)
        remarks.append(Message("warning-other_part", {"runs": names, "reference": newest.name}))
    remarks += _new_faults(runs)
    remarks += air_differs({run.name: run.air_c for run in runs if run.air_c is not None})
    return AxisTrend(newest.axis, newest.kind, runs, apart, changes, tuple(remarks))


def _change(runs: Sequence[AxisRun], ends: TrendChange) -> AxisChange:
    """Fit a line, and levels before and after each run, to the figure that both ends have."""
    sides = [run.drift_free if ends.drift_free else run.measured for run in runs]
    known = [(run.start, s[ends.key]) for run, s in zip(runs, sides, strict=True) if ends.key in s]
    starts, n = [start for start, _ in known], len(known)
    years = np.array([(start - starts[0]) / _YEAR for start in starts])
    if n < _FEWEST or years[-1] == 0.0:
        return AxisChange(ends)
    value = np.array([one.value for _, one in known])
    stated = [one.expanded_uncertainty or 0.0 for _, one in known]
    least = float(np.mean(np.square(stated))) / 4.0  # U is twice the standard uncertainty

    def fitted(shape: np.ndarray) -> tuple[float, float, float]:
        """Return the weight of a shape, its standard uncertainty and its p-value."""
        centred = shape - np.mean(shape)
        squares = float(centred @ centred)
        weight = float(centred @ value) / squares
        left = value - np.mean(value) - weight * centred
        std = math.sqrt(max(float(left @ left) / (n - 2), least) / squares)
        p = 2.0 * float(special().stdtr(n - 2, -abs(weight) / std)) if std > 0.0 else 1.0
        return weight, std, p

    slope, std, p = fitted(years)
    half = std * float(special().stdtrit(n - 2, 0.5 + 0.5 * _COVERAGE))
    tried = [(fitted((np.arange(n) >= k).astype(float)), k) for k in range(1, n)]
    (size, _, step_p), k = min(tried, key=lambda one: one[0][2])
    step_p = min(1.0, step_p * (n - 1))
    return AxisChange(ends, slope, slope - half, slope + half, p, size, starts[k], step_p)


def _named(change: AxisChange, figures: int, newest: AxisRun) -> Message | None:
    """Name the likelier one of line and step, where chance hardly makes it."""
    line_p, step_p = change.per_year_p_value, change.step_p_value
    if line_p is None or step_p is None or min(step_p, line_p) * figures >= LEVEL:
        return None
    values: dict[str, Any] = {"axis": newest.axis, "figure": change.ends.key}
    values |= {"unit": AxisKind(newest.kind).units.deviation}
    if step_p < line_p:
        start = f"{change.step_at:%Y-%m-%d}"
        return Message("axis-step", values | {"size": change.step, "start": start})
    interval = {"low": change.per_year_low, "high": change.per_year_high}
    return Message("axis-slope", values | {"per_year": change.per_year, **interval})


def _new_faults(runs: Sequence[AxisRun]) -> list[Message]:
    """Return the faults of the newest run that none before it has shown at its place."""
    if len(runs) < 2:
        return []
    *before, newest = [
        {(one.finding, one.message.values.get("position")): one.message for one in run.findings}
        for run in runs
    ]
    known = {fault for found in before for fault in found}
    return [
        Message("axis-new_fault", {"axis": runs[-1].axis, "name": runs[-1].name, "fault": message})
        for fault, message in newest.items()
        if fault not in known and fault[0] not in _NO_FAULTS
    ]
