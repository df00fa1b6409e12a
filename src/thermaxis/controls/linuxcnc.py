"""LinuxCNC: G-code of plan and touch, and the screw compensation table (COMP_FILE, types 0 and 1).

The table is a bare list of ``nominal forward reverse``: no head, no comment, no blank line, for
the control stops reading at the first line that is no triplet and reports nothing.

References
----------
LinuxCNC at commit 5c41560e: ``src/emc/motion/usrmotintf.cc`` (``usrmotLoadComp``), ``command.c``,
``control.c`` (``compute_screw_comp``), ``motion.h``; LinuxCNC user manual, G-code reference.
"""

import itertools
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.codes import Message, Place
from thermaxis.controls._control import (
    BYTE_ORDER_MARKS,
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
    check_size,
    finding,
    options_of,
    plain_number,
    whole_option,
)
from thermaxis.controls._program import (
    MoveWords,
    block_lines,
    check_motion,
    feed_word,
    head_lines,
    stop_time_s,
)
from thermaxis.controls._touch import NEAR_MM, touch_head
from thermaxis.errors import ConfigurationError, MeasurementFileError
from thermaxis.positioning import CompensationTable, FloatArray
from thermaxis.quantities import AxisKind

MOST_POINTS = 256
"""Entries that one joint holds, ``EMCMOT_COMP_SIZE``. [1]"""
LONGEST_LINE = 253
"""Longest line before its newline that the control reads in one piece, a carriage return counted;
measured on LinuxCNC 2.9.0. [character]"""
LARGEST_NUMBER = 1e6
"""Largest magnitude of a number that is read: no axis has more. [mm, inch or deg]"""
NEAREST = 1e-9
"""Least distance of two points that are read: no axis resolves it. [mm, inch or deg]"""

_INCH_MM = 25.4
_LINEAR_AXES, _ROTARY_AXES = "XYZUVW", "ABC"
_FIRST_LOOP = 100
_OFFSET_AXES = "XYZABCUVW"  # in the order of #5061 and #5420
_SIDES = ("forward", "reverse")

# atomic: as sscanf, a number takes what it can and gives nothing back
_NUMBER = r"\s*+((?>[+-]?(?:[0-9]++(?:\.[0-9]*+)?|\.[0-9]++)(?:[eE][+-]?[0-9]++)?))"
_TRIPLET = re.compile(_NUMBER * 3, re.ASCII)
_NOT_FINITE = re.compile(r"[+-]?(?:inf|nan)", re.ASCII | re.IGNORECASE)

_OUTLIER_FACTOR = 10.0
_LEAST_SCALE = 1.0  # µm or arcsec; smaller steps between neighbours are never called typing errors
_WRONG_TYPE_FACTOR = 10.0
_CANDIDATES = 5  # a wrong value, and two on each side that it makes look wrong
_NAMED = 5  # in the findings


@final
@dataclass(frozen=True, slots=True)
class _Row:
    line: int
    nominal: float
    values: tuple[float, float]
    words: tuple[str, ...]


