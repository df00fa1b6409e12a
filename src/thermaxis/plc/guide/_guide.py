"""The commissioning guide beside an exported program: from the file to the first correction."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple, final

from thermaxis.compensation import STATED, Part, SupervisorState
from thermaxis.plc._settings import CYCLE_TOLERANCE, PlcSettings
from thermaxis.plc.blocks import LineSettings, bound_texts, restart_warning, setting_warnings
from thermaxis.plc.guide._losses import losses_text
from thermaxis.plc.guide._report import NOT_CHECKED_BY_SIEMENS, TEMPCOMP, Target
from thermaxis.plc.tree import Kind, Program, Variable, figure, outward_text, remark_text

_MARKS = (
    "Marks: [run] seen in this project's tests; [V] read in a manual; [src] read in a source;"
    " [inf] inferred; [trade] said in the trade, not read; [M] from memory. What"
    " is marked [inf], [trade] or [M] is to be checked on your control before you rely on it."
)
_TITLES = {
    ("scl", "s7-1500"): "S7-1500 and SINUMERIK ONE, TIA Portal",
    ("scl", "s7-300"): "S7-300 class, as in SINUMERIK 840D sl",
    ("st", "iec"): "IEC 61131-3 Structured Text",
    ("st", "twincat"): "TwinCAT 3",
    ("st", "codesys"): "CODESYS",
    ("c", ""): "C99",
}
_MEASURED = {
    ("scl", "s7-1500"): "`RUNTIME` with a memory of its own gives seconds as LREAL from the second"
    " call on [trade]",
    ("scl", "s7-300"): "the difference of two `TIME_TCK` in milliseconds, which begins anew at"
    " 2147483647, by 1000.0 [trade]",
    ("st", "iec"): "the difference of two readings of a timer `TON` that runs, or of a clock of the"
    " runtime [trade]",
    ("st", "twincat"): "the difference of two `F_GetActualDcTime64` or `GETSYSTEMTIME`, which count"
    " 1 ns and 100 ns [trade]",
    (
        "st",
        "codesys",
    ): "the difference of two `TIME()` in milliseconds, as DWORD, by 1000.0 [trade]",
    ("c", ""): "the difference of two `clock_gettime(CLOCK_MONOTONIC)` [trade]",
}
_TAKEN_OVER = (
    "While the state is 0 (Off) what stands in the control is taken over in **every** call in which"
    " `connected` and `read_ok` are TRUE, because somebody may have changed it; after a loss of the"
    " connection in the first such call. Without it `linked` is FALSE, and after `enable` the block"
    " stays in Warming and nothing moves on. In any other state a difference that lasts is a fault."
)
_IMPORTS: dict[tuple[str, str], tuple[str, ...]] = {
    ("scl", "s7-1500"): (
        (
            "In TIA Portal add the file under External source files of the CPU, and choose Generate"
            " blocks from source [trade]. The blocks stand in the order in which they are needed."
        ),
        (
            "Create an instance data block of `{block}`. Its own start values are right; set no"
            " variable of it to retain: the block must start anew after a loss of power."
        ),
        (
            "The instance data block has optimised access and no fixed addresses. What another"
            " program reads by address, as OPC UA ids with `DBx.DBDy`, belongs into a standard data"
            " block that you copy to [inf]."
        ),
    ),
    ("scl", "s7-300"): (
        (
            "In STEP 7 V5 with S7-SCL import the file as a source and compile it; in TIA Portal"
            " add it as an external source [trade]. Block names are symbols: the symbol table"
            " gives each a free number first [trade]."
        ),
        (
            "Create an instance data block of `{block}`. CPUs of this class keep it over a loss of"
            " power: declare it non-retain, or load its start values in OB100 [trade]."
        ),
        "Numbers are REAL: the CPU has no LREAL [V].",
    ),
    ("st", "iec"): (
        ("Import the file as it is: matiec and compilers of its family take whole files [src]."),
        "Declare an instance of `{block}` in a program, without RETAIN.",
    ),
    ("st", "twincat"): (
        (
            "Make one function block per block of the file, in its order: from FUNCTION_BLOCK to"
            " the mark goes into the upper pane, the rest without END_FUNCTION_BLOCK into the"
            " lower one [trade]."
        ),
        "Declare an instance of `{block}` in a program, not as PERSISTENT or RETAIN.",
    ),
    ("st", "codesys"): (
        (
            "Make one function block per block of the file, in its order: from FUNCTION_BLOCK to"
            " the mark goes into the upper pane, the rest without END_FUNCTION_BLOCK into the"
            " lower one [trade]."
        ),
        "Declare an instance of `{block}` in a program, not as PERSISTENT or RETAIN.",
    ),
    ("c", ""): (
        (
            "Compile `{block}.c` with your program, with `-ffp-contract=off` and without fast math:"
            " `gcc -std=c99 -Wall -Wextra -pedantic -ffp-contract=off -c {block}.c` [run]. A"
            " compiler that contracts a product and a sum to one operation gives numbers that"
            " differ in the last digits [run]."
        ),
        (
            "Declare a `{block}` of static storage. Call `{block}_init` once, set the inputs, call"
            " `{block}_step` once per cycle from one thread alone, read the outputs."
        ),
    ),
}
_TASKS = {
    ("scl", "s7-1500"): "a cyclic interrupt OB, such as OB30, set to {cycle} s [trade]",
    ("scl", "s7-300"): "OB35 or another cyclic interrupt with a counter, every {cycle} s [trade];"
    " not OB1, whose time varies",
    ("st", "iec"): "a task with an interval of {cycle} s",
    ("st", "twincat"): "a task with a cycle of {cycle} s, or a faster one with a counter",
    ("st", "codesys"): "a task with an interval of {cycle} s, or a faster one with a counter",
    ("c", ""): "a timer of {cycle} s",
}


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
    warnings: tuple[str, ...] = ()
    """What else is to be warned of, in sentences without their full stops, as remarks."""


def guide_text(settings: PlcSettings, program: Program, facts: GuideFacts) -> str:
    """Return the guide.

    Not protected: a guide does not see the machine. Whoever follows it must be allowed to set up
    this machine, and stands by its emergency stop.

    Parameters
    ----------
    settings : PlcSettings
        What was exported.
    program : Program
        The program.
    facts : GuideFacts
        Target and files.

    Returns
    -------
    str
        Markdown; text from people in letters, digits, space, ``-``, ``_`` and ``.`` only. The
        same for the same input, whatever the day.
    """
    key = _key(facts.target)
    title = _TITLES[key]
    if facts.line is not None:
        title = f"temperature compensation of SINUMERIK ({title})"
    sections = [
        (f"# {program.name}: {title}", _opening(settings, facts)),
        ("## 1. Import", _import(program, facts, key)),
        ("## 2. Call", _call(settings, key)),
        ("## 3. Wire the inputs", _inputs(settings, program, facts)),
        ("## 4. Use the outputs", _outputs(settings, program, facts)),
        ("## 5. Check the numbers without the machine", _vectors(settings, facts)),
        ("## 6. First correction", _first(settings, program, facts)),
        ("## 7. Switch off", _off(settings)),
    ]
    if facts.line is not None:
        sections.append(("## 8. The side of the control", _control(settings, facts.line)))
    sections.append(("## What is lost, and what follows", losses_text(settings)))
    sections.append(("## Not protected", _not_protected(facts)))
    parts = [f"{heading}\n\n" + "\n".join(lines) for heading, lines in sections]
    return "\n\n".join(parts) + "\n"


def _key(target: Target) -> tuple[str, str]:
    return ("scl" if target.dialect == TEMPCOMP else target.dialect), target.variant


def _numbered(lines: Iterable[str]) -> Iterator[str]:
    for number, line in enumerate(lines, 1):
        yield f"{number}. {line}"


def _opening(settings: PlcSettings, facts: GuideFacts) -> Iterator[str]:
    provenance = settings.compensation.model.provenance
    yield (
        f"Block `{settings.names.block}` in {', '.join(f'`{name}`' for name in facts.files)}, in"
        f" {_kind(settings)}, for a cycle of {figure(settings.cycle_s)} s."
    )
    yield f"Model SHA-256: {settings.model_sha256 or 'not stated'}."
    yield _stopped(f"Model date: {remark_text(provenance.date) or 'not stated'}")
    for warning in settings.compensation.model.warnings:
        yield _stopped(f"Warning of the model: {remark_text(warning, 300)}")
    for text in (*setting_warnings(settings), *facts.warnings):
        yield _stopped(f"**Warning:** {text}")
    for changed in settings.notes:
        yield _stopped(f"Changed by the export: {changed}")
    warning = restart_warning(settings)
    if warning:
        yield f"**Warning: {warning}**"
    yield ""
    yield _MARKS
    if facts.target.dialect in {"scl", TEMPCOMP}:
        yield ""
        yield f"**{NOT_CHECKED_BY_SIEMENS[0].upper()}{NOT_CHECKED_BY_SIEMENS[1:]}.**"


def _stopped(sentence: str) -> str:
    """Return a sentence with its full stop, which what people have written may bring along."""
    return sentence if sentence.endswith(".") else f"{sentence}."


def _kind(settings: PlcSettings) -> str:
    return "LREAL (binary64)" if settings.double else "REAL (binary32)"


def _import(program: Program, facts: GuideFacts, key: tuple[str, str]) -> Iterator[str]:
    blocks = ", ".join(f"`{block.name}`" for block in program.blocks)
    yield from _numbered(text.format(block=program.name) for text in _IMPORTS[key])
    if facts.target.dialect != "c":
        yield f"\nBlocks of the file, in its order: {blocks}."
    yield (
        "\nChange nothing in the text: its numbers belong to the model and to the vectors. Export"
        " it again instead."
    )


def _call(settings: PlcSettings, key: tuple[str, str]) -> Iterator[str]:
    cycle = figure(settings.cycle_s)
    percent = round(100 * CYCLE_TOLERANCE)
    yield f"Call the block once per cycle from {_TASKS[key].format(cycle=cycle)}."
    yield (
        f"`cycle_time_s` is the time since the last call, **measured**, not the constant {cycle};"
        f" {cycle} at the first call. A call whose time differs by more than {percent} percent"
        " advances nothing: the correction stays, and the time counts as one of lost inputs."
    )
    yield f"A way to measure it: {_MEASURED[key]}."
    yield (
        f"Whoever wires the constant {cycle} instead **switches this check off**: a task that runs"
        " at another rate then makes every time constant wrong, and nobody sees it."
    )


def _inputs(settings: PlcSettings, program: Program, facts: GuideFacts) -> Iterator[str]:
    rules = settings.compensation.supervisor
    yield from _table(program.blocks[-1].inputs, program)
    yield ""
    if facts.conditions:
        named = ", ".join(remark_text(name) for name in facts.conditions)
        yield f"* `interlocks_met`: TRUE only while all of these are met: {named}."
    else:
        yield (
            "* `interlocks_met`: TRUE only while the axis is referenced, the machine on, nothing is"
            " homing and no emergency stop is active."
        )
    yield (
        "* `ok_...`: FALSE on wire break, overflow, or a module that does not answer. A temperature"
        " of an open input often reads 0.0, or what the lowest or highest count of its module means"
        " [trade]: the plausible range must contain none of them."
    )
    yield (
        "* Temperatures are degrees Celsius. Many input modules count in tenths: divide by 10.0"
        " after the conversion to a number."
    )
    if facts.line is None:
        yield (
            "* `read_...`: what the axis has accepted, in um, with the sign of the correction, not"
            f" a copy of the output. {_TAKEN_OVER} `read_ok` is FALSE where it could not be read."
        )
    else:
        yield (
            "* `read_k0_mm`, `read_slope`, `read_reference_mm`: what GET has read of the three"
            f" setting data, not a copy of the outputs. {_TAKEN_OVER} `read_ok` is FALSE while GET"
            " reports an error."
        )
    yield (
        "* `connected`: FALSE while a correction that is written would not reach the axis."
        " `other_compensation`: TRUE while another thermal compensation of the axis is switched"
        " on; FALSE only where you know that there is none."
    )
    yield (
        "* `enable`, `reset` and `trim_...` ask by a **change**: what stands at the first"
        " call asks for nothing. After a restart `enable` must go to FALSE and to TRUE again."
    )
    yield (
        "* `hold`: a maintained switch. While it is TRUE, whatever is enabled and without a fault"
        " is held, also what is enabled meanwhile; when it falls, the hold ends. `refused` tells of"
        f" its rising edge only. A hold ends by itself after {figure(rules.hold_operator_s)} s"
        " (`held` stays TRUE, the correction fades), whatever the switch says."
    )
    yield (
        "* `trim_...`: an addition by a person; a new value is a request. **It expires after"
        f" {figure(rules.longest_trim_s)} s and is lost at a restart, while the input keeps its"
        " value**: `added_...` says what is in force, and the input must go to 0.0 and back to give"
        " it again. 0.0 takes it back in every state; 0.0 where nobody trims. `diameter_known`"
        " FALSE where the workpiece is not known."
    )


def _table(variables: tuple[Variable, ...], program: Program) -> Iterator[str]:
    number = "LREAL" if program.double else "REAL"
    yield "| name | type | meaning |"
    yield "|---|---|---|"
    for variable in variables:
        kind = number if variable.kind is Kind.NUMBER else variable.kind.value
        yield f"| `{variable.name}` | {kind} | {variable.text} |"


def _outputs(settings: PlcSettings, program: Program, facts: GuideFacts) -> Iterator[str]:
    yield from _table(program.blocks[-1].outputs, program)
    yield ""
    yield (
        "* Sign: `model_...` is the displacement of the tool point relative to the workpiece,"
        " positive away from it; `correction_...` is minus that, weighted and limited. Where a"
        " positive offset of the axis moves the tool point **away** from the workpiece, the"
        " correction is the offset; where it moves it **towards** the workpiece, it is minus it."
    )
    if facts.line is None:
        yield (
            "* Unit: um. A control that takes millimetres gets `correction_... / 1000`. Before a"
            " conversion to whole numbers clamp in floating point."
        )
    else:
        yield "* To the control go `k0_mm`, `slope` and `reference_mm` alone, see section 8."
    yield (
        "* Write the correction only while `linked` is TRUE and `heartbeat` changes, and let"
        " whatever writes it take the"
        " offset back at a rate when it stands still: the block cannot see that its PLC stopped."
        " While `state` is 0 (Off) write nothing: the offset is then left as it is."
    )
    names = (remark_text(output.name) for output in settings.compensation.model.outputs)
    bounds_of = zip(names, settings.compensation.bounds, settings.steps_um, strict=True)
    for name, bounds, step_um in bounds_of:
        yield (
            f"* {name}: never more than {figure(bounds.total_um)} um, never faster than"
            f" {figure(bounds.largest_rate_um_per_s)} um/s, at most {figure(step_um)} um in one"
            f" call. Check both again behind the block: the magnitude, and from call to call a step"
            f" of at most {figure(step_um)} um."
        )


def _vectors(settings: PlcSettings, facts: GuideFacts) -> Iterator[str]:
    within = "1e-9 um (LREAL)" if settings.double else "0.002 um (REAL)"
    yield (
        f"`{facts.vectors}` has inputs and expected outputs: a row stands for `calls` calls with"
        " the same inputs, its outputs are those after the last. Before anything is wired"
        " to the axis, feed the rows to a fresh instance, in a simulator or on the CPU, and compare"
        f" every output: BOOL and INT must be equal, numbers within {within}. A compiler that"
        " rounds every operation as IEEE 754 says gives the very same numbers [run, with gcc]."
        " Where a row says that the PLC was switched off and on, begin with the start values."
        " The table is a course through faults and limits of at most 2000 rows and 45000 calls."
        " What is not in the rows, and where it was cut, stands at its head."
    )


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
        asked = (
            "Prove the sign with a dial gauge, and **the same trim at every position**: set all"
            f" `trim_...` to one value, at most {figure(least_um)} um, so that the line moves as a"
            " whole and keeps its slope:"
        )
    return (
        f"{asked} a positive trim must move the tool point **away** from the workpiece. More than"
        " the largest trim is refused (`refused`). If it moves towards it, switch off and mend the"
        " wiring of the output, not the model."
    )


def _first(settings: PlcSettings, program: Program, facts: GuideFacts) -> Iterator[str]:
    compensation = settings.compensation
    rules, model = compensation.supervisor, compensation.model
    start = "their stated references" if model.reference == STATED else "those at the start"
    yield from _numbered(
        (
            (
                "`enable` FALSE, the axis referenced and standing. `heartbeat` counts, `state` is 0"
                " (Off), `enabled` is FALSE, `linked` is TRUE, every `quality_...` is 0, `read_...`"
                " shows the offset in the control."
            ),
            "Blow warm air at one sensor: the right `t_...` rises, and no other.",
            (
                f"Set `enable`. `state` becomes 1 (Warming), after {figure(rules.settle_s)} s 2"
                " (Active). Corrections move at no more than the rate."
            ),
            _sign_proof(settings, facts.line),
            (
                "Let the machine warm up with the gauge in place, and look whether what is left is"
                " smaller than without the block."
            ),
        )
    )
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
    yield (
        f"`state`: {states}. What the bits of `fault_word` and `outcome_word` and the numbers of"
        f" `quality_...` mean stands at the head of `{program.name}`'s file."
    )


def _off(settings: PlcSettings) -> Iterator[str]:
    longest_s = max(b.total_um / b.largest_rate_um_per_s for b in settings.compensation.bounds)
    yield (
        f"`enable` FALSE: the correction goes to zero at the rate, within {figure(longest_s)} s"
        " from the largest one, then `state` is 0. Do not cut the writing while it fades: the"
        " offset would stay where it is. After a fault (`state` 5) the correction fades too;"
        " `reset` acknowledges it once its cause is gone, and it stays off until it is enabled."
        " Where an offset beyond the limits is found in Off, enabling is refused: bring the offset"
        " back in the control, then enable."
    )
    yield (
        "After a loss of power the block starts anew: its sections are at steady state, or at rest"
        " where the model refers to its start, and it takes over the offset that the axis reports"
        " in every call in which it is connected and read. It stays off until `enable` goes to"
        " FALSE and to TRUE."
    )
    warning = restart_warning(settings)
    if warning:
        yield ""
        yield f"**{warning}**"


def _control(settings: PlcSettings, line: LineSettings) -> Iterator[str]:
    k0_mm, slope = bound_texts(settings, line)
    k0_step, slope_step = map(outward_text, line.reach(settings.steps_um))
    travel = "away from" if line.away else "towards"
    k_mm = 1.0 / line.um_per_mm
    trim_um = min(bounds.largest_trim_um for bounds in settings.compensation.bounds)
    yield (
        "The control corrects the actual value of the axis by K(P) = K0 + slope (P - P0) [V,"
        " description of functions K3]. Positions of the models and their outputs:"
    )
    yield ""
    for stem, position in zip(settings.names.outputs, line.positions_mm, strict=True):
        yield f"* `correction_{stem}` at {figure(position)} mm"
    yield ""
    yield "| output | setting data | unit | largest here | data type |"
    yield "|---|---|---|---|---|"
    yield f"| `k0_mm` | SD43900 `$SA_TEMP_COMP_ABS_VALUE` [V] | mm | {k0_mm} | DOUBLE [M] |"
    yield f"| `slope` | SD43910 `$SA_TEMP_COMP_SLOPE` [V] | mm/mm | {slope} | DOUBLE [M] |"
    yield (
        f"| `reference_mm` | SD43920 `$SA_TEMP_COMP_REF_POSITION` [V] | mm |"
        f" {line.origin_mm:.9g}, constant | DOUBLE [M] |"
    )
    yield ""
    yield from _numbered(
        (
            (
                "Set MD32750 `$MA_TEMP_COMP_TYPE` of the axis: bit 0 for K0 and bit 1 for the"
                " slope, so 3; it acts after power-on [V]. Leave it 0 until the vectors have"
                " passed."
            ),
            (
                "**Sign.** K is the error of the actual value, so the axis moves against it [inf]."
                " The export was told that a positive motion of the axis moves the tool point"
                f" {travel} the workpiece, so a correction of +1 um is K = {k_mm:+.3f} mm. Prove"
                f" it before anything else: all `trim_...` the same, at most {figure(trim_um)} um,"
                " which is the largest that this block takes, and a gauge (section 6)."
            ),
            (
                "**Who writes.** A block of your own copies the three outputs by FB3 PUT and reads"
                " them back by FB2 GET, through a variable list of the NC-VAR selector [V that FB2"
                " and FB3 do it, M how]. K0, slope **and reference position** of the same call"
                " belong into one PUT job: a K0 and slope with another reference position are"
                " another line, wrong by slope times the distance of the two. Where one job cannot"
                " take three, write SD43920 first and only while SD43910 is 0."
                " Start the next job only when done or error of the last one came; an error for"
                " longer than some seconds is `connected` FALSE; the first GET must have answered"
                " before `read_ok` is TRUE. Once per cycle of the block is often"
                " enough: temperatures need minutes [V]."
            ),
            (
                "**Range.** That block refuses to write what is no number or larger than"
                f" {k0_mm} mm and {slope} mm/mm: both follow from the limits of the"
                " corrections. In one call the line moves away from the one in the control by at"
                f" most {k0_step} mm of K0 and {slope_step} mm/mm of slope: it refuses a larger"
                " step too."
                " It writes only while `heartbeat` changes, and takes K0 and slope to"
                " zero in small steps otherwise."
            ),
            (
                "**Slope.** MD32760 `$MA_COMP_ADD_VELO_FACTOR` (default 0.01) limits the velocity"
                " that a compensation adds, and so the slope; a larger step is spread over"
                " interpolation cycles **without an alarm** [V]. The export refuses limits that"
                f" allow more than {line.velocity_factor:g}. Large changes between two writes mark"
                " the surface [V]."
            ),
            (
                "**Referenced.** The compensation acts on a referenced axis only [inf]: the signal"
                " belongs into `interlocks_met`. The position display does not show it [M]."
            ),
            (
                "**Line.** `residual_um` says how far the corrections lie from the straight line;"
                " the control cannot do better than that. Through two positions it is zero."
                " Outside the positions the line goes on straight: take positions near the ends of"
                " the travel."
            ),
        )
    )
    yield ""
    yield (
        "**Not verified:** none of this was tried on a control: names and bits are from the"
        " manual, sign and order of writing are not proven, data types, indices of axes and"
        " the behaviour after a reset are from memory."
    )


def _not_protected(facts: GuideFacts) -> Iterator[str]:
    yield (
        "The block does not know whether its inputs are wired to the sensors that the model means,"
        " whether the axis is referenced, whether the sign is right on this machine, whether"
        " another compensation acts that it is not told of, or whether the control adds what it is"
        " given. It cannot act once its PLC stops."
    )
    if facts.target.dialect == "c":
        yield (
            "Two threads that call the same instance at once, and a struct that was not"
            " initialised."
        )
