"""Renishaw linear capture, ``.rtl``: text with sections, one row per reading."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import islice
from pathlib import Path
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, remark
from thermaxis.errors import ConfigurationError, DataError, MeasurementFileError
from thermaxis.files._opened import unwritable
from thermaxis.files.runs._assemble import (
    assemble_readings,
    check_enough_readings,
    check_last_number,
    missing_remark,
    rising_targets,
)
from thermaxis.files.runs._environment_factor import environment_factor_remarks, reduction_to_20_c
from thermaxis.files.table import (
    SourceText,
    clean_text,
    first_few,
    parse_number,
    parse_whole_number,
)
from thermaxis.positioning import (
    BACKWARD,
    FORWARD,
    Cycle,
    FloatArray,
    PositioningTest,
    StartEnd,
    TimeSource,
)
from thermaxis.quantities import AxisKind

SENSOR_ABSENT_C = -10.0
"""Material temperature that marks a sensor that is not there. [°C]"""

_Line: TypeAlias = tuple[int, str]
_IntArray: TypeAlias = NDArray[np.int64]

_SECTIONS = (
    *("HEADER", "TARGET DATA", "USER-TEXT", "RUNS"),
    *("DEVIATIONS", "EQUIPMENT", "ENVIRONMENT", "EOF"),
)
_SECTION_NAME = re.compile(r"([A-Za-z][A-Za-z -]*?) ?::")
_HEADER_KEYS = {
    "machine": "Machine",
    "serial_number": "Serial No",
    "date": "Date",
    "inspector": "By",
    "axis": "Axis",
    "location": "Location",
    "title": "TITLE",
}
_HEADER_NAMES = {label.lower(): key for key, label in _HEADER_KEYS.items()}
_FILE_KEYS = frozenset({"file_type", "owner", "version_no", "target_filetype", "flags"})
_ENVIRONMENT_LINES = (  # label, key, decimals, flag
    ("Air temp   : ", "air_temperature_c", 6, " 0"),
    ("Air press  : ", "air_pressure_kpa", 6, " 1"),
    ("Air humid  : ", "air_humidity_percent", 6, ""),
    ("Mat temp 1 : ", "material_temperature_1_c", 6, " 0"),
    ("Mat temp 2 : ", "material_temperature_2_c", 6, " 0"),
    ("Mat temp 3 : ", "material_temperature_3_c", 6, " 0"),
    ("Env factor : ", "environment_factor_um", 8, ""),
    ("Exp coeff  : ", "expansion_coefficient_ppm_per_k", 6, " 0"),
)
_ENVIRONMENT_NAMES = {label.rstrip(" :").lower(): key for label, key, _, _ in _ENVIRONMENT_LINES}
_MATERIAL_KEYS = tuple(f"material_temperature_{k}_c" for k in (1, 2, 3))
_FLAGS = "environment_flags"
_NORMALISED = "normalised_to_20_c"
_FLAG = re.compile(r"(\w+) ([0-9]{1,9})(?=,|$)", re.ASCII)
_MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_TIME_OF_DAY = re.compile(
    r"\s*([0-9]{1,2}):([0-9]{2})(?::([0-9]{2}))?\s+([A-Za-z]{3,9})\s+([0-9]{1,2})\s+([0-9]{4})\s*"
)
_MOST_TEXT_LINES = 200
_TARGETS_PER_LINE = 5
_TARGET_DECIMALS = 6


@final
@dataclass(frozen=True, slots=True)
class _Sections:
    """The lines of each section that are not blank, with their numbers in the file."""

    lines: Mapping[str, list[_Line]]
    ended: bool
    remarks: tuple[Message, ...]


@final
@dataclass(frozen=True, slots=True)
class _Rows:
    """The rows of DEVIATIONS as columns; targets count from 0 in the order of the file's list."""

    run: _IntArray
    target: _IntArray
    deviation_um: FloatArray
    line: _IntArray


@final
@dataclass(frozen=True, slots=True)
class _Environment:
    """What the section ENVIRONMENT states."""

    values: Mapping[str, StartEnd]
    start: datetime | None
    end: datetime | None
    header: Mapping[str, str]
    remarks: tuple[Message, ...]


