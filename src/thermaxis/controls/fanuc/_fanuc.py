"""Fanuc: NC programs of plan and touch for milling machines, and stored pitch error compensation.

The table is a parameter file: the parameters 3620 to 3627 of the axis and one value for each
section of the grid, an increment of the correction seen from the negative side.

References
----------
Numbers of the points, their sections, and the values as increments: Fanuc parameter manual
B-63980EN (Series 0i-PB), p. 100 [V]. Frame and words of a parameter file: parameter manual
B-63330EN (Series 15i), p. 25 [V, its spindle form]. Parameters of the second table: technical
report A-77810E [V]; the sign of 3627 [M]. Ranges, units and the words of the program [M].
"""

from collections.abc import Iterator, Mapping
from textwrap import wrap
from typing import final

import numpy as np

from thermaxis.codes import Message
from thermaxis.controls._control import (
    Control,
    GridRule,
    HeatingWords,
    ProgramRequest,
    ReadTable,
    TableRequest,
    TableText,
    TouchRequest,
    advice,
    axis_letter,
    check_points,
    comment_text,
    options_of,
    plain_number,
    whole_option,
)
from thermaxis.controls._program import (
    MoveWords,
    check_dwell,
    check_motion,
    feed_word,
    head_lines,
    move_lines,
    stop_time_s,
)
from thermaxis.controls._touch import NEAR_MM, touch_head
from thermaxis.controls.fanuc._points import (
    AXIS_LETTERS,
    FIRST_POINT,
    LARGEST_POSITION,
    STATION,
    TURN_DEG,
    PointOptions,
    PointValues,
    point_options,
    point_values,
    whole_or_none,
)
from thermaxis.controls.fanuc._reading import table_from_parameters
from thermaxis.errors import ConfigurationError
from thermaxis.positioning import CompensationTable
from thermaxis.quantities import AxisKind

LARGEST_FEED = 99_999.0
"""Largest feed of a word; from memory. [mm/min or deg/min]"""
LONGEST_DWELL_S = 99_999.999
"""Longest dwell of G04 in milliseconds; from memory. [s]"""
HIGHEST_PROGRAM = 7999
"""Highest number of a program that is not protected; from memory. [1]"""
LARGEST_BACKLASH = 9999
"""Largest magnitude of parameter 1851; from memory. [detection unit]"""

_DECIMALS = 3
_COMMENT_WIDTH = 64


