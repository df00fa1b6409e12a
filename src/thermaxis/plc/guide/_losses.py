"""The part of the guide that says what is lost, what follows at once, and after how long what."""

from collections.abc import Iterator
from dataclasses import asdict

from thermaxis.compensation import LONGEST_REST, STATED, SensorRules
from thermaxis.plc._names import remark_text
from thermaxis.plc._numbers import figure
from thermaxis.plc._settings import CYCLE_TOLERANCE, PlcSettings
from thermaxis.plc._texts import page


def losses_text(settings: PlcSettings) -> Iterator[str]:
    """Return the lines of the tables."""
    compensation = settings.compensation
    model, rules = compensation.model, compensation.supervisor
    timeout_s, cycle_s = rules.input_timeout_s, settings.cycle_s
    bridged = (
        f", so the {figure(timeout_s)} s that bridge a lost temperature are over in its first"
        f" call, which lasts {figure(cycle_s)} s"
    )
    outputs = zip(model.outputs, compensation.bounds, settings.steps_um, strict=True)
    channels = zip(compensation.judged, compensation.rules, strict=True)
    return page(
        "losses",
        **_figures(asdict(rules)),
        bridged=bridged if timeout_s < cycle_s else "",
        bridged_and_held_s=figure(timeout_s + rules.hold_input_s),
        gap_s=figure(model.longest_gap_s),
        longest_hold_s=figure(model.longest_hold_s),
        heals=f"by itself, once everything is there for {figure(rules.recovery_delay_s)} s",
        percent=round(100 * CYCLE_TOLERANCE),
        interlock_fades=rules.hold_interlock_s == 0.0,
        stated=model.reference == STATED,
        output=[
            {
                "text": remark_text(output.name),
                "fade_s": figure(bounds.total_um / bounds.largest_rate_um_per_s),
                "largest_rate_um_per_s": figure(bounds.largest_rate_um_per_s),
                "step_um": figure(step_um),
            }
            for output, bounds, step_um in outputs
        ],
        channel=[
            {
                "text": remark_text(channel),
                **_figures(asdict(rule)),
                "frozen": _frozen(rule),
            }
            for channel, rule in channels
        ],
    )


def _frozen(rule: SensorRules) -> str:
    if not rule.frozen_s:
        return "never"
    if not rule.moves_with:
        return figure(rule.frozen_s)
    longer = figure(LONGEST_REST * rule.frozen_s)
    other = remark_text(rule.moves_with)
    return f"{figure(rule.frozen_s)}; {longer} while {other} moves less than {rule.rests_k:g} K"


def _figures(values: dict[str, object]) -> dict[str, object]:
    return {k: figure(v) for k, v in values.items() if isinstance(v, int | float)}
