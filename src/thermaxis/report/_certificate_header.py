"""The head of the certificate: what was stated about machine, instrument and environment."""

from thermaxis.positioning import PositioningTest, StartEnd
from thermaxis.report._document import Block, Fields, Section, Signature
from thermaxis.report._header import (
    HEADER_FIELDS,
    HEADER_GROUPS,
    LONGEST_COMMENT,
    LONGEST_TEXT,
    HeaderField,
)
from thermaxis.report._names import CYCLE_NAMES, edition_name
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._text import NOT_STATED, as_given, plain_text

_MOST_OTHER_LINES = 40
_FRONT_PAGE_TEXT = 80
"""Longest text on the first page; the whole of it stands among the conditions. [1]"""


def _start_end(value: StartEnd, unit: str) -> str:
    parts = [
        f"{as_given(number)}{f' {unit}' if unit else ''} ({moment})"
        for number, moment in ((value.start, "start"), (value.end, "end"))
        if number is not None
    ]
    return ", ".join(parts)


def _from_test(test: PositioningTest, key: str) -> str:
    """Return what the measured run itself says about a field; empty if nothing."""
    if key == "start" and test.start is not None:
        return test.start.isoformat(sep=" ", timespec="seconds")
    if key == "end" and test.end is not None:
        return test.end.isoformat(sep=" ", timespec="seconds")
    return ""


def stated(report: PositioningReport, key: str) -> str:
    """Return the value of a field as it is printed; empty if nobody stated it.

    Parameters
    ----------
    report : PositioningReport
        What was evaluated.
    key : str
        Key of the field.
    """
    field = HEADER_FIELDS[key]
    limit = LONGEST_COMMENT if key == "comments" else LONGEST_TEXT
    text = plain_text(report.header.get(key, ""), limit)
    if text:
        return f"{text} {field.unit}" if field.unit else text
    text = plain_text(report.header.get(field.in_file, ""), limit)
    if text:
        return text
    measured = report.test.environment.get(key)
    if measured is not None:
        return _start_end(measured, field.unit)
    return plain_text(_from_test(report.test, key), limit)


def _duration(test: PositioningTest) -> str:
    if test.start is None or test.end is None:
        return NOT_STATED
    seconds = round((test.end - test.start).total_seconds())
    hours, rest = divmod(max(0, seconds), 3600)
    return f"{hours} h {rest // 60:02d} min {rest % 60:02d} s"


def _known_by_the_run(report: PositioningReport, group: str) -> list[tuple[str, str]]:
    """Return fields of a group that nobody states, as the run or the program knows them."""
    test = report.test
    if group == "procedure":
        unit = test.kind.units.position
        first, last = as_given(float(test.target[0])), as_given(float(test.target[-1]))
        directions = "unidirectional" if test.unidirectional else "bidirectional"
        return [
            ("Targets", f"{test.target.size}, from {first} to {last} {unit}"),
            ("Runs per direction", str(test.cycles)),
            ("Kind of cycle", CYCLE_NAMES[test.cycle]),
            ("Directions", directions),
        ]
    if group == "time":
        return [("Duration", _duration(test)), ("Source of the times", _time_source(test))]
    return []


def _time_source(test: PositioningTest) -> str:
    return {
        "file": "a time for every reading",
        "interpolated": "spread evenly between start and end",
        "order": "none; the order of readings is known",
        "none": "none",
    }[str(test.time_source)]


def _group_fields(
    report: PositioningReport, name: str, fields: tuple[HeaderField, ...]
) -> tuple[tuple[str, str], ...]:
    kind = report.test.kind
    rows = [
        (field.label, stated(report, field.key) or NOT_STATED)
        for field in fields
        if field.only in (None, kind)
    ]
    return (*rows, *_known_by_the_run(report, name))


def _traceability(report: PositioningReport) -> Fields:
    return Fields(
        "Data and program",
        (
            ("Measurement file", plain_text(report.source_name, 200) or NOT_STATED),
            ("SHA-256 of the measurement file", report.source_sha256),
            ("Software", f"thermaxis {report.version}"),
            ("SHA-256 of the settings in effect", report.settings_sha256),
            ("Edition of the standard", edition_name(report.iso230_2.edition)),
        ),
        code=True,
    )


def _other_lines(report: PositioningReport) -> list[Block]:
    """Return header lines and environment values that no field of the certificate takes."""
    shown_elsewhere = {
        field.in_file for key, field in HEADER_FIELDS.items() if key not in report.header
    }
    lines = [
        (plain_text(key, 60).replace("_", " ") or "?", plain_text(value, 300) or NOT_STATED)
        for key, value in report.header.items()
        if key not in HEADER_FIELDS and key not in shown_elsewhere
    ]
    lines += [
        (plain_text(key, 60).replace("_", " ") or "?", _start_end(value, "") or NOT_STATED)
        for key, value in report.test.environment.items()
        if key not in HEADER_FIELDS
    ]
    if not lines:
        return []
    shown = lines[:_MOST_OTHER_LINES]
    if len(lines) > len(shown):
        shown.append(("…", f"{len(lines) - len(shown)} more"))
    return [Fields("Further lines of the measurement file", tuple(shown))]


def identification(report: PositioningReport) -> Fields:
    """Return the few lines that say what was tested, for the top of the first page.

    Parameters
    ----------
    report : PositioningReport
        What was evaluated.
    """
    date = report.certificate_date
    machine = [stated(report, key) for key in ("machine", "machine_model", "machine_type")]

    def first(text: str) -> str:
        return plain_text(text, _FRONT_PAGE_TEXT) or NOT_STATED

    return Fields(
        "",
        (
            ("Machine", first(" · ".join(part for part in machine if part))),
            ("Serial number", first(stated(report, "serial_number"))),
            ("Axis under test", first(stated(report, "axis"))),
            ("Title", first(stated(report, "title"))),
            ("Customer", first(stated(report, "customer"))),
            ("Inspector", first(stated(report, "inspector"))),
            ("Date of the certificate", NOT_STATED if date is None else date.isoformat()),
            ("Measurement file", first(report.source_name)),
        ),
    )


def condition_section(report: PositioningReport) -> Section:
    """Return every field of the head, group by group.

    Parameters
    ----------
    report : PositioningReport
        What was evaluated. A field that nobody stated is printed as not stated.
    """
    groups = [
        Fields(group.title, _group_fields(report, group.name, group.fields))
        for group in HEADER_GROUPS
    ]
    return Section(
        "Conditions of the test",
        (
            *groups,
            _traceability(report),
            *_other_lines(report),
            Signature(("Place and date", "Name and signature")),
        ),
    )
