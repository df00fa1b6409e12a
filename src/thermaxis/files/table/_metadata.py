"""The lines of comment above a table: header, environment and what the columns cannot say."""

import json
import re
from dataclasses import dataclass, field
from datetime import datetime
from typing import final

from thermaxis.codes import Message, Place, remark
from thermaxis.errors import MeasurementFileError
from thermaxis.files.table._columns import Role, role_named, unit_named
from thermaxis.files.table._source import clean_text, decoded, encoded, parse_number, quoted
from thermaxis.files.table._times import parse_moment
from thermaxis.messages import sentence_of
from thermaxis.positioning import Cycle, PositioningTest, StartEnd, TimeSource

MAX_FIELDS = 500
"""Number of header fields, of environment values and of remarks that are kept. [1]"""

_NAMED = re.compile(r"(header|environment)\s+(\S.*)", re.DOTALL)
_WORD = re.compile(r"[^\W\d]\w{0,79}")
_NOT_WORD = re.compile(r"\W+")
_UNIT_WORDS = frozenset({"unit", "units", "einheit", "einheiten", "jednotka", "jednotky"})
_FILLERS = frozenset({"of", "the", "der", "measure", "measurement"})
_KNOWN_FIELDS = {
    "serial_no": "serial_number",
    "serial": "serial_number",
    "machine_name": "machine",
    "by": "inspector",
    "operator": "inspector",
    "axis_name": "axis",
    "test_title": "title",
}


@final
@dataclass(slots=True)
class Metadata:
    """What stands in comments and above the headings of a table, collected line by line."""

    header: dict[str, str] = field(default_factory=dict[str, str])
    environment: dict[str, StartEnd] = field(default_factory=dict[str, StartEnd])
    """Values of the environment; the unit ends the key."""
    remarks: list[Message] = field(default_factory=list[Message])
    """Remarks that the file carries."""
    start: datetime | None = None
    """Stated time of the first reading."""
    end: datetime | None = None
    """Stated time of the last reading."""
    cycle: Cycle = Cycle.STANDARD
    interpolated: bool = False
    """Whether the times of the file were spread evenly, not measured."""
    order_deduced: bool = False
    """Whether the order of the file was deduced."""
    unit: str | None = None
    """Stated unit, of whatever states none."""
    unit_in_doubt: bool = False
    """Whether a unit is stated of something unknown, which may be the deviations."""
    units: dict[Role, str] = field(default_factory=dict[Role, str])
    """Stated units of targets and deviations."""
    kind: str | None = None
    """Stated kind of the axis."""

    def read_comment(self, text: str, place: Place) -> None:
        """Take what a line of comment says."""
        named = _NAMED.fullmatch(text)
        if named is not None:
            key, value = _key_and_value(named[2])
            if key and named[1] == "header":
                self._keep(key, value)
            elif key and len(self.environment) < MAX_FIELDS:
                self.environment[key] = _start_end(value, place)
            return
        key, separator, value = text.partition(":")
        if not separator:
            return
        key = _field_name(key)
        if not self._take_known(key, value.strip(), place):
            self.read_pair(key, decoded(value.strip()))

    def read_pair(self, key: str, value: str) -> None:
        """Keep a header field of a file that another program wrote."""
        name = _field_name(key)
        text = clean_text(value)
        if not name or not text:
            return
        words = name.split("_")
        if not _UNIT_WORDS.isdisjoint(words):
            rest = [w.removesuffix("s") for w in words if w not in _UNIT_WORDS | _FILLERS]
            role = role_named(" ".join(rest)) if rest else None
            if role is not None:
                self.units.setdefault(role, text)
            elif rest:
                self.unit_in_doubt |= unit_named(text) is not None
            elif self.unit is None:
                self.unit = text
        self._keep(_KNOWN_FIELDS.get(name, name), text)

    def _keep(self, key: str, value: str) -> None:
        if key in self.header or len(self.header) < MAX_FIELDS:
            self.header[key] = value

    def _take_known(self, key: str, value: str, place: Place) -> bool:
        if key == "start":
            self.start = _moment(value, key, place)
        elif key == "end":
            self.end = _moment(value, key, place)
        elif key == "remark":
            if len(self.remarks) < MAX_FIELDS:
                self.remarks.append(remark("of_file", said=_allowed(decoded(value))))
        elif key == "kind":
            self.kind = value
        elif key == "cycle" and value in set(Cycle):
            self.cycle = Cycle(value)
        elif key == "time_source" and value in set(TimeSource):
            self.interpolated = value == TimeSource.INTERPOLATED
        elif key == "order_deduced" and value in {"yes", "no"}:
            self.order_deduced = value == "yes"
        else:
            return False
        return True


def metadata_lines(test: PositioningTest) -> list[str]:
    """Write what the columns of a tidy table cannot say as lines of comment."""
    lines = [f"# kind: {test.kind}", f"# cycle: {test.cycle}"]
    lines += [
        f"# header {_key(key)}: {encoded(value)}".rstrip() for key, value in test.header.items()
    ]
    for key, value in test.environment.items():
        lines.append(f"# environment {_key(key)}: {_number(value.start)} {_number(value.end)}")
    for key, moment in (("start", test.start), ("end", test.end)):
        if moment is not None:
            lines.append(f"# {key}: {moment.isoformat()}")
    if test.time_source is TimeSource.INTERPOLATED:
        lines.append(f"# time_source: {TimeSource.INTERPOLATED}")
    if test.order_deduced:
        lines.append("# order_deduced: yes")
    said = dict.fromkeys(map(sentence_of, test.remarks))
    lines += [f"# remark: {encoded(remark)}" for remark in said]
    return lines


def _key(key: str) -> str:
    return key if _WORD.fullmatch(key) is not None else quoted(key)


def _key_and_value(text: str) -> tuple[str, str]:
    if text.startswith('"'):
        try:
            key, end = json.JSONDecoder().raw_decode(text)
        except ValueError:
            return "", ""
        rest = text[end:]
    else:
        key, colon, rest = text.partition(":")
        key, rest = key.strip(), colon + rest
    if not isinstance(key, str) or not rest.startswith(":"):
        return "", ""
    value = rest[1:].strip()
    return _allowed(key), _allowed(decoded(value))


def _allowed(text: str) -> str:
    """Replace what no file of text or XML may contain, so that every report can show the text.

    Not `clean_text`, which also cuts, strips and flattens: what this package wrote has to come
    back as it was, line ends and blanks included.
    """
    return "".join(c if _is_allowed(c) else "\N{REPLACEMENT CHARACTER}" for c in text)


def _is_allowed(character: str) -> bool:
    code = ord(character)
    if 0xD800 <= code <= 0xDFFF or code in {0xFFFE, 0xFFFF}:
        return False
    return code >= 0x20 or character in "\t\n\r"


def _field_name(key: str) -> str:
    return _NOT_WORD.sub("_", key.casefold()).strip("_")[:80]


def _number(value: float | None) -> str:
    return "none" if value is None else repr(float(value))


def _start_end(text: str, place: Place) -> StartEnd:
    words = text.split()
    if len(words) != 2:
        raise MeasurementFileError("not_start_and_end", text=text, place=place)
    start, end = (None if word == "none" else parse_number(word, place) for word in words)
    return StartEnd(start, end)


def _moment(text: str, key: str, place: Place) -> datetime:
    moment = parse_moment(text)
    if moment is None:
        raise MeasurementFileError("not_a_moment", text=text, place=place._replace(column=key))
    return moment