@final
class Fanuc(Control):
    """Fanuc Series 16i, 18i, 21i and 0i, and later ones that read their files.

    Not protected: a program moves one axis in work coordinates, which are machine coordinates only
    while its offsets are zero; nothing in the program checks that. It is for milling machines: on
    a lathe G90 and G94 may be cutting cycles. A table has no switch of its own on the control: it
    acts after the next start and reference return. Its sign, units and ranges are from secondary
    sources and memory; whether they fit is shown by a measurement only. No machine has proven
    either yet.
    """

    title = "Fanuc 16i, 18i, 21i, 0i"
    sign = advice("fanuc_sign")
    unit = advice("fanuc_unit")
    options = options_of("fanuc")
    heating = HeatingWords(
        first=("%", "O{program_number} (THERMAL TEST)"),
        upper_case=True,
        comment="({})",
        begin=("G21", "{work_offset} G90 G94 G40 G49 G80", "G61"),
        end=("G64", "M30", "%"),
        spindle=("S{speed} M03",),
        spindle_stop=("M05",),
        spindles=1,
        move="G1 {axis}{mm:.3f} F{feed}",
        loop=(("#1=1", "WHILE[#1LE{times}]DO1"), ("#1=#1+1", "END1")),
        dwell=("G04 P{ms}",),
        longest_dwell_s=99_999.0,
    )

    def format_program(self, request: ProgramRequest) -> str:
        """Return the NC program of a plan.

        G code of milling machines in millimetres: one ``G1`` to a block, exact stop mode ``G61``,
        ``G04 P`` in milliseconds at each stop. Moves that are driven several times are a
        subprogram in the same file. ``G53`` moves in rapid traverse only [M], so that the program
        is in work coordinates.
        """
        check_motion(request, largest=LARGEST_POSITION)
        check_dwell(request.plan, LONGEST_DWELL_S, "G04")
        axis = axis_letter(request.axis, AXIS_LETTERS)
        program = whole_option(request.options, "program_number", lowest=1, highest=HIGHEST_PROGRAM)
        words = _move_words(request, axis)
        main = [
            f"O{program:04d} (POSITIONING RUN)",
            *_comments(_program_remarks(request, self.title)),
            "G21",
            f"{request.options['work_offset']} G90 G94 G40 G49 G80",
            "G61",
        ]
        after: list[str] = []
        for block in request.blocks:
            moves = [line.upper() for line in move_lines(block, words)]
            main += _comments([block.name])
            if block.repetitions == 1:
                main += moves
                continue
            program += 1
            main.append(_call(program, block.repetitions, request.options["call"]))
            after += [f"O{program:04d} ({block.name.upper()})", *moves, "M99"]
        if program > HIGHEST_PROGRAM:
            raise ConfigurationError(
                "program_number_too_high",
                last=program,
                highest=HIGHEST_PROGRAM,
                key="--set program_number",
            )
        main += ["G64", "M30"]
        return "".join(f"{line}\n" for line in ("%", *main, *after, "%"))

    def format_touch(self, request: TouchRequest) -> str:
        """Return a macro that touches by ``G31``, the skip function, and a program that calls it.

        Moves are incremental, from the machine position that the control has to the next, so that
        no offset matters; ``G53`` alone ends a move before its macro statements [S]. A skip
        position at an end of the search is no touch.
        """
        axis = axis_letter(request.axis, AXIS_LETTERS)
        number = whole_or_none(request.options, "axis_number", 1, 32) or _usual_number(axis)
        program = whole_option(
            request.options, "program_number", lowest=1, highest=HIGHEST_PROGRAM - 1
        )
        v = whole_option(request.options, "result", lowest=100, highest=997)
        result = f"variables {v} value {v + 1} counter {v + 2} reading"
        head = touch_head(request, comment_text(self.title), result)
        start, end, feed = request.start_mm, request.end_mm, f"F{request.feed_mm_per_min:g}"
        machine, work, skip = (f"#{first + number}" for first in (5020, 5040, 5060))
        to_start = (f"G1 {axis}[{start:.3f}-{machine}] {feed}", "G53")
        call, pause = f"G65 P{program + 1:04d}", f"G04 P{int(np.ceil(1000.0 * request.pause_s))}"
        lines = [
            *("%", f"O{program:04d} (TOUCH)", *_comments(head), call, "#1=1"),
            *(f"WHILE[#1LT{request.touches}]DO1", pause, call, "#1=#1+1", "END1", "M30"),
            f"O{program + 1:04d} (TOUCH ONCE)",
            *("M05", "G21", "G91 G94 G40 G80", "G61", "G53", *to_start),
            f"IF[ABS[{machine}{-start:+.3f}]GT{NEAR_MM}]GOTO83",
            *(f"#1={work}-{machine}", f"G31 {axis}{end - start:.3f} {feed}", "G53"),
            *(f"#2={skip}-#1", *to_start),
            f"IF[ABS[#2{-end:+.3f}]LT{NEAR_MM}]GOTO81",
            f"IF[ABS[#2{-start:+.3f}]LT{NEAR_MM}]GOTO82",
            *(f"#{v + 2}=#2", f"#{v}=1000*[{request.surface_mm:.3f}-#2]"),
            *(f"#{v + 1}=#{v + 1}+1", "G90 G64", "M99"),
            "N81 #3000=81(NO TOUCH)",
            "N82 #3000=82(PROBE WAS DEFLECTED)",
            *("N83 #3000=83(AXIS IS NOT AT START)", "%"),
        ]
        return "".join(f"{line}\n" for line in lines)

    def grid_rule(self, kind: AxisKind, options: Mapping[str, str]) -> GridRule:
        """Return the rule: equidistant points, one of them at the reference position."""
        chosen = point_options(kind, options)
        return GridRule(
            equidistant=True,
            most_points=chosen.most,
            per_direction=chosen.bidirectional,
            backlash_apart=not chosen.bidirectional,
            resolution=(chosen.magnification or 1) * chosen.unit,
            decimals=_DECIMALS,
            through_reference=True,
            advice=advice("fanuc_limits", largest=chosen.largest, highest=chosen.highest),
        )

    def format_table(self, request: TableRequest) -> TableText:
        """Return the table as a parameter file."""
        table = request.table
        chosen = point_options(table.kind, request.options)
        check_points(table, self.grid_rule(table.kind, request.options), self.title)
        letter = axis_letter(table.axis, AXIS_LETTERS)
        number = chosen.axis_number or _usual_number(letter)
        points = point_values(table, chosen, number)
        if not chosen.comments and chosen.reference is None and points.reference != 0:
            raise ConfigurationError(
                "reference_needs_comment", reference=points.reference, key="--set comments"
            )
        lines = ["%"]
        if chosen.comments:
            step = points.magnification * chosen.unit
            lines += _comments(_table_remarks(request, letter, points, step))
            first, last = (plain_number(float(table.position[i]), 3) for i in (0, -1))
            place = plain_number(points.reference, 3)
            lines.append(f"(POINTS FROM {first} TO {last} REFERENCE {place})")
        for parameter, value in _parameters(table, chosen, points):
            lines.append(f"N{parameter:05d}A{number}P{value}")
        for side, start in enumerate((points.first, points.second)[: chosen.tables]):
            for i, value in enumerate(points.values[:, side].tolist()):
                lines.append(f"N{FIRST_POINT + (start or 0) + i:05d}P{value}")
        lines.append("%")
        return TableText(
            text="".join(f"{line}\n" for line in lines),
            advice=tuple(_advice(table, chosen, points, number)),
        )

    def read_table(
        self, text: str, path: str, kind: AxisKind, options: Mapping[str, str]
    ) -> ReadTable:
        """Read the pitch error compensation of one axis from a parameter file."""
        chosen = point_options(kind, options)
        return table_from_parameters(text, path, kind, chosen)