@final
class LinuxCnc(Control):
    """LinuxCNC 2.8 and later.

    Not protected: the interpreter knows nothing of what stands in the way of the axis. A table
    moves the motor without changing the position that is shown, and soft limits do not see it;
    LinuxCNC reads it once, at its start. Sign and type are proven by a measurement only.
    """

    title = "LinuxCNC"
    sign = advice("linuxcnc_sign")
    unit = advice("linuxcnc_unit")
    options = options_of("linuxcnc")
    heating = HeatingWords(
        comment="({})",
        begin=("G21 G90 G94 G40 G49 G80", "G61.1"),
        end=("M2",),
        spindle=("S{speed} ${k}", "M3 ${k}"),
        spindle_stop=("M5 ${k}",),
        spindles=8,
        move="G53 G1 {axis}{mm:.3f} F{feed}",
        loop=(("o{number} repeat [{times}]",), ("o{number} endrepeat",)),
        dwell=("G4 P{s}",),
        longest_dwell_s=99_999.0,
    )

    def format_program(self, request: ProgramRequest) -> str:
        """Return the G-code of a plan.

        One move to a line, ``G53 G1``, in exact stop mode G61.1; a repeated block is an
        ``o... repeat`` loop. No rapid moves: the way to the first position is driven at the feed.
        """
        plan = request.plan
        rotary = plan.kind is AxisKind.ROTARY
        axis = axis_letter(request.axis, _ROTARY_AXES if rotary else _LINEAR_AXES)
        check_motion(request)
        lines = [f"({line})" for line in head_lines(request, self.title)]
        lines += ["G21 G90 G94 G40 G49 G80", "G61.1", f"F{feed_word(plan)}"]
        machine = request.options.get("coordinates", "machine") == "machine"
        words = MoveWords(
            start=f"G53 G1 {axis}" if machine else f"G1 {axis}",
            comment="({})",
            dwell=(f"G4 P{plain_number(stop_time_s(plan), 3)}",),
        )
        for number, block in enumerate(request.blocks, start=_FIRST_LOOP):
            loop = (f"o{number} repeat [{block.repetitions}]", f"o{number} endrepeat")
            lines += block_lines(block, words, loop)
        lines.append("M2")
        return "".join(line + self.newline for line in lines)

    def format_touch(self, request: TouchRequest) -> str:
        """Return a subroutine that touches by ``G38.3``, and a program that calls it.

        The search is incremental, and the reading is the way since the start: no offset matters.
        ``M66`` keeps the interpreter from the rest until the axis has gone back. ``G38.3`` takes a
        probe that is deflected before for a touch at the start [V].
        """
        axis = axis_letter(request.axis, _LINEAR_AXES)
        pin = whole_option(request.options, "output", lowest=0, highest=62)
        result = f"motion.analog-out-{pin:02d} value motion.analog-out-{pin + 1:02d} counter"
        head = touch_head(request, self.title, result)
        number, name = _OFFSET_AXES.index(axis), f"touch_{axis.lower()}"
        start, counter = f"{request.start_mm:.3f}", f"#<_{name}_counter>"
        refusal = "o{0} if [{1}]", "(ABORT, {2})", "o{0} endif"
        turned = 101, "#[5210 + 20 * #5220] NE 0", "the work coordinates are rotated"
        untouched = 103, "#<touched> EQ 0", "no touch within the search"
        deflected = 104, f"ABS[#<way>] LT {NEAR_MM}", "the probe was deflected before"
        lines = [
            *(f"({line})" for line in head),
            f"o<{name}> sub",
            *("M73", "G21 G90 G94 G40 G80 G61.1", "M5 $-1", f"F{request.feed_mm_per_min:g}"),
            *(line.format(*turned) for line in refusal),
            *(f"o102 if [EXISTS[{counter}] EQ 0]", f"{counter} = 0", "o102 endif"),
            f"G53 G1 {axis}{start}",
            f"#<start> = #{5420 + number}",
            *(f"G91 G38.3 {axis}{request.end_mm - request.start_mm:.3f}", "G90"),
            *("#<touched> = #5070", f"#<way> = [#{5061 + number} - #<start>]"),
            *(f"G53 G1 {axis}{start}", "M66 E0 L0"),
            *(line.format(*case) for case in (untouched, deflected) for line in refusal),
            f"#<_{name}_reading> = [{start} + #<way>]",
            f"{counter} = [{counter} + 1]",
            f"M68 E{pin} Q[1000 * [{request.surface_mm:.3f} - #<_{name}_reading>]]",
            f"M68 E{pin + 1} Q{counter}",
            *(f"o<{name}> endsub", f"o<{name}> call"),
            f"o100 repeat [{request.touches - 1}]",
            *(f"G4 P{request.pause_s:.3f}", f"o<{name}> call", "o100 endrepeat", "M2"),
        ]
        return "".join(line + self.newline for line in lines)

    def grid_rule(self, kind: AxisKind, options: Mapping[str, str]) -> GridRule:
        """Return the rule: up to 256 points anywhere, a value for each direction."""
        unit, decimals = _unit_and_decimals(kind, options)
        return GridRule(
            equidistant=False,
            most_points=MOST_POINTS,
            per_direction=True,
            backlash_apart=False,
            resolution=unit * 10.0**-decimals,
            decimals=4,
            advice=advice("linuxcnc_backlash"),
        )

    def format_table(self, request: TableRequest) -> TableText:
        """Return a table as a COMP_FILE."""
        table, options = request.table, request.options
        check_points(table, self.grid_rule(table.kind, options), self.title)
        unit, decimals = _unit_and_decimals(table.kind, options)
        length = unit / table.kind.units.deviations_per_position
        nominal = np.round(table.position / length, decimals)
        if bool(np.any(np.diff(nominal) <= 0)):
            raise ConfigurationError("points_fall_together", decimals=decimals, key="points")
        half = 0.0 if table.backlash is None else 0.5 * table.backlash
        deviation = (table.deviation + np.array([half, -half])) / unit
        values = nominal[:, np.newaxis] + deviation if _type(options) == "0" else -deviation
        rows = (
            " ".join(plain_number(number, decimals) for number in (place, *pair))
            for place, pair in zip(nominal.tolist(), values.tolist(), strict=True)
        )
        return TableText(
            text="".join(row + self.newline for row in rows),
            advice=tuple(_advice(table, options, decimals)),
        )

    def read_table(
        self, text: str, path: str, kind: AxisKind, options: Mapping[str, str]
    ) -> ReadTable:
        """Read a COMP_FILE by the control's own rule: up to the first line that is no triplet.

        Only a newline ends a line; a carriage return is a blank, and a byte order mark a letter.
        """
        check_size(text, path)
        lines = text.split("\n")
        rows, findings = _read_rows(lines, path)
        _check_rows(rows, path)
        unit, _ = _unit_and_decimals(kind, options)
        position = np.array([row.nominal for row in rows])
        value = np.array([row.values for row in rows])
        _check_type(position, value, path, _type(options))
        trim = value if _type(options) == "1" else position[:, np.newaxis] - value
        deviation = -trim * unit
        table = CompensationTable(
            kind=kind,
            axis="",
            position=position * (unit / kind.units.deviations_per_position),
            deviation=deviation,
        )
        findings += _typing_errors(rows, position, deviation, kind)
        held = sum(_TRIPLET.match(line) is not None for line in re.split(r"[\r\n]", text))
        return ReadTable(table=table, findings=tuple(findings), points_in_file=max(held, len(rows)))


