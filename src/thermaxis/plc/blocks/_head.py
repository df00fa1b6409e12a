"""The lines at the top of a program: what it is, where it comes from, what its numbers mean."""

import re
import textwrap
from collections.abc import Iterator

from thermaxis import __version__
from thermaxis.compensation import (
    STATED,
    Outcome,
    Output,
    Part,
    Quality,
    Reason,
    SampleQuality,
    SupervisorState,
)
from thermaxis.messages import sentence
from thermaxis.plc._settings import CYCLE_TOLERANCE, PlcSettings
from thermaxis.plc.blocks._draft import numbered
from thermaxis.plc.blocks._warnings import never_corrects, setting_warnings
from thermaxis.plc.tree import noted, remark_text

WIDTH = 88
"""Longest line of the head. Origin: a line of 100 signs with the signs of a remark. [1]"""
MOST_FIGURES = 40
"""Figures of the identification that are listed. [1]"""


_REST = 3.0
_NEVER = " (never in a PLC)"
NEVER_OUTCOMES = frozenset(
    {
        Outcome.CLOCK_BACKWARD,
        Outcome.CLOCK_STILL,
        Outcome.GAP,
        Outcome.STATE_UNUSABLE,
        Outcome.DIAMETER_UNKNOWN,
    }
)
"""Outcomes that a block without a clock and without a memory never has."""
NEVER_QUALITIES = frozenset(
    {
        SampleQuality.REDUNDANT,
        SampleQuality.OLD,
        SampleQuality.NO_TIME_STAMP,
        SampleQuality.DISAGREES,
    }
)
"""Qualities of what a block has not: redundant sensors and time stamps."""


def head_of(settings: PlcSettings) -> tuple[str, ...]:
    """Return the head of a program."""
    paragraphs = (
        *_identity(settings),
        *_conventions(settings),
        *_model(settings),
        *_limits(settings),
        *_numbers(),
        *_not_protected(settings),
    )
    return tuple(line for paragraph in paragraphs for line in wrapped(paragraph))


def restart_warning(settings: PlcSettings) -> str:
    """Return what a restart of a warm machine does to a model that counts from its start."""
    model = settings.compensation.model
    if model.reference == STATED:
        return ""
    if all(map(never_corrects, model.outputs)):
        return ""
    parts = [part for output in model.outputs for part in output.parts]
    slowest_s = model.input_filter_s + max(
        [0.0, *(s.time_constant_s for part in parts for s in part.sections if s.gain_um_per_k)]
    )
    lasts = ""
    if slowest_s > 0.0:
        hours = noted(float(f"{_REST * slowest_s / 3600.0:.2g}"))
        lasts = (
            f" the correction is wrong for about three of its slowest time constants, {hours} h,"
            " and"
        )
    return (
        "This model counts from its start. After a restart of a machine that is warm it begins at"
        f" zero and at rest:{lasts} what had grown before is not corrected. Let it run through, let"
        " the machine cool before a restart, or export with --reference stated."
    )


def wrapped(paragraph: str) -> list[str]:
    """Return a paragraph as lines of a head."""
    indent = " " * (len(paragraph) - len(paragraph.lstrip()))
    return textwrap.wrap(paragraph.strip(), WIDTH, initial_indent=indent,
                         subsequent_indent=indent + "  ") or [""]  # fmt: skip


def _plain(sentence: str) -> str:
    owned = re.sub(r"the (\w+?)(?:'s|(?<=s)') (\w+)", r"the \2 of the \1", sentence)
    return owned.replace("'", "").replace(";", ",")


def _identity(settings: PlcSettings) -> Iterator[str]:
    provenance = settings.compensation.model.provenance
    yield f"{settings.names.block}: thermal compensation, exported by thermaxis {__version__}"
    yield f"Name: {remark_text(settings.name)}"
    yield f"Model SHA-256: {settings.model_sha256 or 'not stated'}"
    yield f"Model date: {remark_text(provenance.date) or 'not stated'}"
    yield f"Method: {remark_text(provenance.method, 200) or 'not stated'}"
    yield f"Identified by: {remark_text(provenance.program) or 'not stated'}"
    for log in provenance.logs:
        yield f"Training log: {remark_text(log.name)}, {log.rows} rows"
    for name, value in list(provenance.figures.items())[:MOST_FIGURES]:
        yield f"Figure {remark_text(name)} = {noted(value)}"
    if len(provenance.figures) > MOST_FIGURES:
        yield f"Figures that are not listed here: {len(provenance.figures) - MOST_FIGURES}"
    for warning in settings.compensation.model.warnings:
        yield f"Warning: {remark_text(warning, 300)}"
    for warning in setting_warnings(settings):
        yield f"Warning: {warning}."
    for text in settings.notes:
        yield f"Changed by the export: {text}"


