"""The result of ``plan`` as text for a terminal and as JSON."""

import textwrap
from dataclasses import dataclass
from typing import final

from thermaxis import __version__
from thermaxis.cli._text_table import text_table
from thermaxis.errors import printable
from thermaxis.files import plan_as_json, plan_sha256
from thermaxis.positioning import (
    FORWARD,
    LEVEL_KEY,
    Cycle,
    Duration,
    ExpectedUncertainty,
    RunAssumptions,
    ShortestPlan,
    SimulatedUncertainty,
    TestPlan,
)

_DISAGREEMENT = 1.5
"""Simulated and foretold uncertainty differ noteworthily beyond this factor. [1]"""
_PAPER_CYCLES, _PAPER_TARGETS, _PAPER_HOURS = 100, 16, 7.0
_PAPER_LENGTH_MM, _PAPER_FEED_MM_PER_MIN, _PAPER_DWELL_S = 300.0, 300.0, 2.0


@final
@dataclass(frozen=True, slots=True, eq=False)
class PlanResult:
    """A plan with everything that was worked out for it."""

    plan: TestPlan
    """The plan."""
    remarks: tuple[str, ...]
    """What was adjusted when the targets were chosen, in words."""
    warnings: tuple[str, ...]
    """Rules that the plan does not meet, in words."""
    duration: Duration
    """How long it takes."""
    assumptions: RunAssumptions
    """What is assumed of the axis."""
    assumed: tuple[str, ...]
    """Names of those assumptions that nobody stated."""
    expected: ExpectedUncertainty | None
    """What uncertainty it will reach, None if that cannot be foretold."""
    simulated: SimulatedUncertainty | None
    """The same from simulated runs, None if none were made."""
    reason: str | None
    """Why nothing can be foretold, in words."""
    search: ShortestPlan | None
    """The search for the number of cycles, None if they were stated."""
    target_uncertainty: float | None
    """What was searched for. [µm or arcsec]"""
    target_figure: str
    """Of which figure, or of the levels."""


# ---- text ---------------------------------------------------------------------------------------


def as_text(result: PlanResult, output: str | None) -> str:
    """Return the result in words and tables, for a terminal."""
    parts = [_head(result, output), _targets(result.plan), _duration(result)]
    parts.append(_uncertainty(result))
    said = [f"remark: {printable(remark, 400)}" for remark in result.remarks]
    said += [f"warning: {printable(warning, 400)}" for warning in _all_warnings(result)]
    if said:
        parts.append("\n".join(said) + "\n")
    return "\n".join(parts)


def _all_warnings(result: PlanResult) -> tuple[str, ...]:
    expected, simulated = result.expected, result.simulated
    if expected is None or simulated is None:
        return result.warnings
    unit = result.plan.kind.units.deviation
    error, stated = simulated.level_error, simulated.level_std
    said = list(result.warnings)
    if max(error, stated) > _DISAGREEMENT * expected.largest_level_std:
        said.append(
            f"simulated runs come to {max(error, stated):.3g} {unit} at the levels, not to the"
            f" {expected.largest_level_std:.3g} {unit} that the covariance foretells: in this order"
            " of visits drift and levels are hard to tell apart"
        )
    if error > _DISAGREEMENT * stated:
        said.append(
            f"in simulated runs the levels are wrong by {error:.3g} {unit} where the drift"
            f" evaluation states {stated:.3g} {unit}: in this order of visits a drift may pass for"
            " an error of the axis"
        )
    return tuple(said)


def _head(result: PlanResult, output: str | None) -> str:

    plan = result.plan
    unit = plan.kind.units.position
    side = "forward" if plan.approaches[0] == FORWARD else "backward"
    directions = "bidirectional" if len(plan.approaches) == 2 else f"unidirectional, {side}"
    name = f"{printable(output)}: " if output is not None else ""
    title = f", {printable(plan.title)}" if plan.title else ""
    lines = [
        f"{name}plan {plan_sha256(plan)}{title}",
        (
            f"{plan.kind} axis {plan.axis}, {plan.target.size} targets from {plan.target[0]:g} to"
            f" {plan.target[-1]:g} {unit}, {plan.cycles} {plan.cycle} cycles, {directions},"
            f" {plan.stops} stops"
        ),
        (
            f"interval {plan.interval:.6g} {unit}, random part ±{plan.random_part:.4g} {unit},"
            f" seed {plan.seed}; with the overrun the axis moves from {plan.lowest:.6g} to"
            f" {plan.highest:.6g} {unit}"
        ),
    ]
    search = result.search
    if search is not None and result.target_uncertainty is not None:
        lines.append(_found(result, search, result.target_uncertainty))
    return "\n".join(lines) + "\n"


