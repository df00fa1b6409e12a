"""What the headings of a table mean: the role of a column, its unit, the words in it."""

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final, NamedTuple, final

import numpy as np

from thermaxis.files.table._mapping import NO_MAPPING, RunColumn, RunMapping
from thermaxis.files.table._source import decoded, unprotected
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
        target target_position nominal nominal_position position pos set set_position setpoint
        soll sollposition sollpos sollwert ziel zielposition nennposition
        cible position_cible
        cil cilova_poloha cilova_pozice poloha pozice zadana_poloha zadana_pozice pozadovana_poloha
        jmenovita_poloha
    """,
    Role.MEASURED: """
        measured actual ist istposition istpos istwert gemessen gemessene messposition
        zmereno zmerena_poloha zmerena_pozice namerena_poloha namerena_pozice merena_poloha
        skutecna_poloha skutecna_pozice
    """,
    Role.DEVIATION: """
        deviation deviations dev positional_deviation error err positional_error positioning_error
        abweichung abw positionsabweichung positionierabweichung lageabweichung fehler
        positionsfehler positionierfehler ecart ecarts ecart_de_position
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
        smer smer_najezdu smer_pohybu sens sens_d_approche
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
    (
        Unit("µin", _LINEAR, (25.4, 1e6), (25.4, 1e3), None),
        ("uin", "microinch", "microinches"),
    ),
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
_SEPARATORS = re.compile(r"[\s_.:#-]+")
_POSITION_WORDS = re.compile(r"(?:^|_)(?:pos|position)(?=_|$)")
_PASS_TOKENS = re.compile(r"[^\W\d_]+|[0-9]+|[^\w\s.:#()\[\]]")
_CYCLE_WORDS = "cycle cycles zyklus messzyklus cyklus"
_RUN_WORDS = "run pass lauf messlauf durchlauf beh prujezd prejezd"
_COUNTED = {
    **dict.fromkeys(_CYCLE_WORDS.split(), Role.CYCLE),
    **dict.fromkeys(_RUN_WORDS.split(), Role.RUN),
}
_PASS_FILLERS = frozenset(f"{_ROLE_WORDS[Role.DEVIATION]} no nr".split())
_LABEL_FILLERS = frozenset(
    f"{_ROLE_WORDS[Role.DIRECTION]} c cislo of der pos position polohy readings data".split()
)
_DATE_WORDS = frozenset({"date", "datum", "day", "tag", "den"})
_SUMMARY_LIST = """
    mean average avg median mittel mittelwert mittelwerte mw durchschnitt prumer stredni
    std stddev stdev stdabw standard standardabweichung stabw smerodatna s sigma
    min max minimum maximum range span spannweite rozpeti sum total summe celkem count anzahl
    pocet reversal umkehrspanne necitlivost uncertainty
"""
_SUMMARY_WORDS = frozenset(_SUMMARY_LIST.split())
_SIGMAS = re.compile(r"[+±-]?\s*[0-9]*\s*(?:s|σ|sigma)(?!\w)")
_POSITION_NUMBER = re.compile(r"(?:pos|neg)(?<![^\W_]...)[\W_]*[0-9]")

_FORWARD_WORDS = """
    forward forwards fwd up go positive pos plus + ↑ aller cw
    hin vor hinlauf hinfahrt vorwarts vorwaerts aufwarts aufwaerts positiv
    vpred dopredu tam nahoru kladny kladna kladne
"""
_DASHES = "-\N{MINUS SIGN}\N{EN DASH}"
_LEADING_SIGNS = frozenset(f"+{_DASHES}")
_BACKWARD_WORDS = """
    backward backwards back bwd reverse rev return down negative neg minus ↓
    - \N{MINUS SIGN} \N{EN DASH}
    her ruck rueck retour ccw
    zuruck zurueck rucklauf ruecklauf ruckfahrt rueckfahrt ruckwarts rueckwaerts abwarts abwaerts
    negativ
    vzad dozadu zpet dolu zaporny zaporna zaporne
"""
_LETTERS = dict.fromkeys("fvh", FORWARD) | dict.fromkeys("brz", BACKWARD)
_DIRECTIONS = {
    **dict.fromkeys(_FORWARD_WORDS.split(), FORWARD),
    **dict.fromkeys(_BACKWARD_WORDS.split(), BACKWARD),
}