CONTROL = LinuxCnc()
"""The control."""


def _type(options: Mapping[str, str]) -> str:
    return options.get("type", "0")


def _unit_and_decimals(kind: AxisKind, options: Mapping[str, str]) -> tuple[float, int]:
    """Return one unit of the file in µm or arcsec, and the decimals that are written."""
    if kind is AxisKind.ROTARY:
        return kind.units.deviations_per_position, 7
    if options.get("units", "mm") == "inch":
        return _INCH_MM * kind.units.deviations_per_position, 8
    return kind.units.deviations_per_position, 6


# ---- table ------------------------------------------------------------------------------------


def _advice(
    table: CompensationTable, options: Mapping[str, str], decimals: int
) -> Iterator[Message]:
    kind, name = table.kind, "deg" if table.kind is AxisKind.ROTARY else options["units"]
    step = 10.0**-decimals * _unit_and_decimals(kind, options)[0]
    yield advice("linuxcnc_trims" if _type(options) == "1" else "linuxcnc_positions")
    yield advice(
        "linuxcnc_rounding",
        name=name,
        digit=plain_number(10.0**-decimals, decimals),
        step=f"{step:.2g}",
        unit=kind.units.deviation,
    )
    yield advice("linuxcnc_no_comment")
    yield advice("linuxcnc_activation", type=_type(options))
    yield advice("linuxcnc_reserve")


# ---- reading ------------------------------------------------------------------------------------


def _read_rows(lines: list[str], path: str) -> tuple[list[_Row], list[Message]]:
    rows: list[_Row] = []
    findings: list[Message] = []
    for number, line in enumerate(lines, start=1):
        _check_length(line, number, path, ended=number < len(lines))
        triplet = _TRIPLET.match(line)
        if triplet is None:
            findings += _stopped(lines, number, len(rows), path)
            break
        findings += _behind(line[triplet.end() :], number, path)
        words = triplet.groups()
        nominal, forward, reverse = (float(word) for word in words)
        if not all(abs(value) <= LARGEST_NUMBER for value in (nominal, forward, reverse)):
            raise _not_finite(path, number)
        rows.append(_Row(number, nominal, (forward, reverse), words))
        if len(rows) > MOST_POINTS:
            break
    if not rows:
        marked = lines[0].startswith(BYTE_ORDER_MARKS)
        raise MeasurementFileError(
            "byte_order_mark" if marked else "first_line_no_triplet", file=path, line=1
        )
    return rows, findings


def _check_length(line: str, number: int, path: str, *, ended: bool) -> None:
    """Refuse a line that does not fit the control's buffer together with its newline."""
    if len(line) <= (LONGEST_LINE if ended else LONGEST_LINE + 1):
        return
    returns = "\r" in line.removesuffix("\r")
    raise MeasurementFileError(
        "line_ended_by_return" if returns else "table_line_too_long",
        most=LONGEST_LINE,
        file=path,
        line=number,
    )


def _not_finite(path: str, line: int) -> MeasurementFileError:
    return MeasurementFileError("number_not_loadable", largest=LARGEST_NUMBER, file=path, line=line)


