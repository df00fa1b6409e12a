"""The head of the certificate: what was stated about machine, instrument and environment."""

from collections.abc import Mapping

from thermaxis.files.settings import (
    HEADER_FIELDS,
    HEADER_GROUPS,
    LONGEST_COMMENT,
    LONGEST_TEXT,
    NORMALISED,
    HeaderField,
    moment_of,
    number_of,
)
from thermaxis.positioning import PositioningTest, StartEnd
from thermaxis.report._certified_report import CertifiedReport
from thermaxis.report._document import Block, Fields, Section
from thermaxis.report._moments import (
    ZONE_NOT_STATED,
    duration_words,
    in_file,
    moment_words,
    prevailing_moment,
    same_moment,
)
from thermaxis.report._names import CYCLE_NAMES
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._text import as_given, plain_text
from thermaxis.report.charts import runs_of_targets

_MOST_OTHER_LINES = 40
_ON_THE_FIRST_PAGE = ("certificate", "laboratory")
"""Groups that stand there as a whole."""
_FRONT_PAGE_TEXT = 120
"""Longest text on the first page; the whole of it stands among the conditions. [1]"""


_BY_INSTRUMENT = (
    "instrument: the deviations are already reduced to 20 °C (evidence: the environment factor;"
    " the rule was found from one published file)"
)
_MOMENTS = ("start", "end")
_SMALL = 0.1
"""A value of the environment below this keeps three digits. [any]"""


def _with_unit(text: str, unit: str) -> str:
    return f"{text} {unit}" if text and unit else text


def _shown(value: float) -> str:
    """Return a value of the environment; where three decimals say nothing, with three digits."""
    return as_given(round(value, 3)) if abs(value) >= _SMALL else as_given(float(f"{value:.3g}"))


def _start_end(value: StartEnd, unit: str) -> str:
    if value.start is not None and value.start == value.end:
        return f"{_with_unit(_shown(value.start), unit)} (start and end)"
    parts = [
        f"{_with_unit(_shown(number), unit)} ({moment})"
        for number, moment in ((value.start, "start"), (value.end, "end"))
        if number is not None
    ]
    return ", ".join(parts)


def _text(header: Mapping[str, str], key: str) -> str:
    limit = LONGEST_COMMENT if key == "comments" else LONGEST_TEXT
    return plain_text(header.get(key, ""), limit)


def _typed(report: CertifiedReport, key: str) -> str:
    """Return what was stated about a field beside the measured file; empty if nothing."""
    text = _text(report.header, key)
    return "" if text == _text(report.read_head.header, key) else text


def _measured(report: CertifiedReport, field: HeaderField) -> str:
    """Return what the measured file says about a field, as it is printed; empty if nothing."""
    test = report.read_head
    if field.key in _MOMENTS and (moment := in_file(test, field.key)) is not None:
        return moment_words(moment)
    if text := _text(test.header, field.key):
        return _with_unit(text, field.unit)
    if text := _text(report.header, field.in_file):
        return text
    if field.key in test.environment:
        return _start_end(test.environment[field.key], field.unit)
    if field.key == "nde_applied_by" and _text(report.header, NORMALISED).startswith("yes"):
        return _BY_INSTRUMENT
    return ""


def _same_number(report: CertifiedReport, field: HeaderField, measured: str) -> bool:
    """Return whether a typed number is the one of the measured file, there perhaps twice."""
    typed = number_of(_typed(report, field.key))
    both = report.read_head.environment.get(field.key)
    if both is not None and field.key not in report.read_head.header:
        return typed is not None and {both.start, both.end} - {None} == {typed}
    return typed is not None and typed == number_of(measured.removesuffix(field.unit))


def _same_moment(report: CertifiedReport, key: str) -> bool:
    typed, measured = moment_of(_typed(report, key)), in_file(report.read_head, key)
    return typed is not None and measured is not None and same_moment(typed, measured)


def _both(typed: str, measured: str) -> str:
    """Return two statements about one thing, or the only one."""
    if typed and measured and typed != measured:
        return f"stated {typed}; in the file {measured}"
    return typed or measured


def prevailing(report: CertifiedReport, key: str) -> str:
    """Return the value of a field without its remarks; empty if it is not stated."""
    field = HEADER_FIELDS[key]
    typed = _typed(report, key)
    if key in _MOMENTS and (moment := moment_of(typed)) is not None:
        return moment_words(moment)
    return _with_unit(typed, field.unit) or _measured(report, field)


def stated(report: CertifiedReport, key: str) -> str:
    """Return the value of a field as it is printed; empty if nobody stated it."""
    field = HEADER_FIELDS[key]
    shown, measured = prevailing(report, key), _measured(report, field)
    if measured.startswith((f"{shown},", f"{shown}:")):
        return measured
    if key in _MOMENTS and _same_moment(report, key):
        return measured if shown.endswith(ZONE_NOT_STATED) else shown
    return shown if _same_number(report, field, measured) else _both(shown, measured)


def _duration(report: CertifiedReport) -> str:
    """Return the time between the start and the end that are printed."""
    test, header = report.read_head, report.header
    measured = duration_words(in_file(test, "start"), in_file(test, "end"))
    typed = duration_words(
        prevailing_moment(test, header, "start"), prevailing_moment(test, header, "end")
    )
    return _both(typed, measured)


def _days(report: CertifiedReport) -> str:
    """Return the days of the measurement."""
    if report.performed is None:
        return ""
    return " to ".join(dict.fromkeys(day.isoformat() for day in report.performed))