def _found(result: PlanResult, search: ShortestPlan, wanted: float) -> str:
    unit = result.plan.kind.units.deviation
    cycles = search.plan.cycles
    of = "the levels" if result.target_figure == LEVEL_KEY else result.target_figure
    text = (
        f"{cycles} cycles are the fewest with a standard uncertainty of {of} of at most"
        f" {wanted:g} {unit}: {search.standard_uncertainty:.4g} {unit}"
    )
    fewer = search.tried.get(cycles - 1)
    return text if fewer is None else f"{text} ({cycles - 1} cycles: {fewer:.4g} {unit})"


def _filled(text: str) -> str:
    return textwrap.fill(text, 100, break_on_hyphens=False) + "\n"


def _targets(plan: TestPlan) -> str:
    rows: list[tuple[str, str, str]] = []
    for i, position in enumerate(plan.target.tolist()):
        step = "" if i == 0 else f"{position - float(plan.target[i - 1]):.3f}"
        rows.append((str(i + 1), f"{position:.3f}", step))
    unit = plan.kind.units.position
    return text_table(f"Targets by equation (1), {unit}", ("", "position", "from the last"), rows)


def _duration(result: PlanResult) -> str:
    plan, duration = result.plan, result.duration
    parts = (
        ("moves between targets", duration.moves_s),
        ("overrun", duration.overrun_s),
        ("dwell", duration.dwell_s),
        ("recording", duration.recording_s),
        ("total", duration.total_s),
    )
    rows = [(name, f"{s / 3600.0:.2f}", f"{s / 60.0:.1f}") for name, s in parts]
    table = text_table("Duration", ("part", "h", "min"), rows, words=1)
    more = plan.stops / 3600.0
    said = (
        "Motion at the feed, dwell and recording are counted; acceleration and the control's own"
        f" pauses are not. Every further second at a stop adds {more:.2g} h ({plan.stops}"
        " stops)."
    )
    return f"{table}\n{_filled(said + _beside_the_paper(plan, duration))}"


def _beside_the_paper(plan: TestPlan, duration: Duration) -> str:
    """Return why this is not the paper's time, where the plan is that of the paper's X axis."""
    length = float(plan.target[-1] - plan.target[0])
    same = (
        plan.kind.units.position == "mm"
        and plan.cycle is Cycle.STANDARD
        and (plan.target.size, plan.cycles) == (_PAPER_TARGETS, _PAPER_CYCLES)
        and abs(length - _PAPER_LENGTH_MM) <= 0.05 * _PAPER_LENGTH_MM
        and (plan.feed, plan.dwell_s) == (_PAPER_FEED_MM_PER_MIN, _PAPER_DWELL_S)
        and len(plan.approaches) == 2
    )
    missing_s = _PAPER_HOURS * 3600.0 - duration.total_s
    if not same or missing_s < 600.0:
        return ""
    return (
        f" The paper states about {_PAPER_HOURS:g} h for this run of its X axis. The remaining"
        f" {missing_s / 3600.0:.1f} h are {missing_s / plan.stops:.1f} s at each stop, which it"
        " does not explain; they fit a laser that averages for as long as the axis dwells"
        f" (--recording {_PAPER_DWELL_S:g})."
    )


def _assumption_words(result: PlanResult) -> str:
    unit = result.plan.kind.units.deviation
    a = result.assumptions

    def mark(name: str) -> str:
        return " (assumed)" if name in result.assumed else ""

    return (
        f"noise {a.noise:g} {unit}{mark('noise')}, drift {a.drift:g} {unit}{mark('drift')} with a"
        f" time constant of {a.time_constant_s / 3600.0:g} h{mark('time_constant_s')}"
    )


