"""The part of the guide that says what is lost, what follows at once, and after how long what."""

from collections.abc import Iterator
from typing import NamedTuple

from thermaxis.compensation import STATED, SupervisorRules
from thermaxis.plc._settings import CYCLE_TOLERANCE, PlcSettings
from thermaxis.plc.tree import figure, remark_text

_BY_ITSELF = "by itself"


class _Loss(NamedTuple):
    """A row of the table."""

    what: str
    at_once: str
    later: str
    back: str


def losses_text(settings: PlcSettings) -> Iterator[str]:
    """Yield the lines of the tables."""
    input_timeout_s, cycle_s = settings.compensation.supervisor.input_timeout_s, settings.cycle_s
    counted = "Times are counted in whole calls"
    if input_timeout_s < cycle_s:
        counted += (
            f", so the {figure(input_timeout_s)} s that bridge a lost temperature are over in its"
            f" first call, which lasts {figure(cycle_s)} s"
        )
    yield (
        "These are the numbers of this export. Nothing moves the correction faster than the rate."
        f" {counted}."
    )
    yield ""
    yield "| lost or wrong | at once | after how long what | how it comes back |"
    yield "|---|---|---|---|"
    for loss in (*_inputs(settings), *_machine(settings), *_people(settings), *_plc(settings)):
        yield f"| {loss.what} | {loss.at_once} | {loss.later} | {loss.back} |"
    yield ""
    yield from _moves(settings)
    yield ""
    yield "A temperature is believed within these rules:"
    yield ""
    yield "| temperature | plausible, degC | jump, K | and rate, K/s | frozen after, s |"
    yield "|---|---|---|---|---|"
    compensation = settings.compensation
    for channel, rules in zip(compensation.model.channels, compensation.rules, strict=True):
        frozen = figure(rules.frozen_s) if rules.frozen_s > 0.0 else "never"
        yield (
            f"| {remark_text(channel)} | {figure(rules.lowest_c)} to {figure(rules.highest_c)} |"
            f" {figure(rules.step_k)} | {figure(rules.largest_rate_k_per_s)} | {frozen} |"
        )


def _held(seconds: float, beyond: str = "") -> str:
    """Return what follows from a loss that is held for some time."""
    return f"Fading after {figure(seconds)} s{beyond}"


def _heals(rules: SupervisorRules) -> str:
    return f"{_BY_ITSELF}, once everything is there for {figure(rules.recovery_delay_s)} s"


def _inputs(settings: PlcSettings) -> Iterator[_Loss]:
    compensation = settings.compensation
    rules, hold_s = compensation.supervisor, compensation.model.longest_hold_s
    yield _Loss(
        "a temperature: `ok_` FALSE, no number, out of range, too fast, frozen",
        f"its last value counts on for {figure(rules.input_timeout_s)} s",
        f"then Holding; {_held(rules.input_timeout_s + rules.hold_input_s)} in all. The model"
        f" computes on with that value meanwhile, `model_quality` is 2 (bad)"
        f" after {figure(hold_s)} s",
        f"{_heals(rules)}; a jump by `reset` or when the value comes back, never by waiting",
    )
    percent = round(100 * CYCLE_TOLERANCE)
    yield _Loss(
        f"the call: {percent} percent too early or too late",
        "nothing advances, the correction stays",
        "as a lost temperature, a cycle each",
        _heals(rules),
    )


def _machine(settings: PlcSettings) -> Iterator[_Loss]:
    rules = settings.compensation.supervisor
    yield _Loss(
        "the connection: `connected` FALSE, or nothing read since then",
        "Holding, `linked` FALSE: write nothing",
        _held(rules.hold_connection_s, ", from what is found then"),
        f"the offset is read and taken over, then {_heals(rules)}",
    )
    fades = rules.hold_interlock_s == 0.0
    yield _Loss(
        "an interlock: `interlocks_met` FALSE",
        "Fading" if fades else "Holding",
        "zero at the rate" if fades else _held(rules.hold_interlock_s),
        _heals(rules),
    )
    yield _Loss(
        f"the read-back: away by more than {figure(rules.read_back_tolerance_um)} um, or"
        " `read_ok` FALSE",
        "nothing moves",
        f"Fault after {figure(rules.read_back_s)} s",
        "`reset` once it agrees, then `enable`",
    )
    yield _Loss(
        "the range: the model asks for more than the limit",
        "the correction stands at the limit",
        f"Fault after {figure(rules.at_limit_s)} s",
        "`reset`, then `enable`",
    )
    yield _Loss(
        "the only compensation: `other_compensation` TRUE",
        "Fault",
        "zero at the rate",
        "`reset` once it is FALSE, then `enable`",
    )
    yield _Loss(
        "any of these in turn, coming and going",
        "Holding",
        _held(rules.max_hold_s),
        _heals(rules),
    )


def _people(settings: PlcSettings) -> Iterator[_Loss]:
    rules = settings.compensation.supervisor
    yield _Loss(
        "a trim",
        "added within the limits; `added_...` says what is in force",
        f"expires after {figure(rules.longest_trim_s)} s and is taken back at the rate, **while"
        " its input keeps the value**",
        "another value of the input: first 0.0, then the value again",
    )
    yield _Loss(
        "the hold of an operator: `hold` TRUE",
        "Holding, or Warming where it was not Active yet; `held` is TRUE",
        f"{_held(rules.hold_operator_s)} although the switch stands; `held` stays TRUE",
        "`hold` FALSE",
    )


def _plc(settings: PlcSettings) -> Iterator[_Loss]:
    compensation = settings.compensation
    rules = compensation.supervisor
    yield _Loss(
        "the power of the PLC, or its program",
        "the offset stays as it is; trims, hold and `enable` are forgotten, whatever their inputs"
        " say; Off",
        f"after `enable` Active once the model has run for {figure(rules.settle_s)} s",
        "`enable` to FALSE and to TRUE; a trim by another value of its input; `hold` acts again"
        " once it is enabled",
    )
    if compensation.model.reference != STATED:
        yield _Loss(
            "the zero of the model: it counts from the first good reading after the start",
            "the reference of a temperature is that **one** reading",
            "what it was off by, such as one count of that sensor, is carried until the next"
            " restart, times the gains of section 6",
            "a restart",
        )


def _moves(settings: PlcSettings) -> Iterator[str]:
    compensation = settings.compensation
    for output, bounds, step_um in zip(
        compensation.model.outputs, compensation.bounds, settings.steps_um, strict=True
    ):
        fade_s = bounds.total_um / bounds.largest_rate_um_per_s
        yield (
            f"* {remark_text(output.name)}: Fading and Fault take at most {figure(fade_s)} s to"
            f" zero, at {figure(bounds.largest_rate_um_per_s)} um/s, which is at most"
            f" {figure(step_um)} um in one call."
        )