def _known_by_the_run(report: CertifiedReport, group: str) -> list[tuple[str, str]]:
    """Return fields of a group that nobody states, as the run or the program knows them."""
    if not isinstance(report, PositioningReport):
        return [("Duration", _duration(report))] if group == "time" else []
    test = report.test
    if group == "procedure":
        unit = test.kind.units.position
        first, last = as_given(float(test.target[0])), as_given(float(test.target[-1]))
        directions = "unidirectional" if test.unidirectional else "bidirectional"
        return [
            ("Targets", f"{test.target.size}, from {first} to {last} {unit}"),
            ("Runs per direction", runs_of_targets(report)),
            ("Kind of cycle", CYCLE_NAMES[test.cycle]),
            ("Directions", directions),
        ]
    if group == "time":
        return [("Duration", _duration(report)), ("Source of the times", _time_source(test))]
    return []


def _time_source(test: PositioningTest) -> str:
    return {
        "file": "a time for every reading",
        "interpolated": "spread evenly within stated times; see the remarks",
        "order": f"none; the order of readings is {'assumed' if test.order_deduced else 'known'}",
        "none": "none",
    }[str(test.time_source)]


def _groups(report: CertifiedReport) -> list[Block]:
    """Return what was stated or is known, group by group; the rest is left out."""
    kind = report.test.kind if isinstance(report, PositioningReport) else None
    groups = {
        group.title: [
            *(
                (one.label, stated(report, one.key))
                for one in group.fields
                if one.only in (None, kind)
            ),
            *_known_by_the_run(report, group.name),
        ]
        for group in HEADER_GROUPS
        if group.name not in _ON_THE_FIRST_PAGE
    }
    shown = {title: tuple(row for row in rows if row[1]) for title, rows in groups.items()}
    return [Fields(title, rows) for title, rows in shown.items() if rows]


def _traceability(report: CertifiedReport, sha256: str, options: str) -> Fields:
    return Fields(
        "Data and program",
        (
            ("Measurement file", plain_text(report.source_name, 200) or "?"),
            ("SHA-256 of the measurement file", report.source_sha256),
            ("SHA-256 of the results (results.json)", sha256),
            ("Software", f"thermaxis {report.version}"),
            *([("Options of reading and evaluation", options)] if options else []),
        ),
        code=True,
    )


def _other_lines(report: CertifiedReport) -> list[Block]:
    """Return header lines and environment values that no field of the certificate takes."""
    shown_elsewhere = {field.in_file for field in HEADER_FIELDS.values()}
    texts = {
        key: plain_text(value, 300)
        for key, value in report.header.items()
        if key not in shown_elsewhere
    } | {key: _start_end(value, "") for key, value in report.read_head.environment.items()}
    lines = [
        (plain_text(key, 60).replace("_", " ") or "?", text)
        for key, text in texts.items()
        if text and key not in HEADER_FIELDS
    ]
    if not lines:
        return []
    shown = lines[:_MOST_OTHER_LINES]
    if len(lines) > len(shown):
        shown.append(("…", f"{len(lines) - len(shown)} more"))
    return [Fields("Further lines of the measurement file", tuple(shown))]


def issuer(report: CertifiedReport) -> tuple[str, ...]:
    """Return the laboratory, as the head of the first page names it: a name, and what follows."""
    keys = ("address", "country", "mark", "email", "phone")
    parts = [(key, stated(report, f"laboratory_{key}")) for key in keys]
    shown = (f"mark {part}" if key == "mark" else part for key, part in parts if part)
    lines = (stated(report, "laboratory"), " · ".join(shown))
    return tuple(line for line in lines if line)


def identification(report: CertifiedReport) -> Fields:
    """Return the few lines that say what was tested by whom, for the top of the first page."""
    number = _first(report, "certificate_number")
    issued = report.issued
    rows = (
        ("Certificate number", number),
        ("Date of issue", "" if issued is None else issued.isoformat()),
        ("Customer", _first(report, "customer", "customer_address")),
        ("Title", _first(report, "title")),
        (
            "Machine",
            _first(report, "machine_manufacturer", "machine", "machine_model", "machine_type"),
        ),
        ("Serial number", _first(report, "serial_number")),
        ("Axis under test", _first(report, "axis")),
        ("Instrument", _first(report, "instrument", "instrument_serial_number")),
        (
            "Instrument's certificate",
            _first(report, "instrument_certificate_number", "instrument_traceability"),
        ),
        ("Date of the test", _days(report)),
        ("Place of the test", stated(report, "performed_at")),
        ("Inspector", _first(report, "inspector")),
        ("Measurement file", plain_text(report.source_name, _FRONT_PAGE_TEXT)),
    )
    return Fields("", tuple(row for row in rows if row[1]))


def _first(report: CertifiedReport, *keys: str) -> str:
    """Return fields as the first page shows them, one behind the other."""
    texts = dict.fromkeys(stated(report, key) for key in keys)
    return plain_text(" · ".join(text for text in texts if text), _FRONT_PAGE_TEXT)


def statements(report: CertifiedReport) -> tuple[str, ...]:
    """Return what a certificate says of itself: what it is for, and that a draft is one."""
    said = ["The results relate only to the item tested, in its state at the time of the test."]
    laboratory = prevailing(report, "laboratory")
    if reproduction := prevailing(report, "reproduction"):
        said.append(reproduction)
    elif laboratory:
        said.append(f"It may be reproduced only in full, unless {laboratory} agrees in writing.")
    if report.missing_fields:
        said.append(f"Draft, without {report.missing_labels}.")
    return tuple(said)


def condition_section(report: CertifiedReport, sha256: str, options: str = "") -> Section:
    """Return every stated field of the head, group by group, and the hash of the results."""
    data = _traceability(report, sha256, options)
    blocks = (*_groups(report), data, *_other_lines(report))
    return Section("Conditions of the test", blocks)
