"""Fanuc: NC program of a plan for milling machines, and the stored pitch error compensation.

The table is a parameter file: the parameters 3620 to 3627 of the axis and one value for each
section of the grid, an increment of the correction seen from the negative side.

References
----------
Numbers of the points, their sections, and the values as increments: Fanuc parameter manual
B-63980EN (Series 0i-PB), p. 100 [V]. Frame and words of a parameter file: parameter manual
B-63330EN (Series 15i), p. 25 [V, its spindle form]. Parameters of the second table: technical
report A-77810E [V]; the sign of 3627 [M]. Ranges, units and the words of the program [M].
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from textwrap import wrap
from typing import final

import numpy as np

from thermaxis.controls._control import (
    LARGEST_TABLE_BYTES,
    Control,
    ControlOption,
    GridRule,
    ProgramRequest,
    ReadTable,
    TableRequest,
    TableText,
    check_points,
    comment_text,
    number_option,
    plain_number,
)
from thermaxis.controls._fanuc_points import (
    AXIS_LETTERS,
    LARGEST_MAGNIFICATION,
    STATION,
    TURN_DEG,
    PointOptions,
    PointValues,
    detection_unit,
    point_options,
    point_values,
)
from thermaxis.controls._program_head import check_motion, head_lines, move_comment, stop_time_s
from thermaxis.controls._program_words import check_range, feed_word, inward_positions
from thermaxis.errors import ConfigurationError, MeasurementFileError, printable
from thermaxis.positioning import CompensationTable, FloatArray, MoveBlock
from thermaxis.quantities import AxisKind

FIRST_POINT = 10_000
"""Word N of point number 0 in a parameter file; from memory. [1]"""
LARGEST_POSITION = 99_999.999
"""Largest position of a word in IS-B; from memory. [mm or deg]"""
LARGEST_FEED = 99_999.0
"""Largest feed of a word; from memory. [mm/min or deg/min]"""
LONGEST_DWELL_S = 99_999.999
"""Longest dwell of G04 in milliseconds; from memory. [s]"""
HIGHEST_PROGRAM = 7999
"""Highest number of a program that is not protected; from memory. [1]"""
LONGEST_LINE = 10_000
"""Longest line of a parameter file that is read; 32 axes take 400. [character]"""
LARGEST_BACKLASH = 9999
"""Largest magnitude of parameter 1851; from memory. [detection unit]"""

_DECIMALS = 3
_COMMENT_WIDTH = 64
_AUTO = "auto"
_POINT_COMMENT = re.compile(
    r"\(POINTS FROM (?P<first>-?[0-9.]{1,12}) TO (?P<last>-?[0-9.]{1,12})"
    r" REFERENCE (?P<reference>-?[0-9.]{1,12})\)"
)
_AXIS_COMMENT = re.compile(r"\(AXIS (?P<axis>[A-Z][A-Z0-9_]{0,15}) ")


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
    sign = (
        "A value is an increment of the correction, minus the deviation, seen from the negative"
        " side: positive where the axis must be moved further in positive direction [S]"
    )
    unit = "Values are whole numbers of the detection unit times the magnification"
    suffix = ".NC"
    options = (
        ControlOption(
            "program_number",
            "7000",
            "number O of the program, the next ones are subprograms",
            only_for="program",
        ),
        ControlOption(
            "call",
            "P",
            "P: M98 P with repetitions and program number in one word, Series 16i and later; L:"
            " M98 P L, Series 15 and the tape format of Series 10 and 11 [M]",
            ("P", "L"),
            "program",
        ),
        ControlOption(
            "work_offset",
            "G54",
            "work coordinate system, whose offsets must be zero",
            ("G54", "G55", "G56", "G57", "G58", "G59"),
            "program",
        ),
        ControlOption(
            "axis_number",
            _AUTO,
            "number of the axis on the control, parameter word A; auto: X 1, Y 2, Z 3, others 4",
            only_for="table",
        ),
        ControlOption(
            "detection_unit",
            "1",
            "detection unit of the axis, in 0.001 mm or 0.001 deg",
            only_for="table",
        ),
        ControlOption(
            "magnification",
            _AUTO,
            "parameter 3623, 1 to 100; auto: the smallest with which every value fits",
            only_for="table",
        ),
        ControlOption(
            "largest_value",
            "7",
            "largest magnitude of a point's value: 7, on newer controls 127 [M]",
            only_for="table",
        ),
        ControlOption(
            "max_points",
            "128",
            "largest number of points of an axis and direction [S]",
            only_for="table",
        ),
        ControlOption(
            "highest_point",
            "1023",
            "highest point number of the control, for all axes together [M]",
            only_for="table",
        ),
        ControlOption(
            "reference_point",
            _AUTO,
            "parameter 3620, point number of the reference position; auto: the axis with number a"
            " begins at (a - 1) times max_points, twice that with two tables",
            only_for="table",
        ),
        ControlOption(
            "reference_coordinate",
            "table",
            "machine coordinate of the reference position, mm or deg; table: where the table is"
            " zero, and in reading what the file's comment says",
            only_for="table",
        ),
        ControlOption(
            "bidirectional",
            "0",
            "1: a second table for the negative direction (parameters 3605#0, 3626, 3627), an"
            " option of the control",
            ("0", "1"),
            "table",
        ),
        ControlOption(
            "return_direction",
            "positive",
            "direction in which the axis returns to its reference position; only for two tables",
            ("positive", "negative"),
            "table",
        ),
        ControlOption(
            "modulo",
            "0",
            "1: a rotary axis that repeats after 360 deg (parameter 3625)",
            ("0", "1"),
            "table",
        ),
        ControlOption(
            "comments",
            "1",
            "1: comments in parentheses at the head; 0: none, where a control does not skip them"
            " [M]",
            ("0", "1"),
            "table",
        ),
    )

    def format_program(self, request: ProgramRequest) -> str:
        """Return the NC program of a plan.

        G code of milling machines in millimetres: one ``G1`` to a block, exact stop mode ``G61``,
        ``G04 P`` in milliseconds at each stop. Moves that are driven several times are a
        subprogram in the same file. ``G53`` moves in rapid traverse only [M], so that the program
        is in work coordinates.

        Parameters
        ----------
        request : ProgramRequest
            Plan, motion, axis and options.

        Returns
        -------
        str
            The program, between two lines ``%``.

        Raises
        ------
        ConfigurationError
            If the control has no such axis, a number does not fit its words, there are too many
            subprograms, or the travel is passed.
        """
        check_motion(request)
        axis = _program_axis(request.axis)
        for block in request.blocks:
            check_range(block, LARGEST_POSITION)
        seconds = stop_time_s(request.plan)
        if seconds > LONGEST_DWELL_S:
            raise ConfigurationError(
                f"a stop of {seconds:g} s is longer than the {LONGEST_DWELL_S:g} s of G04",
                where="dwell_s",
                remedy="Plan a shorter dwell",
            )
        number = number_option(request.options, "program_number", lowest=1, highest=HIGHEST_PROGRAM)
        if not number.is_integer():
            raise ConfigurationError("this is no whole number", where="--set program_number")
        program = int(number)
        feed = feed_word(request.plan.feed, LARGEST_FEED)
        main = [
            f"O{program:04d} (POSITIONING RUN)",
            *_comments(_program_remarks(request, self.title)),
            "G21",
            f"{request.options['work_offset']} G90 G94 G40 G49 G80",
            "G61",
        ]
        after: list[str] = []
        for block in request.blocks:
            moves = list(_moves(block, f"G1 {axis}", f" F{feed}", seconds))
            main += _comments([block.name])
            if block.repetitions == 1:
                main += moves
                continue
            program += 1
            main.append(_call(program, block.repetitions, request.options["call"]))
            after += [f"O{program:04d} ({block.name.upper()})", *moves, "M99"]
        if program > HIGHEST_PROGRAM:
            raise ConfigurationError(
                f"the last subprogram would be O{program}, beyond O{HIGHEST_PROGRAM}",
                where="--set program_number",
                remedy="State a lower number, or plan fewer targets for the step cycle",
            )
        main += ["G64", "M30"]
        return "".join(f"{line}\n" for line in ("%", *main, *after, "%"))

    def grid_rule(self, kind: AxisKind, options: Mapping[str, str]) -> GridRule:
        """Return the rule: equidistant points, one of them at the reference position.

        Parameters
        ----------
        kind : AxisKind
            Linear or rotary.
        options : mapping
            The control's options.

        Returns
        -------
        GridRule
            The rule. With a magnification chosen by the program the step of the values may be
            wider than its resolution.
        """
        chosen = point_options(kind, options)
        return GridRule(
            equidistant=True,
            most_points=chosen.most,
            per_direction=chosen.bidirectional,
            backlash_apart=not chosen.bidirectional,
            resolution=(chosen.magnification or 1) * chosen.unit,
            decimals=_DECIMALS,
            through_reference=True,
            remark=f"values up to {chosen.largest}, point numbers up to {chosen.highest} for all"
            " axes together; the axis is zero at its reference position",
        )

    def format_table(self, request: TableRequest) -> TableText:
        """Return the table as a parameter file.

        Parameters
        ----------
        request : TableRequest
            Values, origin and options.

        Returns
        -------
        TableText
            Parameters and point values between two lines ``%``, and what the user must know.

        Raises
        ------
        ConfigurationError
            If a limit of the control is exceeded, or no point lies at the reference position.
        """
        table = request.table
        chosen = point_options(table.kind, request.options)
        check_points(table, self.grid_rule(table.kind, request.options), self.title)
        letter = _program_axis(table.axis)
        number = chosen.axis_number or min(AXIS_LETTERS.index(letter) + 1, 4)
        points = point_values(table, chosen, number)
        if not chosen.comments and chosen.reference is None and points.reference != 0:
            raise ConfigurationError(
                "without comments the file cannot say where the reference position lies",
                where="--set comments",
                remedy=f"State --set reference_coordinate={points.reference:g} too, in reading"
                " again",
            )
        lines = ["%"]
        if chosen.comments:
            lines += _comments(_table_remarks(request, letter, points))
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
            sentences=(self.sign, self.unit, *_sentences(table, chosen, points, number)),
        )

    def read_table(
        self, text: str, path: str, kind: AxisKind, options: Mapping[str, str]
    ) -> ReadTable:
        """Read the pitch error compensation of one axis from a parameter file.

        Parameters
        ----------
        text : str
            Content of the file; parameters that have nothing to do with it are passed over.
        path : str
            Its name, for errors.
        kind : AxisKind
            Linear or rotary.
        options : mapping
            The control's options.

        Returns
        -------
        ReadTable
            Values as deviations, zero at the reference position, and findings.

        Raises
        ------
        MeasurementFileError
            If it is no such file, ``%`` is missing at its end, a word is no whole number, a
            parameter or point is missing or stated twice, or a value is beyond the control's.
        """
        chosen = point_options(kind, options)
        words = _words(text, path)
        return _Reading(path, words, chosen, _wanted_axis(path, words, chosen), kind).table()


CONTROL = Fanuc()
"""The control."""


# ---- program ------------------------------------------------------------------------------------


def _program_axis(name: str) -> str:
    letter = name.upper()
    if len(letter) != 1 or letter not in AXIS_LETTERS:
        raise ConfigurationError(
            f"'{printable(name, 40)}' is no axis of the control",
            where="axis",
            remedy=f"Give --axis with one of {', '.join(sorted(AXIS_LETTERS))}",
        )
    return letter


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


def _moves(block: MoveBlock, start: str, end: str, seconds: float) -> Iterator[str]:
    for move, position in zip(block.moves, inward_positions(block, _DECIMALS), strict=True):
        yield f"{start}{plain_number(position, _DECIMALS)}{end} ({move_comment(move).upper()})"
        if move.is_stop and seconds > 0:
            yield f"G04 P{int(np.ceil(1000.0 * seconds - 1e-6))}"


def _call(program: int, repetitions: int, form: str) -> str:
    if form == "L":
        return f"M98 P{program:04d} L{repetitions}"
    return f"M98 P{repetitions}{program:04d}"


# ---- table, writing -----------------------------------------------------------------------------


def _table_remarks(request: TableRequest, letter: str, points: PointValues) -> list[str]:
    table = request.table
    unit = table.kind.units.position_suffix
    return [
        "thermaxis stored pitch error compensation for Fanuc",
        f"axis {letter} {table.kind} {table.position.size} grid positions",
        "values are increments of the correction seen from the negative side",
        "positive moves the axis further in positive direction",
        (
            f"one is {plain_number(_step_of(table, points, request), 3)}"
            f" {table.kind.units.deviation_suffix}"
        ),
        f"zero at the reference position {plain_number(points.reference, 3)} {unit}",
        *([f"deviations {table.source}"] if table.source else []),
        *([f"run sha256 {table.run_sha256}"] if table.run_sha256 else []),
        *request.origin,
        "a wrong sign doubles the error. prove two points by a measurement",
        "parameter 3605 is not in this file",
    ]


def _step_of(table: CompensationTable, points: PointValues, request: TableRequest) -> float:
    return points.magnification * detection_unit(table.kind, request.options)


def _parameters(
    table: CompensationTable, chosen: PointOptions, points: PointValues
) -> Iterator[tuple[int, int]]:
    """Yield the axis' parameters and their values."""
    if table.backlash is not None:
        lost = round(-table.backlash / chosen.unit)
        if abs(lost) > LARGEST_BACKLASH:
            raise ConfigurationError(
                f"the reversal of {lost} detection units is beyond parameter 1851",
                where="backlash",
                remedy="Check the unit of the run",
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


def _sentences(
    table: CompensationTable, chosen: PointOptions, points: PointValues, number: int
) -> Iterator[str]:
    unit = table.kind.units
    step = points.magnification * chosen.unit
    largest = int(np.max(np.abs(points.values)))
    yield (
        f"Detection unit {chosen.unit:g} {unit.deviation}, magnification {points.magnification}:"
        f" one is {step:g} {unit.deviation}; the sum of the values departs by at most"
        f" {0.5 * step:g} {unit.deviation} from the correction at any point"
    )
    if points.magnification > 1 and chosen.magnification is None:
        yield (
            f"With the magnification 1 a value would pass {chosen.largest}: the rounding grew from"
            f" {0.5 * chosen.unit:g} to {0.5 * step:g} {unit.deviation}; more points, or"
            " largest_value=127 on a newer control, win it back"
        )
    end = points.first + chosen.tables * points.values.shape[0] - 1
    yield (
        f"It is for the axis with number {number}, and takes the point numbers {points.first} to"
        f" {end}, which no other axis may use; the reference position, at {points.reference:g}"
        f" {unit.position}, is point {points.reference_point}"
    )
    yield (
        f"Between the points some controls put out a value at once in the middle of its section"
        f" [S]: that adds up to {0.5 * largest * step:g} {unit.deviation} to a linear course"
    )
    yield (
        "It acts after switching off and on and returning to the reference position [S]; the"
        " control asks for the parameter write switch. Save its parameters first"
    )
    yield "Interval and turn are in 0.001 mm or deg, increment system IS-B [M]: check 3624 [M]"
    if chosen.bidirectional:
        yield (
            "Set bit 0 of parameter 3605 by hand: the file does not, for it holds other bits too;"
            " and set the backlash, 1851, to 0 [M]: the reversal is in the second table"
        )
        yield (
            f"Parameter 3627 is {points.offset}: what the other direction differs by at the"
            " reference position, in detection units and with this sign [M]"
        )
    elif table.backlash is not None:
        yield (
            f"Parameter 1851 is minus the mean reversal of {table.backlash:+.2f} {unit.deviation}:"
            " positive for lost motion [M]; 1852 for rapid traverse is not written"
        )
    else:
        yield "Reversal is parameter 1851 (and 1852 in rapid traverse) [M], which is not written"
    if table.kind is AxisKind.ROTARY and not chosen.modulo:
        yield "The rotary axis is taken as one with ends; with roll over give --set modulo=1"
    if chosen.comments:
        yield (
            "The head has comments in parentheses; that the control skips them in a parameter file"
            " is not certain [M]: --set comments=0 leaves them out"
        )


# ---- table, reading -----------------------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True)
class _Word:
    """One value of the file."""

    line: int
    text: str


@final
@dataclass(frozen=True, slots=True)
class _Words:
    """What a parameter file holds, by number N and axis A (0 where no axis is stated)."""

    values: Mapping[tuple[int, int], _Word]
    comments: tuple[str, ...]
    findings: tuple[str, ...]


_PARAMETERS = (1851, 3620, 3621, 3622, 3623, 3624, 3625, 3626, 3627)
_LINE = re.compile(r"N([0-9]{1,5})((?:[A-Z][^A-Z;]*)+)", re.ASCII)
_PAIR = re.compile(r"([A-Z])([^A-Z]*)")


def _error(path: str, what: str, line: int | None, remedy: str) -> MeasurementFileError:
    return MeasurementFileError(what, path=path, line=line, remedy=remedy)


def _words(text: str, path: str) -> _Words:
    """Return the words between the two ``%``."""
    if len(text) > LARGEST_TABLE_BYTES:
        raise _error(path, "the file is too large for a table", None, "Name the file alone")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    starts = [i for i, line in enumerate(lines) if line.strip().startswith("%")]
    if not starts or any(line.strip() for line in lines[: starts[0]]):
        raise _error(path, "the file does not begin with %", 1, "Give a Fanuc parameter file")
    if len(starts) < 2:
        raise _error(
            path, "the % at the end is missing: the file is cut short", len(lines), "Copy it whole"
        )
    values: dict[tuple[int, int], _Word] = {}
    comments: list[str] = []
    for number, line in enumerate(lines[: starts[1]], start=1):
        if number <= starts[0]:
            continue
        if len(line) > LONGEST_LINE:
            raise _error(
                path,
                f"the line is longer than {LONGEST_LINE} characters",
                number,
                "Give a Fanuc parameter file",
            )
        comments += re.findall(r"\([^()]*\)", line)
        bare = re.sub(r"\([^()]*\)", "", line).strip()
        for content in bare.removeprefix("%").split(";"):
            if content.strip():
                _add_words(path, number, content.strip(), values)
    findings: list[str] = []
    if any(line.strip() for line in lines[starts[1] + 1 :]):
        findings.append(f"what follows the % of line {starts[1] + 1} is not read")
    return _Words(values, tuple(comments), tuple(findings))


def _add_words(path: str, number: int, content: str, values: dict[tuple[int, int], _Word]) -> None:
    found = _LINE.fullmatch(re.sub(r"\s+", "", content).upper())
    if found is None:
        raise _error(
            path,
            f"'{printable(content[:99], 40)}' is no line of a parameter file",
            number,
            "Write N with the number and P with the value",
        )
    axis = 0
    for letter, word in _PAIR.findall(found[2]):
        if letter == "A":
            if not re.fullmatch(r"[0-9]{1,2}", word):
                raise _error(path, "the axis number A is no number", number, "Correct it")
            axis = int(word)
        elif letter == "P":
            key = (int(found[1]), axis)
            if key in values:
                raise _error(
                    path,
                    f"N{key[0]} stands there twice, first in line {values[key].line}",
                    number,
                    "Delete one of them",
                )
            values[key] = _Word(number, word)


def _wanted_axis(path: str, words: _Words, chosen: PointOptions) -> int:
    """Return the axis number whose compensation is read; 0 for words without axis numbers."""
    there = sorted({axis for number, axis in words.values if number == 3620})
    if not there:
        raise _error(
            path,
            "parameter 3620 is missing: the file has no pitch error compensation",
            None,
            "Give a file with the parameters 3620 to 3624 and the points N10000 and on",
        )
    if chosen.axis_number is None:
        if len(there) > 1:
            listed = ", ".join(map(str, there))
            raise _error(
                path,
                f"the file has the axes {listed}",
                None,
                "Say which with --set axis_number=NUMBER",
            )
        return there[0]
    if chosen.axis_number not in there and there != [0]:
        listed = ", ".join(map(str, there))
        raise _error(
            path,
            f"the file is for axis {listed}, not for {chosen.axis_number}",
            words.values[3620, there[0]].line,
            "Give the file of this axis, or another axis_number",
        )
    return chosen.axis_number if chosen.axis_number in there else 0


@final
@dataclass(frozen=True, slots=True)
class _Reading:
    """One axis of a parameter file on its way to a table."""

    path: str
    words: _Words
    chosen: PointOptions
    axis: int
    kind: AxisKind

    def table(self) -> ReadTable:
        """Return what the control would do with it."""
        findings = list(self.words.findings)
        if self.axis == 0:
            findings.append("the parameters name no axis number")
        step = self._length(3624)
        magnification = self._whole(3623)
        if not 1 <= magnification <= LARGEST_MAGNIFICATION:
            raise self._wrong(3623, f"the magnification is not 1 to {LARGEST_MAGNIFICATION}")
        reference, extent = self._place(findings)
        quantum = magnification * self.chosen.unit
        turns = self._turns()
        position, counted = self._positive_table(reference, step, turns=turns, findings=findings)
        kept = self._kept(position, counted, extent, turns=turns)
        largest = int(np.max(np.abs(np.diff(counted[:, 0])), initial=0))
        findings.append(
            "simulated as linear between the points; a control that puts out each value at once"
            f" adds up to {0.5 * largest * quantum:g} {self.kind.units.deviation} [S]"
        )
        offset = self._whole(3627) * self.chosen.unit if self.chosen.bidirectional else 0.0
        if not self.chosen.returns_positive:
            offset = -offset
        # the zero of the table is that of the mean of both directions
        deviation: FloatArray = np.stack(
            (0.5 * offset - quantum * counted[:, 0], -0.5 * offset - quantum * counted[:, 1]),
            axis=1,
        )
        return ReadTable(
            table=CompensationTable(
                kind=self.kind,
                axis=self._axis_name(),
                position=position[kept],
                deviation=deviation[kept],
                backlash=self._backlash(findings),
                reference_position=reference,
            ),
            findings=tuple(findings),
            resolution=quantum,
        )

    def _wrong(self, parameter: int, what: str) -> MeasurementFileError:
        line = self.words.values[parameter, self.axis].line
        return _error(self.path, what, line, f"Correct parameter {parameter}")

    def _word(self, parameter: int) -> _Word:
        word = self.words.values.get((parameter, self.axis))
        if word is None:
            raise _error(
                self.path,
                f"parameter {parameter} of the axis is missing",
                None,
                "Give the whole file",
            )
        return word

    def _whole(self, parameter: int) -> int:
        return self._as_whole(self._word(parameter))

    def _as_whole(self, word: _Word) -> int:
        if not re.fullmatch(r"[+-]?[0-9]{1,9}", word.text):
            comma = " (a decimal comma)" if "," in word.text else ""
            raise _error(
                self.path,
                f"'{printable(word.text[:99], 30)}' is no whole number{comma}",
                word.line,
                "Write the value in steps of the control, digits only",
            )
        return int(word.text)

    def _length(self, parameter: int) -> float:
        """Return an interval, whole numbers in 0.001, newer controls with a decimal point."""
        word = self._word(parameter)
        if re.fullmatch(r"\+?[0-9]{1,6}\.[0-9]{0,6}", word.text):
            value = float(word.text)
        else:
            value = self._as_whole(word) * STATION
        if not 0 < value <= LARGEST_POSITION:
            raise self._wrong(parameter, "the interval is not positive")
        return value

    def _turns(self) -> bool:
        """Return whether the axis repeats after a turn."""
        word = self.words.values.get((3625, self.axis))
        if word is None or not re.search("[1-9]", word.text):
            return False
        if abs(self._length(3625) - TURN_DEG) > 1e-9:
            raise self._wrong(3625, "the turn is not 360 deg")
        return True

    def _place(self, findings: list[str]) -> tuple[float, tuple[float, float] | None]:
        """Return where the reference position lies, and which grid positions were meant."""
        found = next(filter(None, map(_POINT_COMMENT.fullmatch, self.words.comments)), None)
        extent = None
        reference = self.chosen.reference
        if found is not None:
            try:
                first, last, place = (float(found[g]) for g in ("first", "last", "reference"))
            except ValueError:
                findings.append("the comment on the points is no longer readable")
            else:
                extent = (first, last)
                if reference is not None and abs(reference - place) > 1e-6:
                    findings.append(f"the file's comment has the reference position at {place:g}")
                    extent = None
                reference = place if reference is None else reference
        if reference is None:
            findings.append(
                "the file does not say where the reference position lies: 0 is taken; state"
                " --set reference_coordinate if it is elsewhere"
            )
            reference = 0.0
        return reference, extent

    def _positive_table(
        self, reference: float, step: float, *, turns: bool, findings: list[str]
    ) -> tuple[FloatArray, FloatArray]:
        """Return grid positions and the sums of the values from the reference position, (k, 2)."""
        at, first, last = (self._whole(p) for p in (3620, 3621, 3622))
        if not first - 1 <= at <= last or last > 9999:
            raise self._wrong(3621, f"the points {first} to {last} do not lead to {at}")
        sides = [self._points(first, last)]
        if self.chosen.bidirectional:
            start = self._whole(3626)
            sides.append(self._points(start, start + last - first))
        elif (3626, self.axis) in self.words.values and self._whole(3626) != 0:
            findings.append(
                "the file has a second table (3626), which is not simulated: state"
                " --set bidirectional=1 if the control uses it"
            )
        sums: list[FloatArray] = []
        for values in sides:
            run = np.concatenate(([0.0], np.cumsum(values)))
            if turns:
                if values[0] != values[-1]:
                    findings.append("the first and the last point of the turn differ")
                run = run[1:] - run[1]
                if run[-1] != 0:
                    findings.append(
                        f"the values of a turn add up to {run[-1]:g}, not to 0: the position"
                        " shifts with every turn"
                    )
            sums.append(run if turns else run - run[at - first + 1])
        before = at - first + 1
        if turns:
            if at != first or abs((last - first) * step - TURN_DEG) > 1e-6:
                raise self._wrong(3622, "the points of a turn do not begin at 3620 and span 360")
            before = 0
        position: FloatArray = reference + step * (
            np.arange(sums[0].size, dtype=np.float64) - before
        )
        return np.round(position, 6), np.stack((sums[0], sums[-1]), axis=1)

    def _points(self, first: int, last: int) -> list[int]:
        values: list[int] = []
        for point in range(first, last + 1):
            word = self.words.values.get((FIRST_POINT + point, 0))
            if word is None:
                raise _error(
                    self.path,
                    f"point {point} (N{FIRST_POINT + point}) is missing: the control would keep"
                    " its old value",
                    None,
                    "Give all points from 3621 to 3622, and of the second table as many",
                )
            value = self._as_whole(word)
            if abs(value) > self.chosen.largest:
                raise _error(
                    self.path,
                    f"the value {value} is beyond the {self.chosen.largest} that a point can hold",
                    word.line,
                    "State --set largest_value if the control holds more",
                )
            values.append(value)
        return values

    def _kept(
        self,
        position: FloatArray,
        counted: FloatArray,
        extent: tuple[float, float] | None,
        *,
        turns: bool,
    ) -> slice:
        """Return the grid positions that are more than a way to the reference position."""
        if extent is not None:
            inside = np.flatnonzero((position >= extent[0] - 1e-3) & (position <= extent[1] + 1e-3))
            if inside.size >= 2:
                return slice(int(inside[0]), int(inside[-1]) + 1)
        flat = not bool(np.any(np.diff(counted[:2], axis=0)))
        if not turns and position.size > 2 and flat and self._whole(3620) == self._whole(3621):
            return slice(1, None)  # the number of the reference position alone, without a value
        return slice(None)

    def _backlash(self, findings: list[str]) -> float | None:
        if (1851, self.axis) not in self.words.values:
            return None
        lost = self._whole(1851) * self.chosen.unit
        if self.chosen.bidirectional and lost != 0:
            findings.append("the backlash (1851) acts beside the second table: it should be 0 [M]")
        return -lost

    def _axis_name(self) -> str:
        found = next(filter(None, map(_AXIS_COMMENT.match, self.words.comments)), None)
        return "" if found is None else found["axis"]
