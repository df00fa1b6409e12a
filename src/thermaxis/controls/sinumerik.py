"""SINUMERIK 840D sl: NC programs of plan and touch, and the table of the encoder compensation.

The table, ``$AA_ENC_COMP``, has one value for both directions at equidistant points; the reversal
is a machine data of its own, ``$MA_BACKLASH``.

References
----------
SINUMERIK Extended Functions, K3 (6FC5397): interpolatory compensation and its sign. SINUMERIK 808D
parameter manual (6FC5397-8EP40), p. 228, MD32450: sign of the backlash; SINUMERIK 840C (6FC5197),
p. 6-41, NC MD 220*, says the same.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from types import MappingProxyType
from typing import final

import numpy as np

from thermaxis.codes import Message, Place
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
    check_points,
    comment_text,
    finding,
    number_in_table,
    options_of,
    plain_number,
    text_lines,
    whole_option,
)
from thermaxis.controls._program import (
    FINEST_DECIMALS,
    MoveWords,
    block_lines,
    check_motion,
    feed_word,
    head_lines,
    inward_positions,
    position_text,
    stop_time_s,
)
from thermaxis.controls._touch import touch_head
from thermaxis.errors import ConfigurationError, MeasurementFileError
from thermaxis.positioning import MOST_POINTS, CompensationTable
from thermaxis.quantities import AxisKind

ALARM = 65000
"""Number of the user alarm that a program sets when it would leave the travel; the next ones when a
touch meets nothing, and when its probe is deflected before; from memory."""
TURN_DEG = 360.0
"""What the table of a modulo axis spans. [deg]"""

_AXIS = re.compile(r"[ABCEQUVWXYZ][0-9]{0,2}|[A-Z][ABCUVWXYZ][0-9]{1,2}")
_ANY_AXIS = re.compile(r"[A-Z_][A-Z0-9_]{0,31}")
_COUNTER = "THX_CYCLE"
_STATION_DECIMALS = 6
_STATION_TOLERANCE = 1e-3  # mm or deg
_NAMED = 3

_ASSIGNMENT = re.compile(
    r"(?:N[0-9]{1,9}\s*)?\$(?P<name>[A-Z][A-Z0-9_]{0,40})\s*\[(?P<index>[^\]]{0,80})\]\s*=\s*"
    r"(?P<value>.*)",
    re.ASCII | re.IGNORECASE,
)
_OTHER = re.compile(r"(?:N[0-9]{1,9}\s*)?(?:NEWCONF|CHANDATA\s*\([0-9]{1,2}\)|%.*)?", re.IGNORECASE)
_END = re.compile(r"(?:N[0-9]{1,9}\s*)?(?:M0?2|M17|M30|RET)", re.IGNORECASE)
_NUMBER = re.compile(
    r"[+-]?(?:[0-9]++(?:\.[0-9]*+)?|\.[0-9]++)(?:EX[+-]?[0-9]{1,3})?", re.IGNORECASE
)
_SCALARS = ("STEP", "MIN", "MAX", "IS_MODULO")
_REFERENCE = re.compile(
    r"; zero at the reference point (?P<place>-?\d{1,9}(?:\.\d{1,9})?) (?:mm|deg)"
)


@final
class Sinumerik(Control):
    """SINUMERIK 840D sl and 828D.

    Not protected: a program moves one axis and knows nothing of what stands in its way; the jump
    over all motion when the software limits are too near is from memory [M], and asks for those of
    another axis where the machine axis has another name than the channel axis that moves and
    ``machine_axis`` does not say so [M]. A table acts only
    when MD32700 is set and the axis is referenced; whether its sign fits is shown by a measurement
    only, and the sign of the backlash by a second one.
    """

    title = "SINUMERIK 840D sl"
    sign = advice("sinumerik_sign")
    unit = advice("sinumerik_unit")
    newline = "\r\n"
    options = options_of("sinumerik")
    heating = HeatingWords(
        comment="; {}",
        begin=(f"DEF INT {_COUNTER}", "G710 G90 G94 G40 D0", "TRAFOOF", "DIAMOF", "G60 G601"),
        end=("M30",),
        spindle=("S{n}={speed} M{n}=3",),
        spindle_stop=("M{n}=5",),
        spindles=8,
        move="SUPA G1 {axis}={mm:.3f} F{feed}",
        loop=((f"FOR {_COUNTER}=1 TO {{times}}",), ("ENDFOR",)),
        dwell=("G4 F{s}",),
        longest_dwell_s=99_999.0,
    )

    def format_program(self, request: ProgramRequest) -> str:
        """Return the part program of a plan.

        One move to a block, ``SUPA G1``, with exact stop G60; a repeated block is a ``FOR`` loop.
        With machine coordinates the program first compares its ends with the software limits of
        the axis and jumps over all motion if one is passed [M].
        """
        axis = _axis_name(request.axis)
        check_motion(request)
        plan = request.plan
        machine = request.options.get("coordinates", "machine") == "machine"
        lines = [f"; {line}" for line in head_lines(request, self.title)]
        if plan.kind is AxisKind.ROTARY:
            lines.append("; WARNING on a modulo axis try the direction of every move first")
        if any(block.repetitions > 1 for block in request.blocks):
            lines.append(f"DEF INT {_COUNTER}")
        if machine:
            places = [p for b in request.blocks for p in inward_positions(b, FINEST_DECIMALS)]
            low, high = position_text(min(places)), position_text(max(places))
            lines += _limit_lines(low, high, _machine_axis(request.options, axis))
        lines += ["G710 G90 G94 G40 D0", "TRAFOOF", "DIAMOF", "G60 G601"]
        lines.append(f"F{feed_word(plan)}")
        words = MoveWords(
            start=f"SUPA G1 {axis}=" if machine else f"G1 {axis}=",
            comment="; {}",
            dwell=(f"G4 F{plain_number(stop_time_s(plan), 3)}",),
        )
        for block in request.blocks:
            loop = (f"FOR {_COUNTER}=1 TO {block.repetitions}", "ENDFOR")
            lines += block_lines(block, words, loop)
        lines.append("M30")
        if machine:
            lines += ["THX_LIMIT:", f"SETAL({ALARM})", "M30"]
        return "".join(line + self.newline for line in lines)

    def format_touch(self, request: TouchRequest) -> str:
        """Return the part program of a touch by ``MEAS``, which deletes the distance to go.

        Software limits are asked as by `format_program`, and before each search whether the probe
        is deflected already [M].
        """
        axis = _axis_name(request.axis)
        r = whole_option(request.options, "result", lowest=0, highest=9997)
        head = touch_head(request, self.title, f"R{r} value R{r + 1} counter R{r + 2} reading")
        probe, start, end = request.options["probe"], request.start_mm, request.end_mm
        low, high = (f"{place:.3f}" for place in sorted((start, end)))
        to_start = (f"SUPA G1 {axis}={start:.3f}", "STOPRE")
        lines = [
            *(f"; {line}" for line in head),
            f"DEF INT {_COUNTER}=0",
            *_limit_lines(low, high, _machine_axis(request.options, axis)),
            *("M5", "G710 G90 G94 G40 D0", "TRAFOOF", "DIAMOF", "G60 G601"),
            *(f"F{request.feed_mm_per_min:g}", "GOTOF THX_FIRST"),
            *("THX_AGAIN:", f"G4 F{request.pause_s:.3f}", "THX_FIRST:", *to_start),
            f"IF ($A_PROBE[{probe}]<>0) GOTOF THX_DEFLECTED",
            *(f"MEAS={probe} SUPA G1 {axis}={end:.3f}", "STOPRE", *to_start),
            f"IF ($AC_MEA[{probe}]==0) GOTOF THX_NO_TOUCH",
            f"R{r + 2}=$AA_MM[{axis}]",
            f"R{r}=1000*({request.surface_mm:.3f}-R{r + 2})",
            *(f"R{r + 1}=R{r + 1}+1", f"{_COUNTER}={_COUNTER}+1"),
            f"IF ({_COUNTER}<{request.touches}) GOTOB THX_AGAIN",
            *("M30", "THX_LIMIT:", f"SETAL({ALARM})", "M0"),
            *("M30", "THX_NO_TOUCH:", f"SETAL({ALARM + 1})", "M0"),
            *("M30", "THX_DEFLECTED:", f"SETAL({ALARM + 2})", "M0", "M30"),
        ]
        return "".join(line + self.newline for line in lines)

    def grid_rule(self, kind: AxisKind, options: Mapping[str, str]) -> GridRule:
        """Return the rule: equidistant points, one value for both directions."""
        most: int | None = None
        if options.get("max_points", "none") != "none":
            most = whole_option(options, "max_points", lowest=2, highest=MOST_POINTS)
        return GridRule(
            equidistant=True,
            most_points=most,
            per_direction=False,
            backlash_apart=True,
            resolution=kind.units.deviations_per_position * 10.0 ** -_decimals(kind),
            decimals=4,
            advice=advice("sinumerik_points"),
        )

    def format_table(self, request: TableRequest) -> TableText:
        """Return a table as assignments to ``$AA_ENC_COMP``."""
        table, options = request.table, request.options
        axis = _axis_name(table.axis)
        rule = self.grid_rule(table.kind, options)
        check_points(table, rule, self.title)
        step, low, high = _stations(table)
        modulo = options.get("modulo", "0") == "1"
        if modulo:
            _check_turn(table.kind, low, high)
        enc = "0" if options.get("encoder", "1") == "1" else "1"
        body = list(_assignments(table, axis, enc))
        body += [
            f"$AA_ENC_COMP_STEP[{enc},{axis}]={step}",
            f"$AA_ENC_COMP_MIN[{enc},{axis}]={low}",
            f"$AA_ENC_COMP_MAX[{enc},{axis}]={high}",
            f"$AA_ENC_COMP_IS_MODULO[{enc},{axis}]={int(modulo)}",
        ]
        backlash = table.backlash
        if backlash is not None:
            value = plain_number(
                -backlash / table.kind.units.deviations_per_position, _decimals(table.kind)
            )
            body.append(f"$MA_BACKLASH[{enc},{axis}]={value}")
        head = _table_head(request, axis, modulo=modulo)
        off = f"$MA_ENC_COMP_ENABLE[{enc},{axis}]=0"
        if options.get("form", "program") == "ini":
            lines = [f"%_N_{axis}_EEC_INI", *head, "CHANDATA(1)", *body, "M17"]
        else:
            lines = [*head, off, "NEWCONF", "CHANDATA(1)", *body, "M30"]
        return TableText(
            text="".join(line + self.newline for line in lines),
            advice=tuple(_advice(request, axis, enc)),
        )

    def own_options(self, options: Mapping[str, str]) -> Mapping[str, str]:
        """Return the options without the choice among several tables: a new file has only one."""
        return MappingProxyType({**options, "table": "none"})

    def read_table(
        self, text: str, path: str, kind: AxisKind, options: Mapping[str, str]
    ) -> ReadTable:
        """Read assignments to ``$AA_ENC_COMP``."""
        lines, unusual = text_lines(text, path)
        tables, findings = _split(lines, path)
        chosen = _choose(tables, options, path)
        chosen.check_indices(path)
        low, step = chosen.first_and_step(path)
        count = len(chosen.values)
        per = kind.units.deviations_per_position
        value = np.array([chosen.values[i].number(path) for i in range(count)]) * per
        backlash = None
        if chosen.backlash is not None:
            backlash = -chosen.backlash.number(path) * per
        findings = [*unusual, *chosen.findings(kind, options, path), *findings]
        table = CompensationTable(
            kind=kind,
            axis=chosen.axis,
            position=low + step * np.arange(count, dtype=np.float64),
            deviation=np.stack((value, value), axis=1),
            backlash=backlash,
            reference_position=_stated_reference(lines) if len(tables) == 1 else None,
        )
        return ReadTable(table=table, findings=tuple(findings), points_in_file=count)


CONTROL = Sinumerik()
"""The control."""


def _stated_reference(lines: Sequence[str]) -> float | None:
    """Return the reference point that the head of our own file states, in a comment."""
    for line in lines:
        found = _REFERENCE.fullmatch(line.strip())
        if found is not None:
            return float(found["place"])
    return None


def _decimals(kind: AxisKind) -> int:
    return 7 if kind is AxisKind.ROTARY else 6


def _axis_name(axis: str) -> str:
    name = axis.upper()
    if _AXIS.fullmatch(name) is None:
        raise ConfigurationError("axis_name_unfit", name=axis, control="SINUMERIK", key="--axis")
    return name


# ---- program ------------------------------------------------------------------------------------


def _machine_axis(options: Mapping[str, str], axis: str) -> str:
    """Return the name that indexes machine data; moves are programmed by the channel axis [M]."""
    stated = options.get("machine_axis", "axis")
    if stated == "axis":
        return axis
    name = stated.upper()
    if _ANY_AXIS.fullmatch(name) is None:
        raise ConfigurationError(
            "axis_name_unfit", name=stated, control="SINUMERIK", key="--set machine_axis"
        )
    return name


def _limit_lines(low: str, high: str, axis: str) -> Iterator[str]:
    yield "; no motion if the software limits of the axis are nearer"
    yield f"IF ({low}<$MA_POS_LIMIT_MINUS[{axis}]) GOTOF THX_LIMIT"
    yield f"IF ({high}>$MA_POS_LIMIT_PLUS[{axis}]) GOTOF THX_LIMIT"


# ---- table --------------------------------------------------------------------------------------


def _stations(table: CompensationTable) -> tuple[Decimal, Decimal, Decimal]:
    """Return STEP, MIN and MAX as written, so that MAX is exactly MIN + N * STEP."""
    count = table.position.size - 1
    if count < 1:
        raise ConfigurationError("too_few_table_points", key="points")
    first, last = float(table.position[0]), float(table.position[-1])
    step = Decimal(plain_number((last - first) / count, _STATION_DECIMALS)).normalize()
    low = Decimal(plain_number(first, _STATION_DECIMALS)).normalize()
    high = low + count * step
    written = float(low) + float(step) * np.arange(count + 1)
    off = float(np.max(np.abs(written - table.position)))
    if step <= 0 or off > _STATION_TOLERANCE:
        raise ConfigurationError(
            "rounded_steps_off",
            decimals=_STATION_DECIMALS,
            off=off,
            unit=table.kind.units.position,
            key="points",
        )
    return _plain(step), _plain(low), _plain(high)


def _plain(number: Decimal) -> Decimal:
    """Return the number without an exponent, so that it prints as the control reads it."""
    return Decimal(f"{number.normalize():f}")


def _check_turn(kind: AxisKind, low: Decimal, high: Decimal) -> None:
    if kind is not AxisKind.ROTARY:
        raise ConfigurationError("modulo_of_linear_axis", key="--set modulo")
    if abs(float(high - low) - TURN_DEG) > 1e-9:
        raise ConfigurationError("turn_not_covered", span_deg=float(high - low), key="--set modulo")


def _assignments(table: CompensationTable, axis: str, enc: str) -> Iterator[str]:
    per, decimals = table.kind.units.deviations_per_position, _decimals(table.kind)
    for i, value in enumerate((table.mean / per).tolist()):
        yield f"$AA_ENC_COMP[{enc},{i},{axis}]={plain_number(value, decimals)}"


def _advice(request: TableRequest, axis: str, enc: str) -> Iterator[Message]:
    table, options = request.table, request.options
    unit = table.kind.units.deviation
    yield advice("sinumerik_memory", points=table.position.size)
    yield advice("sinumerik_activation", encoder=enc, axis=axis)
    yield advice("sinumerik_access")
    if table.backlash is not None:
        yield advice("sinumerik_backlash", backlash=-table.backlash, unit=unit)
    else:
        yield advice("sinumerik_no_backlash")
    if options.get("form") == "ini":
        yield advice("sinumerik_ini")
    if options.get("modulo") == "1":
        jump = abs(float(table.mean[-1] - table.mean[0]))
        yield advice("sinumerik_turn", jump=jump, unit=unit)


def _table_head(request: TableRequest, axis: str, *, modulo: bool) -> Iterator[str]:
    table = request.table
    unit = table.kind.units.position_suffix
    yield "; thermaxis encoder error compensation for SINUMERIK 840D sl"
    yield f"; axis {axis} {table.kind}{' modulo' if modulo else ''} {table.position.size} points"
    yield f"; values in {unit} are plus the mean deviation measured minus nominal"
    yield "; a positive value makes the axis move in negative direction"
    if table.reference_position is not None:
        yield f"; zero at the reference point {plain_number(table.reference_position, 6)} {unit}"
    if table.backlash is not None:
        yield "; MA_BACKLASH is minus the mean reversal value forward minus backward"
    for name, words in (("deviations", table.source), ("run sha256", table.run_sha256)):
        if comment_text(words):
            yield f"; {name} {comment_text(words, 100)}"
    for line in request.origin:
        yield f"; {comment_text(line, 100)}"
    yield "; a wrong sign doubles the error. prove two points by a measurement"
    yield "; this file does not activate the compensation. MD32700 must be set to 1"


# ---- reading ------------------------------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True)
class _Value:
    """What stands behind an equals sign, not yet a number."""

    line: int
    words: str

    def number(self, path: str) -> float:
        """Return the number, or refuse it as the control does."""
        return number_in_table(self.words, _NUMBER, 1e6, Place(path, self.line))

    @property
    def decimals(self) -> int:
        """Digits behind the point."""
        return len(self.words.upper().partition("EX")[0].partition(".")[2])


@final
@dataclass(slots=True)
class _Section:
    """Assignments of one table, as they stand in the file."""

    encoder: str
    axis: str
    line: int
    values: dict[int, _Value] = field(default_factory=dict[int, "_Value"])
    scalars: dict[str, _Value] = field(default_factory=dict[str, "_Value"])
    backlash: _Value | None = None
    enable: _Value | None = None
    repeated: list[Message] = field(default_factory=list[Message])

    def check_indices(self, path: str) -> None:
        """Refuse gaps: there the control would keep what it holds."""
        count = len(self.values)
        missing = next((i for i in range(count) if i not in self.values), None)
        if missing is not None:
            following = min(i for i in self.values if i > missing)
            raise MeasurementFileError(
                "table_point_missing", point=missing, file=path, line=self.values[following].line
            )
        if count < 2:
            raise MeasurementFileError("table_of_one_point", file=path, line=self.line)

    def first_and_step(self, path: str) -> tuple[float, float]:
        """Return MIN and STEP; they must lead to MAX within the digits written."""
        for name in ("STEP", "MIN", "MAX"):
            if name not in self.scalars:
                raise MeasurementFileError(
                    "assignment_missing",
                    name=f"$AA_ENC_COMP_{name}",
                    axis=self.axis,
                    file=path,
                    line=self.line,
                )
        step, low, high = (self.scalars[name].number(path) for name in ("STEP", "MIN", "MAX"))
        if step <= 0:
            raise MeasurementFileError(
                "not_positive", value=step, file=path, line=self.scalars["STEP"].line, column="STEP"
            )
        steps = len(self.values) - 1
        off = low + steps * step - high
        if abs(off) > steps * _last_digit(self.scalars["STEP"]) + 1e-9:
            raise MeasurementFileError(
                "max_not_reached",
                steps=steps,
                reached=low + steps * step,
                off=abs(off),
                file=path,
                line=self.scalars["MAX"].line,
                column="MAX",
            )
        return low, step

    def findings(self, kind: AxisKind, options: Mapping[str, str], path: str) -> list[Message]:
        """Return what would surprise the user of this table."""
        said = list(self.repeated[:_NAMED])
        if len(self.repeated) > _NAMED:
            said.append(finding("more_values_twice", count=len(self.repeated) - _NAMED))
        said.append(self._activation(path))
        if options.get("encoder", "1") != str(int(self.encoder) + 1):
            said.append(finding("other_encoder", encoder=int(self.encoder) + 1))
        modulo = self.scalars.get("IS_MODULO")
        if modulo is None:
            said.append(finding("modulo_not_written"))
        elif (modulo.number(path) != 0) != (options.get("modulo", "0") == "1"):
            said.append(
                finding(
                    "modulo_differs",
                    Place(line=modulo.line),
                    value=modulo.words,
                    modulo=options.get("modulo", "0"),
                )
            )
        if modulo is not None and modulo.number(path) != 0 and kind is AxisKind.LINEAR:
            said.append(finding("modulo_though_linear"))
        return said

    def _activation(self, path: str) -> Message:
        if self.enable is None:
            return finding("not_activated")
        off = self.enable.number(path) == 0
        code = "activation_off" if off else "activates_itself"
        return finding(code, Place(line=self.enable.line))


def _last_digit(step: _Value) -> float:
    """Return by how much a step may have been rounded; a whole number was hardly rounded."""
    return 10.0 ** -(step.decimals or 3)


def _split(lines: list[str], path: str) -> tuple[list[_Section], list[Message]]:
    """Return the tables of a file, each from its own axis, encoder and program."""
    finished: list[_Section] = []
    current: dict[tuple[str, str], _Section] = {}
    strange: list[Message] = []
    for number, line in enumerate(lines, start=1):
        statement = line.partition(";")[0].strip()
        if _END.fullmatch(statement):
            finished += current.values()
            current = {}
            continue
        if _OTHER.fullmatch(statement):
            continue
        assigned = _ASSIGNMENT.fullmatch(statement)
        if assigned is None or not _take(current, assigned, number, path):
            if "AA_ENC_COMP" in statement.upper():
                raise _malformed(line, number, path)
            strange.append(finding("line_passed_over", Place(line=number), text=line.strip()))
    finished += current.values()
    if len(strange) > _NAMED:
        strange = [
            *strange[:_NAMED],
            finding("more_lines_passed_over", count=len(strange) - _NAMED),
        ]
    return [section for section in finished if section.values], strange


def _malformed(line: str, number: int, path: str) -> MeasurementFileError:
    return MeasurementFileError("no_assignment", text=line.strip(), file=path, line=number)


def _take(
    current: dict[tuple[str, str], _Section], assigned: re.Match[str], line: int, path: str
) -> bool:
    """Put an assignment into its table; return False if it is none of a table."""
    name: str = assigned["name"].upper()
    words = [word.strip() for word in assigned["index"].upper().split(",")]
    scalar = name.removeprefix("AA_ENC_COMP_")
    is_value = name == "AA_ENC_COMP"
    if not (is_value or scalar in _SCALARS or name in {"MA_BACKLASH", "MA_ENC_COMP_ENABLE"}):
        return False
    encoder, axis = words[0], words[-1]
    fits = len(words) == (3 if is_value else 2) and encoder in {"0", "1"}
    if not fits or _ANY_AXIS.fullmatch(axis) is None:
        return False
    section = current.setdefault((encoder, axis), _Section(encoder, axis, line))
    value = _Value(line, assigned["value"].strip())
    if is_value:
        _take_value(section, words[1], value, path)
    elif name == "MA_BACKLASH":
        section.backlash = value
    elif name == "MA_ENC_COMP_ENABLE":
        section.enable = value
    else:
        section.scalars[scalar] = value
    return True


def _take_value(section: _Section, index: str, value: _Value, path: str) -> None:
    if re.fullmatch(r"[0-9]{1,6}", index) is None or int(index) >= MOST_POINTS:
        raise MeasurementFileError("no_point_index", text=index, file=path, line=value.line)
    before = section.values.get(int(index))
    if before is not None:
        section.repeated.append(
            finding("index_twice", Place(line=value.line), index=int(index), first_line=before.line)
        )
    section.values[int(index)] = value


def _choose(tables: list[_Section], options: Mapping[str, str], path: str) -> _Section:
    if not tables:
        raise MeasurementFileError("no_encoder_table", file=path)
    if options.get("table", "none") == "none":
        if len(tables) == 1:
            return tables[0]
        listed = (
            f"table {number} from line {section.line}, axis {section.axis}, {len(section.values)}"
            " values"
            for number, section in enumerate(tables[:_NAMED], start=1)
        )
        raise MeasurementFileError(
            "several_tables", tables=tuple(listed), count=len(tables), file=path
        )
    return tables[whole_option(options, "table", lowest=1, highest=len(tables)) - 1]