def rtl_test(source: SourceText) -> PositioningTest:
    """Make a positioning test from the text of an ``.rtl`` file."""
    sections = _split_into_sections(source)
    _check_sections(source, sections)
    header, header_remarks = _read_header(sections)
    _check_linear(source, header)
    target_data = sections.lines["TARGET DATA"]
    target, descending = _read_targets(source, target_data)
    targets = int(target.size)
    flags, one_way, flag_remarks = _read_flags(source, target_data)
    run_count = _count(source, sections.lines["RUNS"], "Run-count")
    rows = _read_rows(source, sections, targets, run_count)
    if one_way:
        rows = _without_padding(source, rows)
    expected = range(1, run_count + 1, 2 if one_way else 1)
    completeness_remarks = _check_complete(source, sections, rows, targets, expected)
    environment = _read_environment(source, sections.lines.get("ENVIRONMENT", []))
    slot = _slots(rows, targets, one_way=one_way)
    time_s = _times(slot, environment)

    assembled = assemble_readings(
        at=source.at,
        target=target,
        target_index=targets - 1 - rows.target if descending else rows.target,
        cycle=(rows.run + 1) // 2,
        approach=(rows.run + 1) % 2,
        deviation=rows.deviation_um,
        line=rows.line,
        order=(1 + np.argsort(np.argsort(slot))).astype(np.float64),
        time_s=time_s,
    )
    test = PositioningTest(
        kind=AxisKind.LINEAR,
        target=target,
        deviation=assembled.deviation,
        time_source=TimeSource.ORDER if time_s is None else TimeSource.INTERPOLATED,
        time_s=assembled.time_s,
        order=assembled.order,
        order_deduced=True,
        start=environment.start,
        end=environment.end,
        environment=environment.values,
        header={**header, **flags, **environment.header},
        remarks=(
            *source.remarks,
            *sections.remarks,
            *header_remarks,
            *flag_remarks,
            *completeness_remarks,
            *_travel_remarks(rows, slot, descending=descending),
            *environment.remarks,
            remark("times_not_stated" if time_s is None else "times_interpolated"),
        ),
    )
    check_enough_readings(test, source.at())
    return test


def write_rtl(
    test: PositioningTest, path: Path | str, *, deviation_decimals: int = 3, encoding: str = "utf-8"
) -> None:
    """Write a run of a linear axis in the layout of a Renishaw ``.rtl`` file.

    Missing readings are left out. The even runs of a unidirectional forward test are filled with
    zeros, as other writers do. Targets get six decimals, start and end whole minutes; times per
    reading, channels, remarks and environment values outside the layout are not written.

    Parameters
    ----------
    deviation_decimals : int
        Printed decimals of deviations in µm. Default: a nanometre, as the instrument prints. [1]
    encoding : str
        Encoding of the texts; characters that it lacks become question marks. Default: UTF-8.

    Raises
    ------
    DataError
        If the axis is rotary, the cycle is not the standard one, or targets are the same when
        printed.
    ConfigurationError
        If the file cannot be written or there is no such encoding.
    """
    _check_writable(test)
    lines = [
        *_header_lines(test),
        *_deviation_lines(test, deviation_decimals),
        *_environment_lines(test),
        "EOF::",
    ]
    text = "".join(f"{line}\r\n" for line in lines)
    try:
        Path(path).write_bytes(text.encode(encoding, errors="replace"))
    except (OSError, LookupError, UnicodeError, ValueError) as error:
        raise unwritable(path, error, ConfigurationError) from error


# ---------------------------------------------------------------------------------- sections


def _split_into_sections(source: SourceText) -> _Sections:
    sections: dict[str, list[_Line]] = {}
    remarks: list[Message] = []
    name = ""
    for number, raw in enumerate(source.lines, start=1):
        text = raw.strip()
        if not text:
            continue
        title = _section_name(text, inside=name)
        if not name and title != "HEADER":
            raise MeasurementFileError("no_rtl_header", place=source.at(number))
        if title is not None and title in sections:
            raise MeasurementFileError("section_twice", section=title, place=source.at(number))
        if title is not None:
            name = title
            sections[name] = []
            if name not in _SECTIONS:
                remarks.append(remark("section_unknown", section=name))
        else:
            sections[name].append((number, text))
    after_end = sections.get("EOF", [])
    if after_end:
        remarks.append(remark("unread_behind_eof", line=after_end[0][0]))
    return _Sections(sections, "EOF" in sections, tuple(remarks))


