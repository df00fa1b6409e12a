"""What every control offers: its NC programs, and its compensation table written, read, simulated.

A control is one module of this package with a constant ``CONTROL``, or a folder; a maker's folder
may have several. Its name, with hyphens, is the name on the command line. Nothing else has to be
told of it.
"""

import math
import re
import tomllib
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, final

from thermaxis.codes import NOWHERE, Message, Place, Value, printable
from thermaxis.errors import ConfigurationError, MeasurementFileError
from thermaxis.quantities import AxisKind

if TYPE_CHECKING:  # so that a command's help need not load numpy
    from thermaxis.positioning import CompensationTable, FloatArray, MoveBlock, TestPlan
    from thermaxis.thermal import ThermalTestPlan

LONGEST_COMMENT = 60
"""Longest text of a plan or a run within a comment; the rest is cut. [character]"""
LARGEST_TABLE_BYTES = 5_000_000
"""Largest table that is read. [byte]"""

TRAVEL_UNSTATED = "travel of the axis was not stated and not checked"
"""What is warned of where no travel is stated."""

BYTE_ORDER_MARKS = ("\ufeff", "\xef\xbb\xbf")
"""Byte order mark at the start of a text: as one letter, or as its bytes one by one."""

_END_OF_LINE = re.compile(r"\r\n|\n|\r")
_RETURN_ALONE = re.compile(r"(?<![\r\n])\r++(?![\r\n])(?!\Z)")  # LF CR CR is Fanuc's own
_COMMENT_CHARACTERS = frozenset(
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789 -_."
)


def comment_text(text: str, limit: int = LONGEST_COMMENT) -> str:
    """Return text of a file or a person as it may stand in a comment of an NC program.

    Only letters of ASCII, digits, space, ``-``, ``_`` and ``.`` are left: no character that ends a
    comment, begins a command or addresses the operator in any control's language.

    Parameters
    ----------
    limit : int
        Longest result. Default: `LONGEST_COMMENT`. [character]

    Returns
    -------
    str
        The text; every other character is a space, spaces do not follow each other.
    """
    kept = "".join(c if c in _COMMENT_CHARACTERS else " " for c in text[: 10 * limit])
    return " ".join(kept.split())[:limit].rstrip()


@final
@dataclass(frozen=True, slots=True)
class ControlOption:
    """A setting that only one control has, given as ``--set NAME=VALUE``."""

    name: str
    default: str
    meaning: str
    """What it means, with its unit, in words."""
    choices: tuple[str, ...] = ()
    """Values that it can take; empty where any number or name can be."""
    only_for: str = ""
    """Which of ``program``, ``touch`` and ``table`` it serves, where not all of them."""

    @property
    def in_words(self) -> str:
        """Name, default in parentheses and meaning."""
        return f"{self.name} ({self.default}): {self.meaning}"


