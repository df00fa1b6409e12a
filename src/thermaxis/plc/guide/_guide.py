"""The commissioning guide beside an exported program: from the file to the first correction."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple, final

from thermaxis.codes import Message
from thermaxis.compensation import (
    STATED,
    Outcome,
    Part,
    Reason,
    SampleQuality,
    SupervisorState,
)
from thermaxis.messages import sentence
from thermaxis.plc._block import Block
from thermaxis.plc._interface import NEVER_OUTCOMES, NEVER_QUALITIES, Kind, Variable
from thermaxis.plc._line import LineSettings, line_bounds
from thermaxis.plc._names import remark_text
from thermaxis.plc._numbers import figure, outward_text
from thermaxis.plc._settings import CYCLE_TOLERANCE, PlcSettings
from thermaxis.plc._texts import page, paragraphs, remark_of, text
from thermaxis.plc._warnings import restart_warning, setting_warnings
from thermaxis.plc.guide._losses import losses_text
from thermaxis.plc.guide._report import NOT_CHECKED_BY_SIEMENS, TEMPCOMP, Target

MOST_FIGURES = 40
"""Figures of the identification that are listed. [1]"""


@final
class GuideFacts(NamedTuple):
    """What the guide says besides the settings."""

    target: Target
    """Who gets the program."""
    files: tuple[str, ...]
    """Names of the program's files."""
    vectors: str
    """Name of the file of test vectors."""
    conditions: tuple[str, ...] = ()
    """Interlocks of the machine, which are one input here."""
    line: LineSettings | None = None
    """The line; None where there is none."""
    warnings: tuple[Message, ...] = ()
    """What else is to be warned of."""


def guide_text(settings: PlcSettings, block: Block, facts: GuideFacts) -> str:
    """Return the guide.

    Not protected: a guide does not see the machine. Whoever follows it must be allowed to set up
    this machine, and stands by its emergency stop.

    Parameters
    ----------
    settings : PlcSettings
        What was exported.
    block : Block
        The block.
    facts : GuideFacts
        Target and files.

    Returns
    -------
    str
        Markdown; text from people in letters, digits, space, ``-``, ``_`` and ``.`` only. The
        same for the same input, whatever the day.
    """
    variant = facts.target.variant or "c"
    title = text(f"title_{variant}")
    if facts.line is not None:
        title = f"temperature compensation of SINUMERIK ({title})"
    if block.model_only:
        sections = [
            (f"# {block.name}: {title}, the model alone", _opening(settings, facts)),
            ("## 1. Import", _import(block, variant)),
            ("## 2. Inputs and outputs", _alone(settings, block)),
            ("## Not protected", paragraphs("head_model_only")),
        ]
        return _page(sections)
    sections = [
        (f"# {block.name}: {title}", _opening(settings, facts)),
        ("## 1. Import", _import(block, variant)),
        ("## 2. Call", _call(settings, variant)),
        ("## 3. Wire the inputs", _inputs(settings, block, facts)),
        ("## 4. Use the outputs", _outputs(settings, block, facts)),
        ("## 5. Check the numbers without the machine", _vectors(settings, facts)),
        ("## 6. First correction", _first(settings, facts)),
        ("## 7. Switch off and on", _off(settings, facts)),
    ]
    if facts.line is not None:
        sections.append(("## 8. The side of the control", _control(settings, facts.line)))
    sections.append(("## What is lost, and what follows", losses_text(settings)))
    sections.append(("## Not protected", _not_protected(facts)))
    return _page(sections)


def _page(sections: Iterable[tuple[str, Iterable[str]]]) -> str:
    parts = [f"{heading}\n\n" + "\n".join(lines) for heading, lines in sections]
    return "\n\n".join(parts) + "\n"


def _alone(settings: PlcSettings, block: Block) -> Iterator[str]:
    face = block.interface
    yield f"Call the block once per cycle of {figure(settings.cycle_s)} s."
    yield ""
    yield from _table(face.inputs, settings)
    yield ""
    yield from _table((*face.outputs, *face.identity), settings)
    yield ""
    yield text("sign")
    yield text("unit")
    yield from _bounds(settings)


def _numbered(lines: Iterable[str]) -> Iterator[str]:
    for number, line in enumerate(lines, 1):
        yield f"{number}. {line}"