def _section_name(text: str, *, inside: str) -> str | None:
    if not text.endswith("::"):
        return None
    match = _SECTION_NAME.fullmatch(text)
    if match is None:
        return None
    name = " ".join(match[1].upper().split())
    # a user's text may end in two colons; elsewhere it is a section of another version
    known = name in _SECTIONS or (inside != "USER-TEXT" and match[1].isupper())
    return name if known else None


def _check_sections(source: SourceText, sections: _Sections) -> None:
    for name in ("HEADER", "TARGET DATA", "RUNS", "DEVIATIONS"):
        if name in sections.lines:
            continue
        if sections.ended:
            raise MeasurementFileError("section_missing", section=name, place=source.at())
        raise MeasurementFileError("cut_short", place=source.at())


def _key(text: str) -> str:
    return " ".join(text.lower().replace("-", " ").replace("_", " ").split())


def _pairs(lines: Sequence[_Line]) -> dict[str, tuple[str, int]]:
    """Return value and line by key, the first of each key."""
    pairs: dict[str, tuple[str, int]] = {}
    for number, text in lines:
        key, colon, value = text.partition(":")
        if colon:
            pairs.setdefault(_key(key), (value.strip(), number))
    return pairs


# ------------------------------------------------------------------------------------ header


def _field_name(key: str) -> str:
    name = re.sub(r"\W+", "_", clean_text(_key(key), limit=60).lower()).strip("_")
    return name or "text"


def _read_header(sections: _Sections) -> tuple[dict[str, str], tuple[Message, ...]]:
    texts: dict[str, list[str]] = {}
    remarks: list[Message] = []
    for section, prefix in (("USER-TEXT", ""), ("EQUIPMENT", "equipment_")):
        lines = sections.lines.get(section, [])
        _collect_texts(texts, lines[:_MOST_TEXT_LINES], prefix)
        if len(lines) > _MOST_TEXT_LINES:
            remarks.append(remark("section_cut", section=section, most=_MOST_TEXT_LINES))
    file_lines = sections.lines["HEADER"][:_MOST_TEXT_LINES]
    for key, (value, _) in _pairs(file_lines).items():
        texts.setdefault(_field_name(key), [value])
    for key, (value, _) in _pairs(sections.lines["TARGET DATA"]).items():
        if key in {"filetype", "file type"}:
            texts.setdefault("target_filetype", [value])
    header = {name: clean_text(" ".join(parts)) for name, parts in texts.items()}
    return {name: value for name, value in header.items() if value}, tuple(remarks)


def _collect_texts(texts: dict[str, list[str]], lines: Sequence[_Line], prefix: str) -> None:
    name = prefix + "text"
    for _, text in lines:
        key, colon, value = text.partition(":")
        if colon:
            name = prefix + _HEADER_NAMES.get(_key(key), _field_name(key))
        # a line without colon goes on with the text before it
        texts.setdefault(name, []).append(value.strip() if colon else text)


def _check_linear(source: SourceText, header: Mapping[str, str]) -> None:
    file_type = header.get("file_type", "").lower().lstrip(".")
    owner = header.get("owner", "").lower()
    if file_type in {"", "rtl"} and (owner.startswith("linear") or (not owner and file_type)):
        return
    raise MeasurementFileError(
        "not_linear_rtl",
        file_type=header.get("file_type", ""),
        owner=header.get("owner", ""),
        place=source.at(),
    )


# ----------------------------------------------------------------------- targets, flags, runs


def _read_targets(source: SourceText, lines: Sequence[_Line]) -> tuple[FloatArray, bool]:
    values: list[float] = []
    numbers: list[int] = []
    inside = False
    for number, text in lines:
        key, colon, rest = text.partition(":")
        if not inside:
            inside = bool(colon) and _key(key) == "targets"
            text = rest  # noqa: PLW2901  the line that opens the list may hold its first values
        elif colon or text[0].isalpha():
            break
        if inside:
            words = text.split()
            values += (parse_number(w, source.at(number)) for w in words)
            numbers += [number] * len(words)
    stated, listed = _count(source, lines, "Target-count"), len(values)
    if stated != listed or not listed:
        place = source.at(_pairs(lines)["target count"][1])
        raise MeasurementFileError("target_count", stated=stated, listed=listed, place=place)
    return rising_targets(np.array(values), numbers, source.at)