CONTROL = Fanuc()
"""The control."""


def _usual_number(letter: str) -> int:
    return min(AXIS_LETTERS.index(letter) + 1, 4)


# ---- program ------------------------------------------------------------------------------------


def _comments(lines: list[str]) -> list[str]:
    short = [part for line in lines for part in wrap(comment_text(line, 100), _COMMENT_WIDTH)]
    return [f"({part.upper()})" for part in short]


def _program_remarks(request: ProgramRequest, title: str) -> list[str]:
    offset = request.options["work_offset"]
    remarks = [
        *head_lines(request, comment_text(title)),
        "the axis moves at the feed from where it stands. clear its way first",
        f"positions are work coordinates of {offset}",
        f"set the axis to zero in {offset} and in the external offset. no G52 no G92",
        "for milling machines. on a lathe G90 and G94 may be cutting cycles",
    ]
    if request.travel is not None:
        remarks.append("WARNING the check of the travel holds for zero offsets only")
    if request.plan.kind is AxisKind.ROTARY:
        remarks.append("roll over to the shortest way must be off. it turns the approach around")
    return remarks


def _move_words(request: ProgramRequest, axis: str) -> MoveWords:
    seconds = stop_time_s(request.plan)
    feed = feed_word(request.plan, decimals=_DECIMALS, largest=LARGEST_FEED)
    return MoveWords(
        start=f"G1 {axis}",
        end=f" F{feed}",
        comment="({})",
        dwell=(f"G04 P{int(np.ceil(1000.0 * seconds - 1e-6))}",) if seconds > 0 else (),
        decimals=_DECIMALS,
        position=lambda place: plain_number(place, _DECIMALS),
    )


def _call(program: int, repetitions: int, form: str) -> str:
    if form == "L":
        return f"M98 P{program:04d} L{repetitions}"
    return f"M98 P{repetitions}{program:04d}"