def _stopped(lines: list[str], number: int, read: int, path: str) -> list[Message]:
    """Say what the control leaves unread behind a line that is no triplet."""
    line = lines[number - 1]
    if any(_NOT_FINITE.fullmatch(word) for word in line.split()):
        raise _not_finite(path, number)
    left = sum(_TRIPLET.match(other) is not None for other in lines[number:])
    if not line.strip() and left == 0:
        return []
    comma = re.search(r"[0-9],[0-9]", line) is not None
    code = "reading_stops_at_comma" if comma else "reading_stops"
    return [finding(code, Place(line=number), text=line.strip(), points=read, left=left)]


def _behind(rest: str, number: int, path: str) -> list[Message]:
    """Look at what stands behind the third number, which the control passes over."""
    returns = "\r" in rest.rstrip()
    rest = rest.strip()
    if re.match(r",\s*[0-9]", rest):
        raise MeasurementFileError("table_decimal_comma", text=rest, file=path, line=number)
    if not rest:
        return []
    code = "passed_over_by_return" if returns else "passed_over"
    return [finding(code, Place(line=number), text=rest)]


def _check_rows(rows: list[_Row], path: str) -> None:
    for before, row in itertools.pairwise(rows):
        if row.nominal <= before.nominal:
            raise MeasurementFileError(
                "position_not_rising",
                position=row.nominal,
                before=before.nominal,
                file=path,
                line=row.line,
            )
        if row.nominal - before.nominal < NEAREST:
            raise MeasurementFileError(
                "positions_too_near",
                position=row.nominal,
                nearest=NEAREST,
                file=path,
                line=row.line,
            )
    if len(rows) > MOST_POINTS:
        raise MeasurementFileError(
            "too_many_rows", most=MOST_POINTS, file=path, line=rows[MOST_POINTS].line
        )


def _check_type(position: FloatArray, value: FloatArray, path: str, stated: str) -> None:
    """Refuse a table of the other type: its deviations would be as large as its positions."""
    as_position = float(np.median(np.abs(value - position[:, np.newaxis])))
    as_trim = float(np.median(np.abs(value)))
    right, wrong = (as_position, as_trim) if stated == "0" else (as_trim, as_position)
    if position.size < 2 or right <= _WRONG_TYPE_FACTOR * wrong:
        return
    other = "1" if stated == "0" else "0"
    raise MeasurementFileError("other_table_type", stated=stated, other=other, file=path)


def _typing_errors(
    rows: list[_Row], position: FloatArray, deviation: FloatArray, kind: AxisKind
) -> list[Message]:
    """Name values that lie far from the line through their neighbours."""
    findings: list[Message] = []
    unit = kind.units.deviation
    for side, name in enumerate(_SIDES):
        kept = np.arange(len(rows))
        while kept.size > 3:
            off, share = _off_neighbours(position[kept], deviation[kept, side])
            if not bool(np.any(_far(off * share))):
                break
            worst = _worst(position[kept], deviation[kept, side], off * share)
            row = rows[int(kept[worst])]
            findings.append(
                finding(
                    "value_off_neighbours",
                    Place(line=row.line),
                    side=name,
                    value=row.words[1 + side],
                    off=float(off[worst]),
                    unit=unit,
                )
            )
            kept = np.delete(kept, worst)
    more = len(findings) - _NAMED
    if more > 0:
        findings = [*findings[:_NAMED], finding("more_values_off", count=more)]
    return findings


def _off_neighbours(position: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return how far each value is from the line through its neighbours, and what of it counts.

    At both ends the line is extrapolated, which magnifies the neighbours' own errors; only the
    share that the end itself has in the sum counts there.
    """
    inner = np.arange(1, position.size - 1)
    left = np.concatenate(([1], inner - 1, [position.size - 3]))
    right = np.concatenate(([2], inner + 1, [position.size - 2]))
    gap = position[right] - position[left]
    slope = (value[right] - value[left]) / gap
    off: FloatArray = np.abs(value - (value[left] + slope * (position - position[left])))
    share = np.ones(position.size)
    for end, near in ((0, 1), (-1, -2)):
        share[end] = 1.0 / (1.0 + abs(position[end] - position[near]) / gap[end])
    return off, share


def _far(off: FloatArray) -> "np.ndarray[tuple[int], np.dtype[np.bool_]]":
    return off > _OUTLIER_FACTOR * max(float(np.median(off)), _LEAST_SCALE)


def _worst(position: FloatArray, value: FloatArray, off: FloatArray) -> int:
    """Return the value without which the others fit best: a wrong one spoils its neighbours too."""
    candidates = np.argsort(off)[::-1][:_CANDIDATES]
    left: list[float] = []
    for c in candidates.tolist():
        others, share = _off_neighbours(np.delete(position, c), np.delete(value, c))
        left.append(float(np.max(others * share)))
    return int(candidates[int(np.argmin(left))])