def _count(source: SourceText, lines: Sequence[_Line], label: str) -> int:
    """Return a number that the file states, such as that of its runs."""
    text, number = _pairs(lines).get(_key(label), (None, None))
    if text is None:
        raise MeasurementFileError("missing_key", place=source.at(column=label))
    return parse_whole_number(text, source.at(number, label))


def _read_flags(
    source: SourceText, lines: Sequence[_Line]
) -> tuple[dict[str, str], bool, tuple[Message, ...]]:
    pairs = _pairs(lines)
    if "flags" not in pairs:
        return {}, False, (remark("no_flags"),)
    text, number = pairs["flags"]
    words = text.split()
    if len(words) < 2 or words[1] not in {"0", "1"}:
        raise MeasurementFileError("unreadable_flags", text=text, place=source.at(number, "Flags"))
    return {"flags": clean_text(text)}, words[1] == "1", ()


# --------------------------------------------------------------------------------- deviations


def _read_rows(source: SourceText, sections: _Sections, targets: int, run_count: int) -> _Rows:
    read: list[tuple[int, int, int]] = []
    printed: list[str] = []
    lines = sections.lines["DEVIATIONS"]
    for number, text in lines:
        if text[0].isalpha() and text.endswith(":"):
            continue  # the heading "Run Target Data:"
        words, place = text.split(), source.at(number)
        if len(words) < 3 and not sections.ended and number == lines[-1][0]:
            raise MeasurementFileError("cut_short", place=place)
        if len(words) != 3:
            raise MeasurementFileError("words_in_row", words=len(words), needed=3, place=place)
        run = parse_whole_number(words[0], source.at(number, "Run"))
        index = parse_whole_number(words[1], source.at(number, "Target"))
        if not 1 <= run <= run_count:
            raise MeasurementFileError("unknown_run", run=run, runs=run_count, place=place)
        if not 1 <= index <= targets:
            raise MeasurementFileError("unknown_target", target=index, targets=targets, place=place)
        read.append((run, index - 1, number))
        printed.append(words[2])
    open_end = not sections.ended and not source.text.endswith("\n")
    if open_end and list(sections.lines)[-1] == "DEVIATIONS":
        check_last_number(printed, source.at(lines[-1][0]))
    deviations = [
        parse_number(word, source.at(number, "Data"))
        for word, (_, _, number) in zip(printed, read, strict=True)
    ]
    run_of_row, target, line = np.array(read, dtype=np.int64).reshape(-1, 3).T
    return _Rows(run_of_row, target, np.array(deviations, dtype=np.float64), line)


def _without_padding(source: SourceText, rows: _Rows) -> _Rows:
    even = rows.run % 2 == 0
    filled = np.flatnonzero(even & (rows.deviation_um != 0.0))
    if filled.size:
        k = int(filled[0])
        raise MeasurementFileError(
            "readings_in_return_run", run=int(rows.run[k]), place=source.at(int(rows.line[k]))
        )
    odd = ~even
    return _Rows(rows.run[odd], rows.target[odd], rows.deviation_um[odd], rows.line[odd])


def _slots(rows: _Rows, targets: int, *, one_way: bool) -> _IntArray:
    """Return the place of each row in the standard cycle, stops without reading counted."""
    along = np.where(rows.run % 2 == 1, rows.target, targets - 1 - rows.target)
    travel = (rows.run - 1) // 2 if one_way else rows.run - 1
    return travel * targets + along


def _check_complete(
    source: SourceText, sections: _Sections, rows: _Rows, targets: int, expected: range
) -> tuple[Message, ...]:
    stops = len(expected) * targets
    have = int(rows.run.size)
    if not sections.ended and have < stops:
        raise MeasurementFileError(
            "readings_cut_short", readings=have, expected=stops, place=source.at()
        )
    remarks: list[Message] = []
    if not sections.ended:
        remarks.append(remark("no_eof"))
    if have < stops:
        names = _missing(rows, targets, expected)
        remarks.append(missing_remark(names, stops - have, stops))
    return tuple(remarks)


