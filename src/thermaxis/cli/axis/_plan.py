"""A plan: made from the arguments of ``plan``, and described for terminal and JSON."""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis import __version__
from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError
from thermaxis.files import plan_as_json, plan_sha256
from thermaxis.messages import sentence_of
from thermaxis.positioning import (
    APPROACHES,
    BACKWARD,
    FEWEST_CYCLES,
    FORWARD,
    LEVEL_KEY,
    LONGEST_RUN_S,
    Cycle,
    Duration,
    ExpectedUncertainty,
    RunAssumptions,
    ShortestPlan,
    SimulatedUncertainty,
    TargetChoice,
    TestPlan,
    check_plan,
    choose_targets,
    evaluate_duration,
    expected_uncertainty,
    shortest_plan,
    simulate_uncertainty,
    why_nothing_is_expected,
)
from thermaxis.quantities import AxisKind
from thermaxis.report.tables import Part, Section, Table, Value, messages_of, rows_of, values_of

DEFAULT_CYCLES = 5
_ASSUMED = ("noise", "drift", "time_constant_s", "systematic", "reversal")
_DISAGREEMENT = 1.5
"""Simulated and foretold uncertainty differ noteworthily beyond this factor. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class PlanResult:
    """A plan with everything that was worked out for it."""

    plan: TestPlan
    remarks: tuple[Message, ...]
    """What was adjusted when the targets were chosen."""
    warnings: tuple[Message, ...]
    """Rules that the plan does not meet."""
    duration: Duration
    assumptions: RunAssumptions
    """What is assumed of the axis."""
    assumed: tuple[str, ...]
    """Names of those assumptions that nobody stated."""
    expected: ExpectedUncertainty | None
    """What uncertainty it will reach, None if that cannot be foretold."""
    simulated: SimulatedUncertainty | None
    """The same from simulated runs, None if none were made."""
    reason: Message | None
    """Why nothing can be foretold."""
    search: ShortestPlan | None
    """The search for the number of cycles, None if they were stated."""
    arguments: argparse.Namespace


def make_plan(arguments: argparse.Namespace) -> PlanResult:
    """Make the plan that the arguments ask for, and work out what it takes and reaches."""
    choice = choose_targets(
        start=arguments.start,
        length=arguments.length,
        targets=arguments.targets,
        pitch=arguments.pitch,
        random_share=arguments.random_share,
        seed=arguments.seed,
    )
    hours: float | None = arguments.time_constant
    stated: dict[str, float | None] = {
        "noise": arguments.noise,
        "drift": arguments.drift,
        "time_constant_s": None if hours is None else 3600.0 * hours,
    }
    assumed = tuple(name for name, value in stated.items() if value is None)
    assumptions = RunAssumptions(**{k: v for k, v in stated.items() if v is not None})
    plan, search = _test_plan(arguments, choice), None
    if arguments.target_uncertainty is not None:
        search = _searched(arguments, plan, assumptions)
        plan = search.plan
    refused = why_nothing_is_expected(plan)
    return PlanResult(
        plan=plan,
        remarks=choice.remarks,
        warnings=check_plan(plan),
        duration=evaluate_duration(plan),
        assumptions=assumptions,
        assumed=assumed,
        expected=None if refused is not None else expected_uncertainty(plan, assumptions),
        simulated=simulate_uncertainty(plan, assumptions),
        reason=None if refused is None else refused.message,
        search=search,
        arguments=arguments,
    )


def _test_plan(arguments: argparse.Namespace, choice: TargetChoice) -> TestPlan:
    mode: str = arguments.mode
    side: str | None = arguments.approach_side
    if side is None and mode == "unidirectional":
        side = "forward"
    sides = {
        None: (FORWARD, BACKWARD),
        "forward": (FORWARD,),
        "backward": (BACKWARD,),
    }
    name = "C" if arguments.rotary else "X"
    return TestPlan(
        kind=AxisKind.ROTARY if arguments.rotary else AxisKind.LINEAR,
        axis=name if arguments.axis is None else arguments.axis,
        target=choice.target,
        cycles=DEFAULT_CYCLES if arguments.cycles is None else arguments.cycles,
        feed=arguments.feed,
        dwell_s=arguments.dwell,
        overrun=arguments.overrun,
        cycle=Cycle(mode) if mode in {"pilgrim", "step"} else Cycle.STANDARD,
        approaches=sides[side],
        recording_s=arguments.recording,
        pitch=arguments.pitch,
        interval=choice.interval,
        random_part=choice.random_part,
        seed=arguments.seed,
        title=arguments.title,
    )


def _searched(
    arguments: argparse.Namespace,
    plan: TestPlan,
    assumptions: RunAssumptions,
) -> ShortestPlan:
    wanted: float = arguments.target_uncertainty
    longest_s = LONGEST_RUN_S if arguments.longest is None else 3600.0 * arguments.longest
    found = shortest_plan(
        plan,
        wanted,
        assumptions,
        key=arguments.target_figure or LEVEL_KEY,
        fewest_cycles=DEFAULT_CYCLES if arguments.standard else FEWEST_CYCLES,
        longest_s=longest_s,
    )
    if not found.reached:
        raise ConfigurationError(
            "uncertainty_not_reached",
            key="--target-uncertainty",
            hours=longest_s / 3600.0,
            wanted=wanted,
            unit=plan.kind.units.deviation,
            cycles=found.plan.cycles,
            standard_uncertainty=found.standard_uncertainty,
        )
    return found


def described(result: PlanResult, output: str | None) -> list[Part]:
    """Return a plan for terminal and JSON."""
    plan, not_stated = result.plan, Value("not_stated", result.assumed)
    warnings = messages_of("warnings", _all_warnings(result), "warning")
    return [
        *_head(result, output),
        *_search(result),
        Value("plan", plan_as_json(plan)),
        *values_of(plan, "stops", "lowest", "highest"),
        _targets(plan),
        *_duration(result),
        Section("assumptions", [*values_of(result.assumptions, *_ASSUMED), not_stated]),
        *_uncertainty(result),
        Section("", [*messages_of("remarks", result.remarks, "remark"), *warnings]),
        Value("version", __version__),
    ]


def _all_warnings(result: PlanResult) -> tuple[Message, ...]:
    expected, simulated = result.expected, result.simulated
    if expected is None or simulated is None:
        return result.warnings
    unit, foretold = result.plan.kind.units.deviation, expected.largest_level_std
    error, stated = simulated.level_error, simulated.level_std
    warnings = list(result.warnings)
    if max(error, stated) > _DISAGREEMENT * foretold:
        values = {"simulated": max(error, stated), "foretold": foretold, "unit": unit}
        warnings.append(Message("warning-simulated_runs_worse", values))
    if error > _DISAGREEMENT * stated:
        values = {"error": error, "stated": stated, "unit": unit}
        warnings.append(Message("warning-simulated_levels_wrong", values))
    return tuple(warnings)


def _head(result: PlanResult, output: str | None) -> Iterator[str]:
    plan = result.plan
    unit = plan.kind.units.position
    side = "forward" if plan.approaches[0] == FORWARD else "backward"
    directions = "bidirectional" if len(plan.approaches) == 2 else f"unidirectional, {side}"
    yield _answer(result)
    name = f"{output}: " if output is not None else ""
    yield f"{name}plan {plan_sha256(plan)}{f', {plan.title}' if plan.title else ''}"
    yield (
        f"{plan.kind} axis {plan.axis}, {plan.target.size} targets from {plan.target[0]:g} to"
        f" {plan.target[-1]:g} {unit}, {plan.cycles} {plan.cycle} cycles, {directions},"
        f" {plan.stops} stops"
    )
    yield (
        f"interval {plan.interval:.6g} {unit}, random part ±{plan.random_part:.4g} {unit}, seed"
        f" {plan.seed}; with the overrun the axis moves from {plan.lowest:.6g} to"
        f" {plan.highest:.6g} {unit}"
    )


def _answer(result: PlanResult) -> str:
    plan, hours = result.plan, result.duration.total_s / 3600.0
    takes = f"the run of {plan.cycles} x {plan.target.size} targets takes {hours:.2f} h"
    if result.expected is None:
        return takes
    known = f"±{2.0 * result.expected.largest_level_std:.2g} {plan.kind.units.deviation} (k = 2)"
    return f"{takes}; without its drift every mean deviation is then known to {known}"


def _search(result: PlanResult) -> list[Part]:
    search, arguments = result.search, result.arguments
    if search is None:
        return [Value("search", None)]
    unit, cycles = result.plan.kind.units.deviation, search.plan.cycles
    figure = arguments.target_figure or LEVEL_KEY
    of = "the mean deviations" if figure == LEVEL_KEY else figure
    fewer = search.tried.get(cycles - 1)
    beside = "" if fewer is None else f" ({cycles - 1} cycles: {fewer:.4g} {unit})"
    values = [
        Value("target_uncertainty", arguments.target_uncertainty),
        Value("of", figure),
        Value("cycles", cycles),
        *values_of(search, "standard_uncertainty", "tried"),
    ]
    wanted, reached = arguments.target_uncertainty, search.standard_uncertainty
    found = (
        f"{cycles} cycles are the fewest with a standard uncertainty of {of} of at most"
        f" {wanted:g} {unit}: {reached:.4g} {unit}{beside}"
    )
    return [found, Section("search", values)]


def _targets(plan: TestPlan) -> Table:
    steps = ["", *(f"{step:.3f}" for step in np.diff(plan.target))]
    rows = rows_of(
        Value("", [str(i + 1) for i in range(plan.target.size)], ""),
        Value("", plan.target, "position", ".3f"),
        Value("", steps, "from the last"),
    )
    return Table(f"Targets by equation (1), {plan.kind.units.position}", rows)


def _duration(result: PlanResult) -> Iterator[Part]:
    plan, duration = result.plan, result.duration
    keys = ("moves", "overrun", "dwell", "recording", "total")
    seconds = {key: float(getattr(duration, f"{key}_s")) for key in keys}
    rows = [
        [Value("", key, "part"), Value("", s / 3600.0, "h", ".2f"), Value("", s / 60, "min", ".1f")]
        for key, s in seconds.items()
    ]
    yield Table("Duration", rows, words=1)
    yield Value("duration_s", seconds)
    yield (
        "Motion at the feed, dwell and recording are counted; acceleration and the control's own"
        f" pauses are not. Every further second at a stop adds {plan.stops / 3600.0:.2g} h"
        f" ({plan.stops} stops)."
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


def _uncertainty(result: PlanResult) -> Iterator[Part]:
    expected, simulated = result.expected, result.simulated
    if expected is None:
        yield Value("expected", None)
        reason = "" if result.reason is None else sentence_of(result.reason)
        yield Section("", [f"Expected uncertainty: none. {reason}"])
        return
    unit, approaches = result.plan.kind.units.deviation, result.plan.approaches
    rows = [_row("mean deviation, largest", expected.largest_level_std, "")]
    rows += [
        _row(key, figure.standard_uncertainty, f"{figure.bias:+.3f}")
        for key, figure in expected.figures.items()
    ]
    parts: list[Part] = [
        Table(f"Expected uncertainty, {unit}", rows, words=1),
        *values_of(expected, "reference_time_s", "largest_level_std"),
        *(
            Value(f"levels_std_{word}", expected.level_std[:, a] if a in approaches else None)
            for a, word in enumerate(APPROACHES)
        ),
        *(
            Value(f"figures.{key}.{name}", getattr(figure, name))
            for key, figure in expected.figures.items()
            for name in ("standard_uncertainty", "bias")
        ),
        Value("level_std_without_drift", expected.mean_std),
        Value("drift_left_in_means", expected.drift_in_means),
        Value("simulated", None),
    ]
    said = (
        f"For {_assumption_words(result)}; an axis with {result.assumptions.systematic:g} {unit} of"
        f" systematic error and {result.assumptions.reversal:g} {unit} of reversal. Instrument and"
        " environment come on top. They hold for the mean time of the readings,"
        f" {expected.reference_time_s / 3600.0:.2f} h. Without any drift they would have"
        f" {expected.mean_std:.3f} {unit}; in plain means the assumed drift would leave errors of"
        f" up to {expected.drift_in_means:.3g} {unit}."
    )
    if simulated is not None:
        said += (
            f" {simulated.runs} simulated runs through the drift evaluation: error of the mean"
            f" deviations {simulated.level_error:.3f} {unit}, stated {simulated.level_std:.3f}"
            f" {unit} (root mean squares)."
        )
        parts[-1] = Section("simulated", values_of(simulated, "runs", "level_error", "level_std"))
    yield Section("expected", [*parts, said])


def _row(name: str, u: float, bias: str) -> list[Value]:
    return [
        Value("", name, "without drift"),
        Value("", u, "u", ".3f"),
        Value("", 2.0 * u, "U (k = 2)", ".3f"),
        Value("", bias, "too large by"),
    ]
