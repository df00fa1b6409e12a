"""What the headings of a table mean: the role of a column, its unit, the words in it."""

import re
import unicodedata
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, final

import numpy as np

from thermaxis.files.table._quoting import decoded, unprotected
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

# Words as `_folded` leaves them: lower case, without accents, an underscore between words.
_ROLE_WORDS: dict[Role, str] = {
    Role.TARGET: """
        target target_position target_pos nominal nominal_position position set_position setpoint
        soll sollposition soll_position sollpos sollwert ziel zielposition nennposition
        cil cilova_poloha cilova_pozice poloha pozice zadana_poloha zadana_pozice pozadovana_poloha
        jmenovita_poloha
    """,
    Role.MEASURED: """
        measured measured_position measured_pos actual actual_position actual_pos
        ist istposition ist_position istpos istwert gemessen gemessene_position messposition
        zmereno zmerena_poloha zmerena_pozice namerena_poloha namerena_pozice merena_poloha
        skutecna_poloha skutecna_pozice
    """,
    Role.DEVIATION: """
        deviation positional_deviation position_deviation error position_error positional_error
        positioning_error
        abweichung positionsabweichung positionierabweichung lageabweichung fehler positionsfehler
        positionierfehler
        odchylka odchylka_polohy polohova_odchylka uchylka uchylka_polohy polohova_uchylka chyba
        chyba_polohy chyba_polohovani
    """,
    Role.CYCLE: """
        cycle cycle_no cycle_number zyklus zyklus_nr zyklusnummer messzyklus cyklus cislo_cyklu
    """,
    Role.RUN: """
        run run_no run_number pass_no pass_number lauf lauf_nr laufnummer messlauf durchlauf
        beh cislo_behu prujezd prejezd
    """,
    Role.DIRECTION: """
        direction approach approach_direction direction_of_approach
        richtung anfahrrichtung bewegungsrichtung fahrtrichtung messrichtung verfahrrichtung
        smer smer_najezdu smer_pohybu
    """,
    Role.ORDER: "order sequence reihenfolge messreihenfolge poradi",
    Role.TIME: """
        time timestamp time_stamp date_time datetime
        zeit zeitstempel zeitpunkt uhrzeit datum_zeit datum_uhrzeit datum_und_uhrzeit
        cas datum_cas datum_a_cas casova_znacka
    """,
}
_ROLES = {word: role for role, words in _ROLE_WORDS.items() for word in words.split()}


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
_TIME_UNIT_WORDS = {
    1e-6: "us",
    1e-3: "ms",
    1.0: "s sec seconds sek sekunden sekundy",
    60.0: "min minutes minuten minuty",
    3600.0: "h hours stunden hod hodiny",
}
_TIME_UNITS = {
    word: seconds for seconds, words in _TIME_UNIT_WORDS.items() for word in words.split()
}

_BRACKETS = re.compile(r"(?P<name>.*?)\s*[(\[]\s*(?P<unit>[^()\[\]]*?)\s*[)\]]", re.DOTALL)
_RUN_WORDS = "run|pass|lauf|messlauf|durchlauf|beh|prujezd|prejezd"
_ERROR_WORDS = "|".join(_ROLE_WORDS[Role.DEVIATION].split())
_RUN_HEADING = re.compile(
    rf"(?:(?:{_ERROR_WORDS})_)?(?:(?:{_RUN_WORDS})?_?(?:(?:no|nr|c|cislo)_)?0{{0,3}}([1-9][0-9]{{0,4}})"
    rf"|0{{0,3}}([1-9][0-9]{{0,4}})_(?:{_RUN_WORDS}))(?:_(?:{_ERROR_WORDS}))?"
)
_SEPARATORS = re.compile(r"[\s_.:#-]+")

_FORWARD_WORDS = """
    forward forwards fwd up positive pos plus + ↑
    hin hinlauf hinfahrt vorwarts vorwaerts aufwarts aufwaerts positiv
    vpred dopredu tam nahoru kladny kladna kladne
"""
_BACKWARD_WORDS = """
    backward backwards back bwd reverse rev return down negative neg minus ↓
    - \N{MINUS SIGN} \N{EN DASH}
    zuruck zurueck rucklauf ruecklauf ruckfahrt rueckfahrt ruckwarts rueckwaerts abwarts abwaerts
    negativ
    vzad dozadu zpet dolu zaporny zaporna zaporne
"""
_DIRECTIONS = {
    **dict.fromkeys(_FORWARD_WORDS.split(), FORWARD),
    **dict.fromkeys(_BACKWARD_WORDS.split(), BACKWARD),
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
    """Find role and unit of a column."""
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
        return Heading(text, None, unit, unit_word, run=int(run[1] or run[2]))
    if role is not None and (in_brackets or not unit_word):
        return Heading(text, role)
    return Heading(text, None)


def unit_named(text: str) -> Unit | None:
    """Return the unit of a length or an angle by its name, None if it is not known."""
    return _UNIT_WORDS.get(_folded(text))


def deviation_unit(kind: AxisKind) -> Unit:
    """Return the unit of deviations of a kind of axis: µm or arcsec."""
    return _UNIT_WORDS[kind.units.deviation_suffix]


def direction_named(word: str) -> int | None:
    """Return the approach that a word means, None if it is not known."""
    return _DIRECTIONS.get(_folded(unprotected(word)))


def _folded(text: str) -> str:
    """Return a word in lower case, without accents, and with u for the two letters µ and μ."""
    parts = unicodedata.normalize("NFD", text.casefold())
    plain = parts if parts.isascii() else "".join(c for c in parts if not unicodedata.combining(c))
    return plain.replace("μ", "u").strip()


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