# ---- table, writing -----------------------------------------------------------------------------


def _table_remarks(
    request: TableRequest, letter: str, points: PointValues, step: float
) -> list[str]:
    table = request.table
    unit = table.kind.units.position_suffix
    return [
        "thermaxis stored pitch error compensation for Fanuc",
        f"axis {letter} {table.kind} {table.position.size} grid positions",
        "values are increments of the correction seen from the negative side",
        "positive moves the axis further in positive direction",
        f"one is {plain_number(step, 3)} {table.kind.units.deviation_suffix}",
        f"zero at the reference position {plain_number(points.reference, 3)} {unit}",
        *([f"deviations {table.source}"] if table.source else []),
        *([f"run sha256 {table.run_sha256}"] if table.run_sha256 else []),
        *request.origin,
        "a wrong sign doubles the error. prove two points by a measurement",
        "parameter 3605 is not in this file",
    ]


def _parameters(
    table: CompensationTable, chosen: PointOptions, points: PointValues
) -> Iterator[tuple[int, int]]:
    """Yield the axis' parameters and their values."""
    if table.backlash is not None:
        # two tables hold all reversal themselves
        lost = 0 if chosen.bidirectional else round(-table.backlash / chosen.unit)
        if abs(lost) > LARGEST_BACKLASH:
            raise ConfigurationError(
                "reversal_too_large",
                reversal_units=lost,
                largest_units=LARGEST_BACKLASH,
                key="backlash",
            )
        yield 1851, lost
    yield 3620, points.reference_point
    yield 3621, points.first
    yield 3622, points.last
    yield 3623, points.magnification
    yield 3624, points.interval
    if table.kind is AxisKind.ROTARY:
        yield 3625, round(TURN_DEG / STATION) if chosen.modulo else 0
    if points.second is not None:
        yield 3626, points.second
        yield 3627, points.offset


def _advice(
    table: CompensationTable, chosen: PointOptions, points: PointValues, number: int
) -> Iterator[Message]:
    unit = table.kind.units
    yield from _on_rounding(chosen, points, unit.deviation)
    yield advice(
        "fanuc_numbers",
        number=number,
        first=points.first,
        last=points.first + chosen.tables * points.values.shape[0] - 1,
        reference=points.reference,
        position_unit=unit.position,
        reference_point=points.reference_point,
    )
    yield advice("fanuc_activation")
    yield advice("fanuc_increments")
    yield from _on_reversal(table, chosen, points)
    if table.kind is AxisKind.ROTARY and not chosen.modulo:
        yield advice("fanuc_ends")
    if chosen.comments:
        yield advice("fanuc_comments")


def _on_rounding(chosen: PointOptions, points: PointValues, unit: str) -> Iterator[Message]:
    step = points.magnification * chosen.unit
    half = 0.5 * step
    yield advice(
        "fanuc_rounding",
        detection_unit=chosen.unit,
        magnification=points.magnification,
        step=step,
        half=half,
        unit=unit,
    )
    if points.magnification > 1 and chosen.magnification is None:
        before = 0.5 * chosen.unit
        yield advice("fanuc_magnified", largest=chosen.largest, before=before, half=half, unit=unit)
    largest = int(np.max(np.abs(points.values)))
    yield advice("fanuc_at_once", most=largest * half, unit=unit)


def _on_reversal(
    table: CompensationTable, chosen: PointOptions, points: PointValues
) -> Iterator[Message]:
    backlash, unit = table.backlash, table.kind.units.deviation
    if chosen.bidirectional:
        yield advice("fanuc_second_table_bit")
        if backlash is None:
            yield advice("fanuc_backlash_by_hand")
        elif backlash:
            yield advice("fanuc_backlash_moved", moved=backlash, unit=unit)
        else:
            yield advice("fanuc_backlash_zero")
        yield advice("fanuc_offset", offset=points.offset)
    elif backlash is not None:
        yield advice("fanuc_backlash", backlash=backlash, unit=unit)
    else:
        yield advice("fanuc_no_backlash")
