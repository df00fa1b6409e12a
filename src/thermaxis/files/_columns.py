"""What the headings of a table mean: the role of a column, its unit, the words in it."""

import re
import unicodedata
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, final

import numpy as np

from thermaxis.files._quoting import decoded, unprotected
from thermaxis.positioning import BACKWARD, FORWARD, FloatArray
from thermaxis.quantities import AxisKind

CHANNEL_PREFIX = "channel "
"""Starts a heading whose remainder is the name of a channel, whatever it says."""
LONGEST_HEADING = 200
"""Longest heading in which a role is looked for. [character]"""


class Role(StrEnum):
    """What the numbers or words of a column are."""

    TARGET = "target"
    MEASURED = "measured"
    DEVIATION = "deviation"
    CYCLE = "cycle"
    RUN = "run"
    DIRECTION = "direction"
    ORDER = "order"
    TIME = "time"


QUANTITIES: Final = frozenset({Role.TARGET, Role.MEASURED, Role.DEVIATION})
"""Roles whose columns need the unit of a length or of an angle."""

_ROLE_WORDS: dict[Role, tuple[str, ...]] = {
    Role.TARGET: (
        "target",
        "target_position",
        "nominal",
        "nominal_position",
        "position",
        "soll",
        "sollposition",
        "sollwert",
    ),
    Role.MEASURED: (
        "measured",
        "measured_position",
        "actual",
        "actual_position",
        "ist",
        "istposition",
        "istwert",
    ),
    Role.DEVIATION: (
        "deviation",
        "positional_deviation",
        "error",
        "position_error",
        "positioning_error",
        "abweichung",
        "odchylka",
    ),
    Role.CYCLE: ("cycle", "cycle_no", "cycle_number", "zyklus"),
    Role.RUN: ("run", "run_no", "run_number", "lauf"),
    Role.DIRECTION: ("direction", "approach", "approach_direction", "richtung"),
    Role.ORDER: ("order", "sequence"),
    Role.TIME: ("time", "timestamp", "time_stamp", "date_time", "datetime"),
}
_ROLES = {word: role for role, words in _ROLE_WORDS.items() for word in words}


@final
@dataclass(frozen=True, slots=True)
class Unit:
    """Unit of a length or of an angle, as factors to the units of its kind of axis."""

    name: str
    """Name in messages: µm."""
    kind: AxisKind
    """Linear for lengths, rotary for angles."""
    position: tuple[float, float]
    """Factor and divisor that give mm or deg; a divisor keeps decimal numbers exact."""
    deviation: tuple[float, float]
    """Factor and divisor that give µm or arcsec."""
    decimals: int | None
    """Decimal places that go when µm are made of it; None where places do not carry over."""

    def positions(self, values: FloatArray) -> FloatArray:
        """Convert to the unit of positions. [mm or deg]"""
        return _scaled(values, self.position)

    def deviations(self, values: FloatArray) -> FloatArray:
        """Convert to the unit of deviations. [µm or arcsec]"""
        return _scaled(values, self.deviation)


def _scaled(values: FloatArray, factor: tuple[float, float]) -> FloatArray:
    return values if factor == (1.0, 1.0) else values * factor[0] / factor[1]


_DEG_PER_RAD = 180.0 / np.pi
_LINEAR, _ROTARY = AxisKind.LINEAR, AxisKind.ROTARY
_UNITS: tuple[tuple[Unit, tuple[str, ...]], ...] = (
    (Unit("m", _LINEAR, (1e3, 1), (1e6, 1), 6), ("m",)),
    (Unit("mm", _LINEAR, (1, 1), (1e3, 1), 3), ("mm",)),
    (Unit("µm", _LINEAR, (1, 1e3), (1, 1), 0), ("um", "micron", "microns", "micrometer")),
    (Unit("nm", _LINEAR, (1, 1e6), (1, 1e3), -3), ("nm",)),
    (Unit("inch", _LINEAR, (25.4, 1), (25400, 1), None), ("in", "inch", "inches")),
    (Unit("deg", _ROTARY, (1, 1), (3600, 1), None), ("deg", "degree", "degrees", "°")),
    (Unit("arcmin", _ROTARY, (1, 60), (60, 1), None), ("arcmin", "arcminute", "arcminutes")),
    (
        Unit("arcsec", _ROTARY, (1, 3600), (1, 1), 0),
        ("arcsec", "arcsecond", "arcseconds", "″", '"', "''"),
    ),
    (Unit("rad", _ROTARY, (_DEG_PER_RAD, 1), (_DEG_PER_RAD * 3600, 1), None), ("rad",)),
    (Unit("mrad", _ROTARY, (_DEG_PER_RAD, 1e3), (_DEG_PER_RAD * 3.6, 1), None), ("mrad",)),
    (Unit("µrad", _ROTARY, (_DEG_PER_RAD, 1e6), (_DEG_PER_RAD * 3.6, 1e3), None), ("urad",)),
)
_UNIT_WORDS = {word: unit for unit, words in _UNITS for word in words}
_TIME_UNITS = {"s": 1.0, "sec": 1.0, "seconds": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0}