@final
@dataclass(frozen=True, slots=True)
class GridRule:
    """What a control asks of the points of its table."""

    equidistant: bool
    """Whether the points must lie at equal distances."""
    most_points: int | None
    """Largest number of points, None where only a machine parameter limits it. [1]"""
    per_direction: bool
    """Whether each point has a value for each direction."""
    backlash_apart: bool
    """Whether the control has one reversal value apart from the points."""
    resolution: float
    """Step of the values. [µm or arcsec]"""
    decimals: int
    """Decimals of the points' positions in the control's own unit. [1]"""
    through_reference: bool = False
    """Whether a point must lie at the reference position."""
    advice: Message | None = None
    """A limit that the table alone does not show, such as a machine parameter to set."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class ProgramRequest:
    """What an NC program is made of."""

    plan: "TestPlan"
    plan_sha256: str
    """Its hash, 64 hexadecimal digits."""
    blocks: "tuple[MoveBlock, ...]"
    axis: str
    """Name of the axis on the control."""
    travel: tuple[float, float] | None = None
    """Lowest and highest position that the axis may reach, None if not stated. [mm or deg]"""
    options: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    """The control's options, complete and checked by `check_options`."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class TouchRequest:
    """What a program is made of that touches a fixed artefact along one axis; machine positions."""

    axis: str
    """Name of the axis on the control."""
    surface_mm: float
    """Reading of the touch where the displacement counts as zero. [mm]"""
    start_mm: float
    """Where the search begins, and to which the axis retracts. [mm]"""
    search_mm: float
    """Longest way of the search, towards the surface. [mm]"""
    feed_mm_per_min: float
    """Feed of every move. [mm/min]"""
    touches: int = 1
    """Number of touches. [1]"""
    pause_s: float = 0.0
    """Pause between two touches. [s]"""
    travel: tuple[float, float] | None = None
    """Lowest and highest position that the axis may reach, None if not stated. [mm]"""
    options: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    """The control's options, complete and checked by `check_options`."""

    @property
    def end_mm(self) -> float:
        """Where the search ends at the latest. [mm]"""
        return self.start_mm + math.copysign(self.search_mm, self.surface_mm - self.start_mm)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class TableRequest:
    """What a control's table is made of, beside the values."""

    table: "CompensationTable"
    """The table, not yet rounded."""
    origin: tuple[str, ...] = ()
    """Lines about run, program and state of measurement for the head, where comments exist."""
    options: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    """The control's options, complete and checked by `check_options`."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class TableText:
    """A table as the control's file, and what its user must know."""

    text: str
    """Content of the file, ASCII, lines ended as the control wants them."""
    advice: tuple[Message, ...]
    """What was rounded or lost, what else must be set, how to activate it."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class ReadTable:
    """A control's table as it was read, as the control would read it."""

    table: "CompensationTable"
    findings: tuple[Message, ...] = ()
    """What looks wrong in it or would surprise."""
    points_in_file: int | None = None
    """Number of points that the file seems to hold, where the control reads fewer. [1]"""
    resolution: float | None = None
    """Step of the values in this very file, where it is not that of the `GridRule`, as with a
    magnification that was chosen to fit the values. [µm or arcsec]"""


@final
@dataclass(frozen=True, slots=True)
class HeatingRequest:
    """A thermal test that an NC program is to run."""

    plan: "ThermalTestPlan"
    plan_sha256: str
    """Hash by which the program names its plan."""
    options: Mapping[str, str]
    """Options of the control, by name."""
    travel: tuple[float, float] | None = None
    """Lowest and highest position that an axis may reach; None: not stated. [mm]"""


@final
@dataclass(frozen=True, slots=True)
class HeatingWords:
    """How a control writes the program of a thermal test (`Control.format_heating`)."""

    comment: str
    """A comment, with ``{}`` for its text."""
    begin: tuple[str, ...]
    """Lines behind the head, with names of options in braces."""
    end: tuple[str, ...]
    """Last lines, alike."""
    spindle: tuple[str, ...]
    """Lines that turn a spindle, with its number ``{n}``, one less ``{k}``, and ``{speed}``."""
    spindle_stop: tuple[str, ...]
    """Lines that stop it, alike."""
    spindles: int
    """Spindles that it can name so. [1]"""
    move: str
    """A move, with ``{axis}``, ``{mm}`` and ``{feed}``."""
    loop: tuple[tuple[str, ...], tuple[str, ...]]
    """Lines around what is repeated, with ``{number}`` of the loop, ``{times}``, and ``{more}``,
    one less."""
    dwell: tuple[str, ...]
    """Lines of a dwell, with ``{s}`` and ``{ms}``."""
    longest_dwell_s: float
    """A longer one is several. [s]"""
    first: tuple[str, ...] = ()
    """Lines before the head, as `begin`."""
    numbered: bool = False
    """Whether lines have numbers, from zero."""
    upper_case: bool = False
    """Whether the control reads capital letters alone."""