def _opening(settings: PlcSettings, facts: GuideFacts) -> Iterator[str]:
    provenance = settings.compensation.model.provenance
    yield text(
        "opening",
        block=settings.names.block,
        files=", ".join(f"`{name}`" for name in facts.files),
        kind=_kind(settings),
        cycle_s=figure(settings.cycle_s),
    )
    yield f"Model SHA-256: {settings.model_sha256 or 'not stated'}."
    yield _stopped(f"Model date: {remark_text(provenance.date) or 'not stated'}")
    yield _stopped(f"Method: {remark_text(provenance.method, 200) or 'not stated'}")
    yield _stopped(f"Identified by: {remark_text(provenance.program) or 'not stated'}")
    for log in provenance.logs:
        yield f"Training log: {remark_text(log.name)}, {log.rows} rows."
    for name, value in list(provenance.figures.items())[:MOST_FIGURES]:
        yield f"Figure {remark_text(name)} = {figure(value)}."
    for warning in settings.compensation.model.warnings:
        yield _stopped(f"Warning of the model: {remark_text(warning, 300)}")
    for said in (*setting_warnings(settings), *facts.warnings):
        yield _stopped(f"**Warning:** {remark_of(said)}")
    for changed in settings.notes:
        yield _stopped(f"Changed by the export: {remark_of(changed)}")
    warning = restart_warning(settings)
    if warning:
        yield f"**Warning: {remark_of(warning)}**"
    yield ""
    yield text("marks")
    if facts.target.dialect in {"scl", TEMPCOMP}:
        yield ""
        yield f"**{NOT_CHECKED_BY_SIEMENS[0].upper()}{NOT_CHECKED_BY_SIEMENS[1:]}.**"


def _stopped(sentence: str) -> str:
    """Return a sentence with its full stop, which what people have written may bring along."""
    return sentence if sentence.endswith(".") else f"{sentence}."


def _kind(settings: PlcSettings) -> str:
    return "LREAL (binary64)" if settings.double else "REAL (binary32)"


def _import(block: Block, variant: str) -> Iterator[str]:
    yield from _numbered(paragraphs(f"import_{variant}", block=block.name))
    yield ""
    yield text("replace_alone" if block.model_only else "replace", block=block.name)
    yield (
        "\nChange nothing in the text: its numbers belong to the model and to the vectors. Export"
        " it again instead."
    )


def _call(settings: PlcSettings, variant: str) -> Iterator[str]:
    cycle = figure(settings.cycle_s)
    percent = round(100 * CYCLE_TOLERANCE)
    yield f"Call the block once per cycle from {text(f'task_{variant}', cycle=cycle)}."
    yield text("cycle_time", cycle=cycle, percent=percent)
    yield f"A way to measure it: {text(f'measured_{variant}')}."
    yield text("cycle_time_constant", cycle=cycle)
    yield ""
    yield text("first_scan", gap_s=figure(settings.compensation.model.longest_gap_s))
    yield ""
    yield from page(f"start_{variant}", block=settings.names.block)


def _inputs(settings: PlcSettings, block: Block, facts: GuideFacts) -> Iterator[str]:
    rules = settings.compensation.supervisor
    yield from _table(block.interface.inputs, settings)
    yield ""
    if facts.conditions:
        named = ", ".join(remark_text(name) for name in facts.conditions)
        yield f"* `interlocks_met`: TRUE only while all of these are met: {named}."
    else:
        yield text("interlocks")
    yield text("ok")
    yield text("temperatures")
    if facts.line is None:
        yield text("read_axis", taken_over=text("taken_over"))
    else:
        yield text("read_line", taken_over=text("taken_over"))
    yield text("connected")
    yield text("requests")
    yield text("hold", hold_operator_s=figure(rules.hold_operator_s))
    yield text("trim", longest_trim_s=figure(rules.longest_trim_s))


def _table(variables: tuple[Variable, ...], settings: PlcSettings) -> Iterator[str]:
    number = "LREAL" if settings.double else "REAL"
    yield "| name | type | meaning |"
    yield "|---|---|---|"
    for variable in variables:
        kind = number if variable.kind is Kind.NUMBER else variable.kind.value
        yield f"| `{variable.name}` | {kind} | {variable.remark} |"


def _outputs(settings: PlcSettings, block: Block, facts: GuideFacts) -> Iterator[str]:
    yield from _table((*block.interface.outputs, *block.interface.identity), settings)
    yield ""
    yield text("sign")
    if facts.line is None:
        yield text("unit")
    else:
        yield "* To the control go `k0_mm`, `slope` and `reference_mm` alone, see section 8."
    yield text("write")
    yield from _bounds(settings)


def _bounds(settings: PlcSettings) -> Iterator[str]:
    names = (remark_text(output.name) for output in settings.compensation.model.outputs)
    bounds_of = zip(names, settings.compensation.bounds, settings.steps_um, strict=True)
    for name, bounds, step_um in bounds_of:
        yield text(
            "bounds",
            name=name,
            total_um=figure(bounds.total_um),
            largest_rate_um_per_s=figure(bounds.largest_rate_um_per_s),
            step_um=figure(step_um),
        )


def _vectors(settings: PlcSettings, facts: GuideFacts) -> Iterator[str]:
    within = "1e-9 um (LREAL)" if settings.double else "0.002 um (REAL)"
    yield text("vectors", vectors=facts.vectors, within=within)


def _gain_um_per_k(part: Part) -> float:
    return part.dc_gain_um_per_k * (part.tool_gain if part.gain_by_diameter else 1.0)


def _largest_trims(settings: PlcSettings) -> str:
    trims = [figure(bounds.largest_trim_um) for bounds in settings.compensation.bounds]
    if len(set(trims)) == 1:
        return f"{trims[0]} um"
    stems = zip(settings.names.outputs, trims, strict=True)
    return ", ".join(f"{trim} um for `trim_{stem}`" for stem, trim in stems)