_BRACKETS = re.compile(r"(?P<name>.*?)\s*[(\[]\s*(?P<unit>[^()\[\]]*?)\s*[)\]]", re.DOTALL)
_RUN_HEADING = re.compile(r"(?:run|lauf|pass)?_?(?:no_)?0{0,3}([1-9][0-9]{0,4})")
_SEPARATORS = re.compile(r"[\s_.:#-]+")

_DIRECTIONS = {
    **dict.fromkeys(
        ("forward", "forwards", "fwd", "up", "+", "↑", "hin", "positive", "vorwärts"), FORWARD
    ),
    **dict.fromkeys(
        ("backward", "backwards", "bwd", "reverse", "rev", "down", "-", "\N{MINUS SIGN}", "↓"),
        BACKWARD,
    ),
    **dict.fromkeys(("zurück", "zurueck", "negative", "rückwärts"), BACKWARD),
}


@final
@dataclass(frozen=True, slots=True)
class Heading:
    """The heading of one column."""

    text: str
    """As in the file."""
    role: Role | None
    """What the column holds, None if its name is not known."""
    unit: Unit | None = None
    """Unit of a target, measured position or deviation, None if not stated."""
    unit_text: str = ""
    """What stands in brackets, for the error about an unknown unit."""
    seconds: float | None = None
    """Length of the time unit of a column of numbers; None if times are dates with time. [s]"""
    run: int | None = None
    """Number of the run whose readings the column of a wide table holds. [1]"""

    @property
    def channel_name(self) -> str:
        """Name under which the column is kept if its role is not known."""
        if self.text.startswith(CHANNEL_PREFIX):
            return decoded(self.text.removeprefix(CHANNEL_PREFIX).strip())
        return self.text


def parse_heading(text: str) -> Heading:
    """Find role and unit of a column.

    Parameters
    ----------
    text : str
        The heading: `target_mm`, `Target (mm)`, `Run 3`, `motor temperature`.

    Returns
    -------
    Heading
        Without role where the name is not known.
    """
    text = text.strip()
    if text.startswith(CHANNEL_PREFIX) or len(text) > LONGEST_HEADING:
        return Heading(text, None)
    name, unit_word, in_brackets = _split_unit(text)
    role = _ROLES.get(name)
    unit = _UNIT_WORDS.get(unit_word)
    if role in QUANTITIES:
        return Heading(text, role, unit, unit_word)
    if role is Role.TIME:
        return _time_heading(text, unit_word)
    run = _RUN_HEADING.fullmatch(name)
    if run is not None:
        return Heading(text, None, unit, unit_word, run=int(run[1]))
    if role is not None and (in_brackets or not unit_word):
        return Heading(text, role)
    return Heading(text, None)


def unit_named(text: str) -> Unit | None:
    """Return the unit of a length or an angle by its name, None if it is not known.

    Parameters
    ----------
    text : str
        The name: `um`, `µm`, `Arcsec`.

    Returns
    -------
    Unit or None
        The unit.
    """
    return _UNIT_WORDS.get(_folded(text))


def deviation_unit(kind: AxisKind) -> Unit:
    """Return the unit of deviations of a kind of axis: µm or arcsec."""
    return _UNIT_WORDS[kind.units.deviation_suffix]


def direction_named(word: str) -> int | None:
    """Return the approach that a word means, None if it is not known.

    Parameters
    ----------
    word : str
        Such as `forward`, `bwd`, `+`, `↓`, `zurück`.

    Returns
    -------
    int or None
        0 forward, 1 backward.
    """
    return _DIRECTIONS.get(unicodedata.normalize("NFC", unprotected(word).strip()).casefold())


def _folded(text: str) -> str:
    return unicodedata.normalize("NFC", text).casefold().replace("μ", "u").strip()


def _split_unit(text: str) -> tuple[str, str, bool]:
    folded = _folded(text)
    match = _BRACKETS.fullmatch(folded)
    if match is not None:
        return _SEPARATORS.sub("_", match["name"]).strip("_"), match["unit"].replace(" ", ""), True
    words = [word for word in _SEPARATORS.split(folded) if word]
    if len(words) > 1 and (words[-1] in _UNIT_WORDS or words[-1] in _TIME_UNITS):
        return "_".join(words[:-1]), words[-1], False
    return "_".join(words), "", False


def _time_heading(text: str, unit_word: str) -> Heading:
    if not unit_word or unit_word in {"iso", "iso8601", "utc"}:
        return Heading(text, Role.TIME)
    seconds = _TIME_UNITS.get(unit_word)
    return Heading(text, None if seconds is None else Role.TIME, seconds=seconds)