class Control(ABC):
    """A machine control. Every subclass is final and stands in a file of its own."""

    title: str
    """Name for people, with the versions that it is meant for."""
    sign: Message
    """What a positive value of the table does."""
    unit: Message
    """Unit and resolution of the values."""
    newline: str = "\n"
    """End of a line in its files."""
    options: tuple[ControlOption, ...] = ()
    heating: HeatingWords
    """Its words for a thermal test."""

    @abstractmethod
    def format_program(self, request: ProgramRequest) -> str:
        """Return the NC program of a plan, lines ended by ``newline``.

        Raises
        ------
        ConfigurationError
            If the control has no such axis, or a number does not fit its words.
        """

    @abstractmethod
    def format_touch(self, request: TouchRequest) -> str:
        """Return the NC program of a touch; errors as of `format_program`.

        Each touch: to the start, towards the surface until the probe answers, back to the start.
        It leaves the reading [mm], the displacement of the tool point, surface minus reading [µm],
        and a counter, which moves last and only after a touch: where nothing is met the control
        says so, and the program ends.
        """

    def format_heating(self, request: HeatingRequest) -> str:
        """Return the NC program of a thermal test, lines ended by ``newline``.

        Not protected: speeds, motion and M functions are those that the plan states; nothing is
        known of a tool that may not turn so fast, of chuck or workpiece, or of what stands in the
        way.

        Raises
        ------
        ConfigurationError
            If a source has no switch, two axes are to move at the same time, the control has no
            such axis or spindle, or a position lies outside the stated travel.
        """
        from thermaxis.controls._heating import heating_program  # noqa: PLC0415 - it needs numpy

        return heating_program(self, request)

    @abstractmethod
    def grid_rule(self, kind: AxisKind, options: Mapping[str, str]) -> GridRule:
        """Return what the control asks of the points of a table."""

    @abstractmethod
    def format_table(self, request: TableRequest) -> TableText:
        """Return a table as the control's file, with what its user must know.

        Raises
        ------
        ConfigurationError
            If a limit of the control is exceeded; nothing is cut off.
        """

    @abstractmethod
    def read_table(
        self, text: str, path: str, kind: AxisKind, options: Mapping[str, str]
    ) -> ReadTable:
        """Read a table as the control would; `path` is its name, for errors.

        Raises
        ------
        MeasurementFileError
            If it is no such table, or holds what the control would refuse; file, line and remedy
            are named.
        """

    def own_options(self, options: Mapping[str, str]) -> Mapping[str, str]:
        """Return the options with which a file that this program has just written is read back.

        They are those with which an older file was read and the new one written; a control leaves
        out what speaks of the older file only.
        """
        return options

    def correction(self, table: "CompensationTable", position: "FloatArray") -> "FloatArray":
        """Return what the control adds at the positions: its interpolation, simulated.

        For (p,) positions [mm or deg] a correction per direction, (p, 2): minus the deviation,
        linear between points, end values held. [µm or arcsec]
        """
        return -table.deviation_at(position)


def finding(code: str, place: Place = NOWHERE, **values: Value) -> Message:
    """Return a finding in a table: its sentence is ``finding-`` and the code."""
    return Message(f"finding-{code}", values, place)


def advice(code: str, **values: Value) -> Message:
    """Return what the user of a table must know: its sentence is ``advice-`` and the code."""
    return Message(f"advice-{code}", values)


def options_of(control: str) -> tuple[ControlOption, ...]:
    """Return the options of a control, or of a maker's controls, from ``options.toml``."""
    page = (files("thermaxis.controls") / "options.toml").read_text("utf-8")
    tables: dict[str, dict[str, Any]] = tomllib.loads(page)[control]
    for table in tables.values():
        table["choices"] = tuple(table.get("choices", ()))
    return tuple(ControlOption(name, **table) for name, table in tables.items())


# ---- shared by the controls ---------------------------------------------------------------------


def check_options(control: Control, stated: Sequence[str], *, purpose: str) -> Mapping[str, str]:
    """Return the options of a control, stated or by default.

    Parameters
    ----------
    stated : sequence of str
        Texts ``NAME=VALUE``.
    purpose : str
        ``program``, ``touch`` or ``table``: options for others alone are refused.

    Returns
    -------
    mapping
        Every option that serves the purpose, by name.

    Raises
    ------
    ConfigurationError
        If a text is no ``NAME=VALUE``, a name is unknown or stated twice, or a value is none of
        its choices.
    """
    known = {o.name: o for o in control.options if not o.only_for or purpose in o.only_for.split()}
    chosen: dict[str, str] = {}
    for text in stated:
        name, _, value = text.partition("=")
        name, value = name.strip().casefold(), value.strip()
        place = Place(key=f"--set {printable(text, 60)}")
        if name not in known:
            raise ConfigurationError(
                "unknown_control_option",
                name=name,
                purpose=purpose,
                known=tuple(f"{n} ({o.default})" for n, o in sorted(known.items())),
                place=place,
            )
        if not value:
            raise ConfigurationError(
                "option_without_value", meaning=known[name].in_words, place=place
            )
        if name in chosen:
            raise ConfigurationError("stated_twice", name=name, place=place)
        if known[name].choices and value not in known[name].choices:
            raise ConfigurationError(
                "unknown_choice", name=value, known=known[name].choices, place=place
            )
        chosen[name] = value
    return MappingProxyType({name: chosen.get(name, o.default) for name, o in known.items()})