def _conventions(settings: PlcSettings) -> Iterator[str]:
    cycle, percent = noted(settings.cycle_s), round(100 * CYCLE_TOLERANCE)
    yield ""
    yield (
        f"Cycle: call it every {cycle} s. A call whose measured time differs by more than"
        f" {percent} percent advances nothing."
    )
    if settings.double:
        yield "Numbers: LREAL (binary64), one rounding per statement."
    else:
        yield (
            "Numbers: REAL (binary32), one rounding per statement. Sections keep what their sum"
            " loses."
        )
    yield "Units: temperatures degC, differences K, displacements and corrections um, times s."
    yield (
        "Sign: a model output is the displacement of the tool point relative to the workpiece,"
        " positive away from it. The correction is minus the model."
    )
    model = settings.compensation.model
    if model.reference == STATED:
        for channel in model.channels:
            yield f"Reference of {remark_text(channel)}: {noted(model.reference_c[channel])} degC"
    else:
        yield "Reference: the first good temperatures after the start, sections start at rest."
        if warning := restart_warning(settings):
            yield f"Warning: {warning}"
        yield (
            "The reference of a temperature is that one reading: what it was off by, such as one"
            " count of the sensor, is carried until the next restart."
        )
    yield "Start: nothing is kept over a loss of power."


def _model(settings: PlcSettings) -> Iterator[str]:
    model = settings.compensation.model
    yield ""
    for output, stem in zip(model.outputs, settings.names.outputs, strict=True):
        yield f"Output {remark_text(output.name)} ({stem}), offset {noted(output.offset_um)} um:"
        yield from _parts(settings, output)
    if model.input_filter_s > 0.0:
        yield f"Filter of the inputs: {noted(model.input_filter_s)} s"


def _parts(settings: PlcSettings, output: Output) -> Iterator[str]:
    for part in output.parts:
        yield f"  Part {remark_text(part.name)}: {_input(part)}"
        yield f"    direct gain {noted(part.direct_gain_um_per_k)} um/K"
        for section in part.sections:
            yield (
                f"    gain {noted(section.gain_um_per_k)} um/K,"
                f" time constant {noted(section.time_constant_s)} s"
            )
        cycles = settings.delay_cycles(part)
        if cycles:
            yield f"    delay {cycles} cycles = {noted(part.delay_s)} s"
        for point in part.gain_by_diameter:
            yield f"    at {noted(point.diameter_mm)} mm times {noted(point.gain)}"
        if part.gain_by_diameter:
            yield f"    at the tool centre point times {noted(part.tool_gain)}"
        if part.lowest_k is not None and part.highest_k is not None:
            yield f"    trained from {noted(part.lowest_k)} to {noted(part.highest_k)} K"


def _input(part: Part) -> str:
    plus, minus = remark_text(part.plus), remark_text(part.minus)
    return f"temperature {plus} minus {minus}" if part.minus else f"temperature {plus}"


def _limits(settings: PlcSettings) -> Iterator[str]:
    compensation = settings.compensation
    yield ""
    for output, b, step_um in zip(
        compensation.model.outputs, compensation.bounds, settings.steps_um, strict=True
    ):
        yield (
            f"Limits of {remark_text(output.name)}: {noted(b.largest_um)} um, with the trim"
            f" {noted(b.total_um)} um, {noted(b.largest_rate_um_per_s)} um/s, at most"
            f" {noted(step_um)} um in one call, trim {noted(b.largest_trim_um)} um, deadband"
            f" {noted(b.deadband_um)} um"
        )
    for channel, rule in zip(compensation.model.channels, compensation.rules, strict=True):
        frozen = f"frozen after {noted(rule.frozen_s)} s" if rule.frozen_s else "never frozen"
        yield (
            f"Believed of {remark_text(channel)}: {noted(rule.lowest_c)} to"
            f" {noted(rule.highest_c)} degC, a jump of {noted(rule.step_k)} K and"
            f" {noted(rule.largest_rate_k_per_s)} K/s, {frozen}"
        )
    yield from _supervisor(settings)