def _missing(rows: _Rows, targets: int, expected: range) -> Iterator[str]:
    there: dict[int, set[int]] = {}
    for run, index in zip(rows.run.tolist(), rows.target.tolist(), strict=True):
        there.setdefault(run, set()).add(index)
    for run in expected:
        have = there.get(run)
        if have is None:
            yield f"run {run}"
        elif len(have) < targets:
            yield from (f"run {run} target {k + 1}" for k in range(targets) if k not in have)


def _travel_remarks(rows: _Rows, slot: _IntArray, *, descending: bool) -> Iterator[Message]:
    if descending:
        yield remark("rtl_targets_falling")
    wrong = np.flatnonzero(np.diff(slot) < 0) + 1
    if wrong.size:
        runs = [str(run) for run in np.unique(rows.run[wrong]).tolist()]
        line = int(rows.line[wrong[0]])
        yield remark("rows_against_travel", count=len(runs), runs=first_few(runs), line=line)


def _times(slot: _IntArray, environment: _Environment) -> FloatArray | None:
    """Spread the stops evenly from start to end, None where these are not usable. [s]"""
    start, end = environment.start, environment.end
    if start is None or end is None or end <= start or not slot.size:
        return None
    first, last = int(slot.min()), int(slot.max())
    if last == first:
        return None
    return (slot - first) / (last - first) * (end - start).total_seconds()


# -------------------------------------------------------------------------------- environment


def _read_environment(source: SourceText, lines: Sequence[_Line]) -> _Environment:
    values: dict[str, StartEnd] = {}
    header: dict[str, str] = {}
    flags: list[str] = []
    start, end, remarks = None, None, list[Message]()
    for key, (text, number) in islice(_pairs(lines).items(), _MOST_TEXT_LINES):
        name = _ENVIRONMENT_NAMES.get(key)
        if key == "date time":
            start, end, time_remarks = _read_start_end(text)
            remarks += time_remarks
        elif name is None:
            header[f"environment_{_field_name(key)}"] = clean_text(text)
        elif text:
            values[name] = _start_end(source, text, number, name)
            if len(words := text.split()) > 2:
                flags.append(" ".join([name, *words[2:]]))
    absent = [key for key in _MATERIAL_KEYS if values.get(key) == StartEnd(None, None)]
    for key in absent:
        del values[key]
    if absent:
        sensors = ", ".join(key.split("_")[2] for key in absent)
        remarks.append(remark("sensors_absent", count=len(absent), sensors=sensors))
    remarks += environment_factor_remarks(values)
    reduction = reduction_to_20_c(values)
    if reduction is not None:
        header[_NORMALISED] = f"yes, with {reduction} (environment factor)"
        remarks.append(remark("reduced_to_20_c", reduction=reduction))
    header[_FLAGS] = clean_text(", ".join(flags))
    header = {name: value for name, value in header.items() if value}
    return _Environment(values, start, end, header, tuple(remarks))


def _start_end(source: SourceText, text: str, number: int, name: str) -> StartEnd:
    """Read the values at start and end; the flag behind them is kept as text by the caller."""
    both: list[float | None] = []
    for word in text.split()[:2]:
        value = parse_number(word, source.at(number, name))
        absent = name in _MATERIAL_KEYS and abs(value - SENSOR_ABSENT_C) < 1e-6
        both.append(None if absent else value)
    return StartEnd(both[0], both[1] if len(both) > 1 else None)


def _read_start_end(text: str) -> tuple[datetime | None, datetime | None, list[Message]]:
    quoted = re.findall(r'"([^"]*)"', text)
    start, end = (_time_of_day(quoted[k]) if k < len(quoted) else None for k in (0, 1))
    if start is None or end is None:
        return start, end, [remark("start_and_end_unclear", text=clean_text(text))]
    if end < start:
        return None, None, [remark("ends_before_start", text=clean_text(text))]
    return start, end, [remark("same_minute")] if end == start else []