def _uncertainty(result: PlanResult) -> str:
    expected = result.expected
    if expected is None:
        return f"Expected uncertainty: none, {result.reason}\n"
    unit = result.plan.kind.units.deviation
    largest = expected.largest_level_std
    rows = [("level, largest", f"{largest:.3f}", f"{2.0 * largest:.3f}", "")]
    rows += [
        (
            key,
            f"{figure.standard_uncertainty:.3f}",
            f"{2.0 * figure.standard_uncertainty:.3f}",
            f"{figure.bias:+.3f}",
        )
        for key, figure in expected.figures.items()
    ]
    heads = ("without drift", "u", "U (k = 2)", "too large by")
    table = text_table(f"Expected uncertainty, {unit}", heads, rows, words=1)
    hours = expected.reference_time_s / 3600.0
    said = (
        f"For {_assumption_words(result)}; an axis with {result.assumptions.systematic:g} {unit} of"
        f" systematic error and {result.assumptions.reversal:g} {unit} of reversal. Instrument and"
        f" environment come on top. Levels hold for the mean time of the readings, {hours:.2f} h."
        f" Without any drift they would have {expected.mean_std:.3f} {unit}; in plain means the"
        f" assumed drift would leave errors of up to {expected.drift_in_means:.3g} {unit}."
    )
    simulated = result.simulated
    if simulated is not None:
        said += (
            f" {simulated.runs} simulated runs through the drift evaluation: error of the levels"
            f" {simulated.level_error:.3f} {unit}, stated {simulated.level_std:.3f} {unit}"
            " (root mean squares)."
        )
    return f"{table}\n{_filled(said)}"


# ---- JSON ---------------------------------------------------------------------------------------


def as_json(result: PlanResult) -> dict[str, object]:
    """Return the result with the keys of the command's JSON."""
    duration = result.duration
    search = result.search
    found: dict[str, object] | None = None
    if search is not None:
        found = {
            "target_uncertainty": result.target_uncertainty,
            "of": result.target_figure,
            "cycles": search.plan.cycles,
            "standard_uncertainty": search.standard_uncertainty,
            "tried": {str(cycles): value for cycles, value in search.tried.items()},
        }
    return {
        "plan": plan_as_json(result.plan),
        "stops": result.plan.stops,
        "lowest": result.plan.lowest,
        "highest": result.plan.highest,
        "duration_s": {
            "moves": duration.moves_s,
            "overrun": duration.overrun_s,
            "dwell": duration.dwell_s,
            "recording": duration.recording_s,
            "total": duration.total_s,
        },
        "assumptions": {
            "noise": result.assumptions.noise,
            "drift": result.assumptions.drift,
            "time_constant_s": result.assumptions.time_constant_s,
            "systematic": result.assumptions.systematic,
            "reversal": result.assumptions.reversal,
            "not_stated": list(result.assumed),
        },
        "expected": _expected_as_json(result),
        "search": found,
        "remarks": list(result.remarks),
        "warnings": list(_all_warnings(result)),
        "version": __version__,
    }


def _expected_as_json(result: PlanResult) -> dict[str, object] | None:
    expected, simulated = result.expected, result.simulated
    if expected is None:
        return None
    return {
        "reference_time_s": expected.reference_time_s,
        "largest_level_std": expected.largest_level_std,
        "levels_std_forward": _column(result, 0),
        "levels_std_backward": _column(result, 1),
        "figures": {
            key: {"standard_uncertainty": figure.standard_uncertainty, "bias": figure.bias}
            for key, figure in expected.figures.items()
        },
        "level_std_without_drift": expected.mean_std,
        "drift_left_in_means": expected.drift_in_means,
        "simulated": None
        if simulated is None
        else {
            "runs": simulated.runs,
            "level_error": simulated.level_error,
            "level_std": simulated.level_std,
        },
    }


def _column(result: PlanResult, approach: int) -> list[float] | None:
    if result.expected is None or approach not in result.plan.approaches:
        return None
    return result.expected.level_std[:, approach].tolist()