@final
@dataclass(frozen=True, slots=True)
class Heading:
    """The heading of one column."""

    text: str
    role: Role | None
    """What the column holds, None if its name is not known."""
    unit: Unit | None = None
    """Unit of a target, measured position or deviation, None if not stated."""
    unit_text: str = ""
    """What stands in brackets, for the error about an unknown unit."""
    seconds: float | None = None
    """Length of the time unit of a column of numbers; None if times are dates with time. [s]"""
    run: int | None = None
    """Number of the run or cycle whose readings the column of a wide table holds. [1]"""
    approach: int | None = None
    """Approach whose readings the column holds, if stated."""
    by_letter: bool = False
    """Whether one letter alone states the approach: F1, B1."""

    @property
    def is_pass(self) -> bool:
        """Whether the column holds the deviations of one pass."""
        return self.run is not None or self.approach is not None

    @property
    def channel_name(self) -> str:
        """Name under which the column is kept if its role is not known."""
        if self.text.startswith(CHANNEL_PREFIX):
            return decoded(self.text.removeprefix(CHANNEL_PREFIX).strip())
        return self.text


def parse_heading(text: str, mapping: RunMapping = NO_MAPPING) -> Heading:
    """Find role and unit of a column."""
    text = text.strip()
    stated = mapping.columns.get(text)
    if stated is not None:
        return _mapped(text, stated)
    if text.startswith(CHANNEL_PREFIX) or len(text) > LONGEST_HEADING:
        return Heading(text, None)
    written, unit_word, in_brackets = _split_unit(text)
    name = _SEPARATORS.sub("_", written).strip("_")
    role = _ROLES.get(name) or _ROLES.get(_POSITION_WORDS.sub("", name).strip("_"))
    if role is Role.TIME:
        return _time_heading(text, unit_word)
    unit = _UNIT_WORDS.get(unit_word)
    if role in QUANTITIES:
        return Heading(text, role, unit, unit_word)
    in_unit = unit_word if unit_word in _DIRECTIONS else ""
    found = pass_named(f"{written} {in_unit}".strip())
    if found is not None and not (role is not None and found.number is None):
        unit_word = "" if in_unit else unit_word
        return Heading(text, None, unit, unit_word, None, found.number, *found[1:3])
    return Heading(text, role if in_brackets or not unit_word else None)


def _mapped(text: str, stated: RunColumn) -> Heading:
    unit = _UNIT_WORDS.get(_folded(stated.unit))
    if stated.leave_out:
        return Heading(text, None)
    if stated.cycle is not None and stated.direction is not None:
        run = 2 * stated.cycle - (stated.direction == "forward")
        return Heading(text, None, unit, stated.unit, run=run)
    if stated.role is None:
        return replace(parse_heading(text), unit=unit, unit_text=stated.unit)
    role = Role(stated.role)
    if role is Role.TIME:
        return _time_heading(text, _folded(stated.unit))
    return Heading(text, role, unit, stated.unit)


class Pass(NamedTuple):
    """A pass along the targets, as a heading or a line above a block names it."""

    number: int | None = None
    """Number of the run or cycle. [1]"""
    approach: int | None = None
    by_letter: bool = False
    """Whether one letter alone states it."""
    counted: Role | None = None
    """Whether runs or cycles are counted, if a word says so."""
    unit: Unit | None = None
    """Unit of its deviations, if stated: Forward deviations in um."""


NO_PASS = Pass()