def _time_of_day(text: str) -> datetime | None:
    match = _TIME_OF_DAY.fullmatch(text)
    if match is None or match[4][:3].lower() not in _MONTHS:
        return None
    hour, minute, second, _, day, year = (
        int(g) if g and g.isdigit() else 0 for g in match.groups()
    )
    month = _MONTHS.index(match[4][:3].lower()) + 1
    try:
        return datetime(year, month, day, hour, minute, second)  # noqa: DTZ001  no zone is stated
    except ValueError:
        return None


# ------------------------------------------------------------------------------------ writing


def _check_writable(test: PositioningTest) -> None:
    if test.kind is not AxisKind.LINEAR:
        raise DataError("rtl_is_linear")
    if test.cycle is not Cycle.STANDARD:
        raise DataError("rtl_cycle", cycle=test.cycle)
    if bool(np.any(np.diff(np.round(test.target, _TARGET_DECIMALS)) <= 0)):
        raise DataError("targets_same_when_printed", decimals=_TARGET_DECIMALS)


def _header_lines(test: PositioningTest) -> list[str]:
    texts = {key: clean_text(value) for key, value in test.header.items()}
    forward, backward = test.measured_approaches
    one_way = forward and not backward
    printed = [f"{value:.{_TARGET_DECIMALS}f}" for value in test.target + 0.0]
    rows = [printed[k : k + _TARGETS_PER_LINE] for k in range(0, len(printed), _TARGETS_PER_LINE)]
    return [
        "HEADER::",
        "File type  : rtl",
        "Owner      : Linear",
        f"Version no : {texts.get('version_no', 'thermaxis')}",
        "",
        "TARGET DATA::",
        "Filetype  : ISO",
        f"Target-count: {len(printed)}",
        "Targets :",
        *("  ".join(row) + " " for row in rows),
        f"Flags: 0 {1 if one_way else 0} 2 0",
        "",
        "USER-TEXT::",
        *(f"{label}:{texts.get(key, '')}" for key, label in _HEADER_KEYS.items()),
        *(f"{_field_name(key)} : {value}" for key, value in texts.items() if _is_user_text(key)),
        "",
        "RUNS::",
        f"Run-count:{2 * test.cycles}",
        "",
    ]


def _is_user_text(key: str) -> bool:
    return (
        key not in _HEADER_KEYS
        and key not in _FILE_KEYS
        and key != _NORMALISED  # the environment says it
        and not key.startswith(("equipment_", "environment_"))
    )


def _deviation_lines(test: PositioningTest, decimals: int) -> Iterator[str]:
    forward, backward = test.measured_approaches
    one_way = forward and not backward
    yield "DEVIATIONS::"
    yield "Run Target Data:"
    for cycle in range(test.cycles):
        for approach in (FORWARD, BACKWARD):
            run = 2 * cycle + approach + 1
            values: list[float] = test.deviation[:, cycle, approach].tolist()
            if one_way and approach == BACKWARD:
                values = [0.0] * len(values)
            rows = list(enumerate(values, start=1))
            for index, value in rows if approach == FORWARD else reversed(rows):
                if not math.isnan(value):
                    # adding zero turns -0.000 into 0.000
                    yield f"{run:<3d} {index:<3d}    {round(value, decimals) + 0.0:.{decimals}f}"
    yield ""


def _environment_lines(test: PositioningTest) -> list[str]:
    stated = test.header.get(_FLAGS)
    flags = None if stated is None else {name: f" {flag}" for name, flag in _FLAG.findall(stated)}
    lines = [
        f"{label}{_printed(both.start, decimals)} {_printed(both.end, decimals)}"
        f"{flag if flags is None else flags.get(key, '')}"
        for label, key, decimals, flag in _ENVIRONMENT_LINES
        if (both := test.environment.get(key)) is not None
        and (key in _MATERIAL_KEYS or None not in (both.start, both.end))
    ]
    if test.start is not None and test.end is not None:
        lines.append(f'Date Time  : "{_minute(test.start)}" "{_minute(test.end)}"')
    return ["ENVIRONMENT::", *lines, ""] if lines else []


def _printed(value: float | None, decimals: int) -> str:
    return f"{SENSOR_ABSENT_C if value is None else value:.{decimals}f}"


def _minute(moment: datetime) -> str:
    month = _MONTHS[moment.month - 1].capitalize()
    return f"{moment.hour:02d}:{moment.minute:02d} {month} {moment.day:02d} {moment.year:04d}"
