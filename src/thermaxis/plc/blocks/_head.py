"""The lines at the top of a program: what it is, where it comes from, what its numbers mean."""

import re
import textwrap
from collections.abc import Iterator
from dataclasses import fields
from typing import TYPE_CHECKING

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
from thermaxis.plc._texts import paragraphs, remark_of, text
from thermaxis.plc.blocks._library import numbered
from thermaxis.plc.blocks._warnings import restart_warning, setting_warnings
from thermaxis.plc.tree import noted, remark_text

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

WIDTH = 88
"""Longest line of the head. Origin: a line of 100 signs with the signs of a remark. [1]"""
MOST_FIGURES = 40
"""Figures of the identification that are listed. [1]"""


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
        yield f"Warning: {remark_of(warning)}."
    for note in settings.notes:
        yield f"Changed by the export: {remark_of(note)}"


def _conventions(settings: PlcSettings) -> Iterator[str]:
    yield ""
    percent = round(100 * CYCLE_TOLERANCE)
    yield text("head_cycle", cycle_s=noted(settings.cycle_s), percent=percent)
    if settings.double:
        yield "Numbers: LREAL (binary64), one rounding per statement."
    else:
        yield text("head_real")
    yield "Units: temperatures degC, differences K, displacements and corrections um, times s."
    yield text("head_sign")
    model = settings.compensation.model
    if model.reference == STATED:
        for channel in model.channels:
            yield f"Reference of {remark_text(channel)}: {noted(model.reference_c[channel])} degC"
    else:
        yield "Reference: the first good temperatures after the start, sections start at rest."
        if warning := restart_warning(settings):
            yield f"Warning: {remark_of(warning)}"
        yield text("head_reference")
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
        name = remark_text(output.name)
        yield text("head_limits", output=name, step_um=noted(step_um), **_noted(b))
    for channel, rule in zip(compensation.model.channels, compensation.rules, strict=True):
        frozen = f"frozen after {noted(rule.frozen_s)} s" if rule.frozen_s else "never frozen"
        yield text("head_believed", channel=remark_text(channel), frozen=frozen, **_noted(rule))
    hold_s = noted(compensation.model.longest_hold_s)
    rules = _noted(compensation.supervisor)
    yield from paragraphs("head_supervisor", longest_hold_s=hold_s, **rules)


def _noted(part: "DataclassInstance") -> dict[str, str]:
    """Return the numbers of a part by name, as a remark has them."""
    values = ((entry.name, getattr(part, entry.name)) for entry in fields(part))
    return {name: noted(value) for name, value in values if isinstance(value, int | float)}


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
    yield from paragraphs("head_not_protected")
    if settings.double:
        yield text("head_lreal_times")
    else:
        yield "Times are counted in cycles, exactly up to a day."