def _sign_proof(settings: PlcSettings, line: LineSettings | None) -> str:
    largest = _largest_trims(settings)
    if line is None:
        asked = f"Prove the sign with a trim, at most {largest}, and a dial gauge:"
    else:
        least_um = min(bounds.largest_trim_um for bounds in settings.compensation.bounds)
        asked = text("same_trim", least_um=figure(least_um))
    return text("trim_moves_away", asked=asked)


def _first(settings: PlcSettings, facts: GuideFacts) -> Iterator[str]:
    compensation = settings.compensation
    rules, model = compensation.supervisor, compensation.model
    start = "their stated references" if model.reference == STATED else "those at the start"
    proof = _sign_proof(settings, facts.line)
    steps = paragraphs("first_steps", settle_s=figure(rules.settle_s), sign_proof=proof)
    yield from _numbered(steps)
    yield ""
    yield f"Temperatures count as differences to {start}. What a lasting kelvin does in the end:"
    yield ""
    yield "| output | part | input | model, um/K | correction, um/K |"
    yield "|---|---|---|---|---|"
    for output, stem in zip(model.outputs, settings.names.outputs, strict=True):
        for part in output.parts:
            plus = remark_text(part.plus)
            of = f"{plus} minus {remark_text(part.minus)}" if part.minus else plus
            gain = _gain_um_per_k(part)
            name = remark_text(part.name)
            yield f"| `{stem}` | {name} | {of} | {gain:+.4g} | {0.0 - gain:+.4g} |"
    states = ", ".join(f"{k} {state}" for k, state in enumerate(SupervisorState))
    yield ""
    yield text("states", states=states)
    yield ""
    yield from _numbers()


def _numbers() -> Iterator[str]:
    """Yield what the bits and numbers of the outputs mean."""
    yield "| `fault_word`, sum of | why it is not active |"
    yield "|---|---|"
    for k, reason in enumerate(Reason):
        yield f"| {2**k} | {sentence(f'reason-{reason}')} |"
    yield ""
    yield "| `outcome_word`, sum of | what was out of the ordinary in the model |"
    yield "|---|---|"
    for k, outcome in enumerate(Outcome):
        if outcome not in NEVER_OUTCOMES:
            yield f"| {2**k} | {sentence(f'outcome-{outcome}')} |"
    yield ""
    yield "| `quality_...` | what is wrong with a temperature |"
    yield "|---|---|"
    for k, quality in enumerate(SampleQuality):
        if quality not in NEVER_QUALITIES:
            yield f"| {k} | {sentence(f'quality-{quality}')} |"


def _off(settings: PlcSettings, facts: GuideFacts) -> Iterator[str]:
    longest_s = max(b.total_um / b.largest_rate_um_per_s for b in settings.compensation.bounds)
    yield text("off", longest_s=figure(longest_s))
    yield text("restart")
    yield ""
    yield text(
        "standing",
        tolerance_um=figure(settings.compensation.supervisor.read_back_tolerance_um),
        to_zero=text("zero_axis" if facts.line is None else "zero_line"),
    )
    warning = restart_warning(settings)
    if warning:
        yield ""
        yield f"**{remark_of(warning)}**"


def _control(settings: PlcSettings, line: LineSettings) -> Iterator[str]:
    k0_mm, slope = line_bounds(settings, line)
    k0_step, slope_step = map(outward_text, line.reach(settings.steps_um))
    travel = "away from" if line.away else "towards"
    k_mm = 1.0 / line.um_per_mm
    trim_um = min(bounds.largest_trim_um for bounds in settings.compensation.bounds)
    yield text("line")
    yield ""
    for stem, position in zip(settings.names.outputs, line.positions_mm, strict=True):
        yield f"* `correction_{stem}` at {figure(position)} mm"
    yield ""
    yield "| output | setting data | unit | largest here | data type |"
    yield "|---|---|---|---|---|"
    yield f"| `k0_mm` | SD43900 `$SA_TEMP_COMP_ABS_VALUE` [V] | mm | {k0_mm} | DOUBLE [M] |"
    yield f"| `slope` | SD43910 `$SA_TEMP_COMP_SLOPE` [V] | mm/mm | {slope} | DOUBLE [M] |"
    yield text("line_reference_row", origin_mm=line.origin_mm)
    yield ""
    values = {
        "travel": travel,
        "k_mm": k_mm,
        "trim_um": figure(trim_um),
        "k0_mm": k0_mm,
        "slope": slope,
        "k0_step": k0_step,
        "slope_step": slope_step,
        "velocity_factor": line.velocity_factor,
    }
    yield from _numbered(paragraphs("line_steps", **values))
    yield ""
    yield text("line_not_verified")


def _not_protected(facts: GuideFacts) -> Iterator[str]:
    yield text("not_protected")
    if facts.target.dialect == "c":
        yield text("not_protected_c")