def number_option(options: Mapping[str, str], name: str, *, lowest: float, highest: float) -> float:
    """Return the value of an option that is a number."""
    try:
        number = float(options[name])
    except ValueError:
        number = float("nan")
    if not lowest <= number <= highest:
        raise ConfigurationError(
            "outside_range", value=options[name], least=lowest, most=highest, key=f"--set {name}"
        )
    return number


def whole_option(options: Mapping[str, str], name: str, *, lowest: int, highest: int) -> int:
    """Return the value of an option that is a whole number."""
    number = number_option(options, name, lowest=lowest, highest=highest)
    if not number.is_integer():
        raise ConfigurationError("not_whole_number", value=number, key=f"--set {name}")
    return int(number)


def axis_letter(name: str, letters: str) -> str:
    """Return the one letter of an axis, upper case."""
    letter = name.upper()
    if len(letter) != 1 or letter not in letters:
        raise ConfigurationError(
            "unknown_axis", name=name, known=tuple(sorted(letters)), key="--axis"
        )
    return letter


def number_in_table(text: str, form: re.Pattern[str], largest: float, place: Place) -> float:
    """Return a number of a table, or refuse it as the control does."""
    if form.fullmatch(text) is None:
        comma = re.fullmatch(r"[+-]?[0-9]+,[0-9]*", text[:60], re.ASCII) is not None
        code = "table_decimal_comma" if comma else "not_a_number"
        raise MeasurementFileError(code, text=text[:99], place=place)
    value = float(text.upper().replace("EX", "E"))  # EX: the exponent of SINUMERIK
    if not abs(value) <= largest:
        raise MeasurementFileError("number_too_large", text=text[:99], largest=largest, place=place)
    return value


def plain_number(value: float, decimals: int) -> str:
    """Return a number as controls read it: no exponent, no locale, no minus before zero."""
    if not math.isfinite(value):
        raise ConfigurationError("not_finite")
    text = f"{value:.{decimals}f}"
    return text[1:] if float(text) == 0 and text.startswith("-") else text


def check_size(content: str | bytes, path: str) -> None:
    """Refuse a file above `LARGEST_TABLE_BYTES` before it is taken apart; errors name its path."""
    if len(content) > LARGEST_TABLE_BYTES:
        raise MeasurementFileError(
            "file_too_large",
            size_mb=round(len(content) / 1e6, 1),
            most_mb=LARGEST_TABLE_BYTES / 1e6,
            file=path,
        )


def text_lines(text: str, path: str) -> tuple[list[str], list[Message]]:
    """Return the lines of a table for a control whose ends of lines are not known by a proof."""
    check_size(text, path)
    for mark in BYTE_ORDER_MARKS:
        text = text.removeprefix(mark)
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    alone = _RETURN_ALONE.search(text)
    if alone is None:
        return lines, []
    number = len(_END_OF_LINE.findall(text, 0, alone.start())) + 1
    return lines, [finding("line_ended_by_return_alone", Place(line=number))]


def check_points(table: "CompensationTable", rule: GridRule, title: str) -> None:
    """Refuse a table that breaks the rule of a control.

    Parameters
    ----------
    title : str
        Name of the control.

    Raises
    ------
    ConfigurationError
        If there are too many points, they are not equidistant, or values differ by direction
        where the control has only one.
    """
    k = table.position.size
    if rule.most_points is not None and k > rule.most_points:
        raise ConfigurationError(
            "too_many_table_points", points=k, control=title, most=rule.most_points, key="points"
        )
    if rule.equidistant and table.step is None:
        raise ConfigurationError("points_not_equidistant", key="points")
    if table.per_direction and not rule.per_direction:
        raise ConfigurationError("one_value_per_point", control=title, key="backlash")