def pass_named(folded: str) -> Pass | None:
    """Return the pass that folded words name, None if they say anything else."""
    if _POSITION_NUMBER.search(folded):
        return None  # of a position, or of a pass in the positive direction
    number = approach = counted = None
    by_letter = False
    words = _PASS_TOKENS.findall(folded)
    for k, word in enumerate(words):
        if word in _DASHES and 0 < k < len(words) - 1:
            continue  # between words
        found = _LETTERS.get(word, _DIRECTIONS.get(word))
        if word.isdecimal() and number is None and 0 < int(word[:9]) < 100_000:
            number = int(word)
        elif found is not None and approach is None and (k or word not in _LEADING_SIGNS):
            approach, by_letter = found, word in _LETTERS
        elif word in _COUNTED:
            counted = _COUNTED[word]
        elif word not in _PASS_FILLERS and word not in _LABEL_FILLERS:
            return None
    if number is None and (approach is None or by_letter):
        return None
    if approach is None and counted is None and not _LABEL_FILLERS.isdisjoint(words):
        return None
    return Pass(number, approach, by_letter, counted)


def label_named(cells: Sequence[str]) -> Pass | None:
    """Return the pass that a row of words above a block of readings names, None if none."""
    written, unit_word, _ = _split_unit(" ".join(cells))
    unit = _UNIT_WORDS.get(unit_word)
    of_deviations = _SEPARATORS.sub("_", written).strip("_").removesuffix("_in").split("_")
    if unit is None or not _PASS_FILLERS & {*of_deviations[-1:]}:
        unit, of_deviations = None, [_folded(" ".join(cells))]
    found = pass_named(" ".join(of_deviations)) if len(cells) <= 3 else None
    if found is None or found.by_letter or (found.approach is None and found.counted is None):
        return None
    return found._replace(unit=unit)


def is_summary(text: str) -> bool:
    """Say whether a word stands for what is computed from readings: Mean, 2s, Mittelwert."""
    folded = _folded(text)
    word = re.match(r"[+±-]?\s*([^\W\d_]+)(?!\d)", folded)
    return (word is not None and word[1] in _SUMMARY_WORDS) or _SIGMAS.match(folded) is not None


def unit_named(text: str) -> Unit | None:
    """Return the unit of a length or an angle by its name, None if it is not known."""
    return _UNIT_WORDS.get(_folded(text))


def without_unit(text: str) -> str:
    """Return a heading without the unit of a length or of an angle at its end."""
    written, word, _ = _split_unit(text)
    return written.strip() if word in _UNIT_WORDS else text


def deviation_unit(kind: AxisKind) -> Unit:
    """Return the unit of deviations of a kind of axis: µm or arcsec."""
    return _UNIT_WORDS[kind.units.deviation_suffix]


def direction_named(word: str, mapping: RunMapping = NO_MAPPING) -> int | None:
    """Return the approach that a word means, None if it is not known."""
    stated = mapping.directions.get(word)
    return _DIRECTIONS.get(_folded(stated or unprotected(word)))


def is_date_name(text: str) -> bool:
    """Say whether a heading names a column of dates."""
    return _folded(text) in _DATE_WORDS


def role_named(text: str) -> Role | None:
    """Return the role that the words of a name have."""
    return parse_heading(text).role


def _folded(text: str) -> str:
    """Return a word in lower case, without accents, and with u for the two letters µ and μ."""
    if text.isascii():
        return text.casefold().strip()
    parts = unicodedata.normalize("NFD", text.casefold())
    plain = "".join(c for c in parts if not unicodedata.combining(c))
    return plain.replace("μ", "u").strip()


def _split_unit(text: str) -> tuple[str, str, bool]:
    folded = _folded(text)
    match = _BRACKETS.fullmatch(folded)
    if match is not None:
        return match["name"], match["unit"].replace(" ", ""), True
    words = [word for word in _SEPARATORS.split(folded) if word]
    if len(words) > 1 and (words[-1] in _UNIT_WORDS or words[-1] in _TIME_UNITS):
        return folded[: folded.rindex(words[-1])], words[-1], False
    return folded, "", False


def _time_heading(text: str, unit_word: str) -> Heading:
    if not unit_word or unit_word in {"iso", "iso8601", "utc"}:
        return Heading(text, Role.TIME)
    seconds = _TIME_UNITS.get(unit_word)
    return Heading(text, None if seconds is None else Role.TIME, seconds=seconds)