def _supervisor(settings: PlcSettings) -> Iterator[str]:
    """Yield how long what is tolerated, each number with what it follows on."""
    rules = settings.compensation.supervisor
    hold_s = settings.compensation.model.longest_hold_s
    yield (
        f"Before the first correction the model settles for {noted(rules.settle_s)} s. After a"
        f" loss everything must be there for {noted(rules.recovery_delay_s)} s."
    )
    yield (
        f"A lost input: its last value counts on, for {noted(rules.input_timeout_s)} s in Active,"
        f" then for {noted(rules.hold_input_s)} s in Holding, then Fading. The model computes on"
        f" with it meanwhile, model_quality is 2 (bad) after {noted(hold_s)} s."
    )
    yield (
        f"Held, then Fading: without a connection {noted(rules.hold_connection_s)} s, with an"
        f" interlock open {noted(rules.hold_interlock_s)} s, by an operator"
        f" {noted(rules.hold_operator_s)} s although hold stands, whatever comes and goes"
        f" {noted(rules.max_hold_s)} s."
    )
    yield (
        f"Fault: a read-back that differs by more than {noted(rules.read_back_tolerance_um)} um"
        f" or is missing, after {noted(rules.read_back_s)} s, the model at the limit after"
        f" {noted(rules.at_limit_s)} s, another compensation at once."
    )
    yield (
        f"A trim expires {noted(rules.longest_trim_s)} s after it was given, and is lost at a"
        " restart, while its input keeps the value: added_ says what is in force. To give it again"
        " change the input to 0.0 and back. held says whether the hold of an operator is in force."
    )
    yield (
        "hold is a level: while it is TRUE, whatever is enabled and without a fault is held, also"
        " what is enabled meanwhile. refused tells of its rising edge only."
    )


def _numbers() -> Iterator[str]:
    yield ""
    yield f"state: {numbered(SupervisorState, ', ')}"
    yield "enabled: whether somebody has enabled it"
    yield "fault_word: sum of"
    for k, reason in enumerate(Reason):
        yield f"  {2**k} {_plain(sentence(f'reason-{reason}'))}"
    yield "outcome_word: sum of"
    for k, outcome in enumerate(Outcome):
        said = _plain(sentence(f"outcome-{outcome}"))
        yield f"  {2**k} {said}{_NEVER if outcome in NEVER_OUTCOMES else ''}"
    yield "quality of a temperature:"
    for k, quality in enumerate(SampleQuality):
        said = sentence(f"quality-{quality}")
        yield f"  {k} {said}{_NEVER if quality in NEVER_QUALITIES else ''}"
    yield f"model_quality: {numbered(Quality, ', ')}"


def _not_protected(settings: PlcSettings) -> Iterator[str]:
    yield ""
    yield (
        "Not protected: the block knows neither whether its inputs are wired to the sensors that"
        " the model means, nor whether the axis is referenced, nor whether the sign is right on"
        " this machine, nor whether the control adds what it is given. Prove that at"
        " commissioning, with the test vectors first and small corrections then."
    )
    yield (
        "Write the correction only while linked is TRUE and state is not 0 (Off): then the machine"
        " is connected, and the offset that stood there was read and taken over. In Off nobody"
        " writes, so that is done in every call, before its requests are answered. After a loss of"
        " the connection it is done in the first call with connected and read_ok TRUE and every"
        " read_ a number. Until then linked is FALSE and the block counts as not connected, so that"
        " enable cannot write anything before a read."
    )
    yield (
        "An offset that was found beyond the limits stays as it is while it is Off, and enabling"
        " is refused: bring the offset back in the control, then enable. Found so after a lost"
        " connection in another state it is a fault, and the correction comes back at the rate."
    )
    yield (
        "Levels of enable, reset and trims that stand in the first call ask for nothing until they"
        " change. hold acts as soon as it is enabled."
    )
    if settings.double:
        yield (
            "Times are counted in cycles. With a cycle that a binary number does not hold, such as"
            " 0.1 s, a limit in seconds may be met one cycle earlier or later than on the computer."
        )
    else:
        yield "Times are counted in cycles, exactly up to a day."
