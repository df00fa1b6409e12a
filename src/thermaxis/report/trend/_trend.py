"""One axis over the years: the figures of several runs, and whether they may be compared."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from types import MappingProxyType
from typing import TypeAlias, final

import numpy as np

from thermaxis.codes import Message, printable
from thermaxis.errors import DataError
from thermaxis.files.table import protected
from thermaxis.positioning import (
    FIGURE_KEYS,
    DriftResult,
    FigureUncertainty,
    Iso230_2Result,
    PositioningTest,
    check_test_conditions,
    evaluate_drift,
    evaluate_iso230_2,
    evaluate_uncertainty,
    figures_by_key,
)
from thermaxis.report._output import NumberTable
from thermaxis.report._progress import Progress

MAIN_FIGURES = ("B", "E", "R", "A")
"""Figures that tables and charts show; all others are in the CSV and the JSON."""
_WARM_K = 2.0
"""Runs whose air differs by more than this are hardly comparable: own choice. [K]"""
_SAME_POSITION = 0.01
"""Targets within this share of the mean interval count as the same: own choice. [1]"""


@final
@dataclass(frozen=True, slots=True)
class TrendFigure:
    """One figure of one run."""

    value: float
    """The figure. [µm or arcsec]"""
    expanded_uncertainty: float | None
    """Expanded uncertainty (95.45 %) from noise and drift; None if not known. [µm or arcsec]"""


RunFigures: TypeAlias = tuple[Mapping[str, TrendFigure], Mapping[str, TrendFigure]]
"""Figures of a run as measured and without drift, by key; absent ones are left out."""


@final
@dataclass(frozen=True, slots=True, eq=False)
class TrendRun:
    """One run of the trend."""

    name: str
    test: PositioningTest
    iso230_2: Iso230_2Result
    drift: DriftResult | None
    """Its drift; None if not asked for or not known."""
    measured: Mapping[str, TrendFigure]
    """Figures as measured, by key; absent ones are left out."""
    drift_free: Mapping[str, TrendFigure]
    """Figures without drift, by key; empty if the drift is not known."""


@final
@dataclass(frozen=True, slots=True)
class TrendChange:
    """How a figure changed from the first run to the last."""

    key: str
    drift_free: bool
    """Whether the figures without drift are compared, which both runs have."""
    change: float
    """Last minus first. [µm or arcsec]"""
    expanded_uncertainty: float | None
    """Of the change, root of the sum of squares of both (95.45 %); None if not known.
    [µm or arcsec]"""

    @property
    def significant(self) -> bool | None:
        """Whether the change is larger than its expanded uncertainty; None if not known."""
        if self.expanded_uncertainty is None:
            return None
        return abs(self.change) > self.expanded_uncertainty


@final
@dataclass(frozen=True, slots=True, eq=False)
class Trend:
    """Runs of one axis in the order of time."""

    runs: tuple[TrendRun, ...]
    dates: tuple[datetime, ...] | None
    """Their starts, naive or all in UTC; None if one is not stated: then the order is as given."""
    changes: tuple[TrendChange, ...]
    """Changes of the shown figures from the first run to the last."""
    warnings: tuple[Message, ...]
    """What the reader must know before comparing; what is of one run has its file as the place."""

    @property
    def figures(self) -> tuple[str, ...]:
        """Keys of the figures that tables and charts show."""
        return shown_figures([(run.measured, run.drift_free) for run in self.runs])


def shown_figures(runs: Sequence[RunFigures]) -> tuple[str, ...]:
    """Return the keys of the figures that tables and charts show of runs."""
    shown = [key for key in MAIN_FIGURES if any(key in measured for measured, _ in runs)]
    if "E" not in shown:  # every run is unidirectional
        one = [key for key in FIGURE_KEYS if key.endswith(("_forward", "_backward"))]
        shown = [key for key in one if any(key in measured for measured, _ in runs)]
    return tuple(shown)


def evaluate_trend(
    tests: Sequence[tuple[str, PositioningTest]],
    *,
    drift: bool = True,
    progress: Progress | None = None,
) -> Trend:
    """Evaluate runs of one axis and put them in the order of time.

    Parameters
    ----------
    tests : sequence of tuple
        Name of the file and run, one or more, in the order given.
    drift : bool
        Evaluate the figures without drift too. Default: yes.
    progress : callable, optional
        Called before each run and at the end.

    Returns
    -------
    Trend
        Sorted by start if every run states one, runs with the same start as given; otherwise in
        the order given, which the warnings say. Whatever makes the runs hard to compare stands in
        the warnings.

    Raises
    ------
    DataError
        If linear and rotary axes are mixed, or a run cannot be evaluated.
    """
    kinds = {test.kind for _, test in tests}
    if len(kinds) > 1:
        odd = next(name for name, test in tests if test.kind is not tests[0][1].kind)
        raise DataError("runs_of_two_kinds", file=odd)
    said: list[Message] = []
    runs: list[TrendRun] = []
    for done, (name, test) in enumerate(tests):
        if progress is not None:
            progress(f"run {name}", done, len(tests))
        run, own = _evaluate(name, test, with_drift=drift)
        runs.append(run)
        said += [replace(one, place=one.place._replace(file=name)) for one in own]
    if progress is not None:
        progress("runs", len(tests), len(tests))
    ordered, dates, remark = _in_order(runs)
    trend = Trend(tuple(ordered), dates, (), ())
    sides = [(run.measured, run.drift_free) for run in ordered]
    found = (change_of(sides, key) for key in trend.figures)
    changes = tuple(change for change in found if change is not None)
    warnings = (*remark, *_incomparable(ordered), *said)
    return Trend(tuple(ordered), dates, changes, warnings)


def _evaluate(
    name: str, test: PositioningTest, *, with_drift: bool
) -> tuple[TrendRun, list[Message]]:
    said = list(test.remarks)
    iso230_2 = evaluate_iso230_2(test)
    result: DriftResult | None = None
    if with_drift:
        try:
            result = evaluate_drift(test)
            said += result.warnings
        except DataError as error:
            said.append(Message("warning-no_drift_free_figures", {"cause": error.message}))
    uncertainty = evaluate_uncertainty(test, result)
    values = figures_by_key(iso230_2)
    free: dict[str, float | None] = {}
    if result is not None:
        known = figures_by_key(result.figures)
        free = {key: known[key] if values[key] is not None else None for key in FIGURE_KEYS}
    run = TrendRun(
        name=name,
        test=test,
        iso230_2=iso230_2,
        drift=result,
        measured=_with_uncertainty(values, uncertainty.measured),
        drift_free=_with_uncertainty(free, uncertainty.drift_free),
    )
    return run, said


def _value(number: float | None) -> float | None:
    return None if number is None or not math.isfinite(number) else float(number)


def _with_uncertainty(
    values: Mapping[str, float | None], uncertainty: FigureUncertainty | None
) -> Mapping[str, TrendFigure]:
    stated: Mapping[str, float] = {}
    if uncertainty is not None:
        stated = uncertainty.expanded_uncertainty
    return MappingProxyType(
        {
            key: TrendFigure(value, _value(stated.get(key)))
            for key, value in values.items()
            if value is not None
        }
    )


def _in_order(
    runs: Sequence[TrendRun],
) -> tuple[list[TrendRun], tuple[datetime, ...] | None, list[Message]]:
    without = tuple(run.name for run in runs if run.test.start is None)
    if without:
        warning = Message("warning-no_start_time", {"runs": without})
        return list(runs), None, [warning] if len(runs) > 1 else []
    starts = [run.test.start for run in runs if run.test.start is not None]
    aware = {start.tzinfo is not None for start in starts}
    said = [Message("warning-zones_mixed")] if len(aware) > 1 else []
    dates = [
        start if start.tzinfo is None else start.astimezone(UTC).replace(tzinfo=None)
        for start in starts
    ]
    order = sorted(range(len(runs)), key=lambda k: dates[k])
    return [runs[k] for k in order], tuple(dates[k] for k in order), said


def change_of(runs: Sequence[RunFigures], key: str) -> TrendChange | None:
    """Return how a figure changed from the first run to the last; None if one lacks it."""
    if len(runs) < 2:
        return None
    drift_free = all(key in free for _, free in (runs[0], runs[-1]))
    first, last = (run[drift_free].get(key) for run in (runs[0], runs[-1]))
    if first is None or last is None:
        return None
    both = (first.expanded_uncertainty, last.expanded_uncertainty)
    stated = None if None in both else math.hypot(*(u for u in both if u is not None))
    return TrendChange(key, drift_free, last.value - first.value, stated)


# ---- whether the runs may be compared -----------------------------------------------------------


def _incomparable(runs: Sequence[TrendRun]) -> list[Message]:
    """Say in what the runs differ that a comparison assumes to be the same."""
    if len(runs) < 2:
        return [Message("warning-one_run")]
    said = [
        Message(code, {"groups": groups})
        for code, label in _CONDITIONS.items()
        if len(groups := _groups(runs, label)) > 1
    ]
    said += _moved_targets(runs)
    unmet = tuple(run.name for run in runs if check_test_conditions(run.test))
    if unmet:
        said.append(Message("warning-conditions_not_met", {"runs": unmet}))
    means = ((run.name, mean_air_c(run.test)) for run in runs)
    return [*said, *air_differs({name: mean for name, mean in means if mean is not None})]


def _stated(field: str) -> Callable[[TrendRun], str]:
    return lambda run: " ".join(run.test.header.get(field, "").split())


def _approaches(run: TrendRun) -> str:
    forward, backward = run.test.measured_approaches
    return "both" if forward and backward else "forward only" if forward else "backward only"


def _rule(run: TrendRun) -> str:
    return "one run per direction" if run.iso230_2.single_run_rule else "all runs"


_Label: TypeAlias = Callable[[TrendRun], str]
_CONDITIONS: dict[str, _Label] = {
    "warning-machines_differ": _stated("machine"),
    "warning-serial_numbers_differ": _stated("serial_number"),
    "warning-axes_differ": _stated("axis"),
    "warning-target_counts_differ": lambda run: str(run.test.target.size),
    "warning-test_cycles_differ": lambda run: str(run.test.cycle),
    "warning-approaches_differ": _approaches,
    "warning-cycle_counts_differ": lambda run: str(run.test.cycles),
    "warning-rules_differ": _rule,
    "warning-time_sources_differ": lambda run: str(run.test.time_source),
}
"""What a comparison assumes to be the same, by the code of what is said if it is not."""


def _groups(runs: Sequence[TrendRun], label: _Label) -> tuple[str, ...]:
    """Return what runs state, each with the runs that state it."""
    groups: dict[str, list[str]] = {}
    for run in runs:
        text = label(run)
        if text:
            groups.setdefault(text, []).append(run.name)
    return tuple(f"{printable(text, 60)} ({', '.join(names)})" for text, names in groups.items())


def _moved_targets(runs: Sequence[TrendRun]) -> list[Message]:
    """Compare the measured range and the positions of every run with those of the first one."""
    first = runs[0].test.target
    if first.size < 2:
        return []
    interval = float(first[-1] - first[0]) / (first.size - 1)
    elsewhere: list[str] = []
    moved: list[str] = []
    for run in runs[1:]:
        target = run.test.target
        ends = np.abs(target[[0, -1]] - first[[0, -1]])
        if float(np.max(ends)) > interval:
            elsewhere.append(run.name)
        elif target.size == first.size:
            largest = float(np.max(np.abs(target - first)))
            moved += [run.name] if largest > _SAME_POSITION * interval else []
    return [
        Message(code, {"runs": tuple(names), "reference": runs[0].name})
        for code, names in (("warning-other_part", elsewhere), ("warning-targets_moved", moved))
        if names
    ]


def mean_air_c(test: PositioningTest) -> float | None:
    """Return the mean temperature of the air in a run, None if not stated. [°C]"""
    air = test.environment.get("air_temperature_c")
    known = [] if air is None else [v for v in (air.start, air.end) if v is not None]
    return sum(known) / len(known) if known else None


def air_differs(mean_c: Mapping[str, float]) -> list[Message]:
    """Warn where the air of runs [°C], by their names, differs too much to compare them."""
    if len(mean_c) < 2 or max(mean_c.values()) - min(mean_c.values()) <= _WARM_K:
        return []
    coldest, warmest = min(mean_c, key=lambda n: mean_c[n]), max(mean_c, key=lambda n: mean_c[n])
    values = {"difference_k": mean_c[warmest] - mean_c[coldest]}
    values |= {"coldest": coldest, "warmest": warmest}
    return [Message("warning-air_differs", values)]


# ---- as a table ---------------------------------------------------------------------------------


def trend_table(trend: Trend) -> NumberTable:
    """Return the trend as one row for each run, all figures with their uncertainties.

    Returns
    -------
    NumberTable
        Texts from files are guarded against being read as formulas.
    """
    units = trend.runs[0].test.kind.units
    unit, position = units.deviation_suffix, units.position_suffix
    columns = ["run", "start", "targets", f"first_{position}", f"last_{position}", "cycles"]
    columns += ["drift_model", f"drift_total_{unit}"]
    for suffix in ("", "_drift_free"):
        for key in FIGURE_KEYS:
            columns += [f"{key}{suffix}_{unit}", f"U_{key}{suffix}_{unit}"]
    rows = [_row(run) for run in trend.runs]
    return NumberTable(tuple(columns), rows)


def _row(run: TrendRun) -> list[float | int | str]:
    test, drift = run.test, run.drift
    row: list[float | int | str] = [
        protected(printable(run.name, 300)),
        "" if test.start is None else test.start.isoformat(),
        int(test.target.size),
        float(test.target[0]),
        float(test.target[-1]),
        test.cycles,
        "" if drift is None else str(drift.model),
        math.nan if drift is None else drift.total,
    ]
    for figures in (run.measured, run.drift_free):
        for key in FIGURE_KEYS:
            figure = figures.get(key)
            stated = None if figure is None else figure.expanded_uncertainty
            row += [
                math.nan if figure is None else figure.value,
                math.nan if stated is None else stated,
            ]
    return row
