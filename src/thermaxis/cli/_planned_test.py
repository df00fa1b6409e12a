"""What a planned thermal test has reached, by a log: asked after it and while it is recorded."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from numpy.linalg import LinAlgError

from thermaxis import files, thermal
from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError, ThermaxisError, require_known
from thermaxis.thermal import GainsPrior, HeatingConditions, ReachedTest, ThermalTestPlan


def reached_by(
    conditions: HeatingConditions, prior: GainsPrior, log: thermal.ThermalLog
) -> ReachedTest:
    """Return what a log of a test has reached."""
    records = thermal.records_of([log], _inputs_of(conditions), [conditions.output])
    return thermal.reached(conditions, prior, records.experiments[conditions.output][0])


def check_recorded(conditions: HeatingConditions, names: Iterable[str]) -> None:
    """Refuse channels of a recording that will not tell what the test has reached."""
    needed = {name for one in _inputs_of(conditions) for name in (one.plus, one.minus) if name}
    there = {name.casefold(): name for name in names}
    missing = sorted(n for n in {conditions.output, *needed} if n.casefold() not in there)
    require_known("--plan", missing, there.values())


def _inputs_of(conditions: HeatingConditions) -> list[thermal.InputDefinition]:
    """Return what tells in a log what the sources did; refuse sources of which nothing does."""
    for name, source in conditions.sources.items():
        if not source.input:
            raise ConfigurationError("missing_key", key=f"sources.{name}.input")
    return [thermal.parse_input(f"{n}={s.input}") for n, s in conditions.sources.items()]


def told_of_plan(plan: ThermalTestPlan, logs: Sequence[Path]) -> Message | None:
    """Return what the log of a test has reached so far; None before its first block."""
    if len(logs) != 1:
        return Message("recording-plan_over_files") if logs else None
    try:
        log = files.read_thermal_log(logs[0])
        time_s = float(log.time_s[-1] - log.time_s[0])
        foreseen_um = plan.foreseen_at_um(time_s)
        if foreseen_um is None:
            return None
        found = reached_by(plan.conditions, plan.knowledge.prior, log)
    except (ThermaxisError, LinAlgError) as error:
        cause = error.message if isinstance(error, ThermaxisError) else str(error)
        return Message("recording-plan_unread", {"cause": cause})
    enough = found.uncertainty_um <= (plan.conditions.enough_um or 0.0)
    values = {
        "time_h": time_s / 3600.0,
        "reached_um": found.uncertainty_um,
        "foreseen_um": foreseen_um,
        "left_h": max(plan.duration_s - time_s, 0.0) / 3600.0,
    }
    return Message("recording-plan_enough" if enough else "recording-plan_reached", values)
