"""Text of the ecmc tool chain, ``_ISO230.dat``: measured positions by target and cycle."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from typing import final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, remark
from thermaxis.errors import MeasurementFileError
from thermaxis.files.runs._assemble import (
    assemble_readings,
    check_enough_readings,
    check_last_number,
    missing_remark,
    rising_targets,
)
from thermaxis.files.table import (
    SourceText,
    Unit,
    clean_text,
    first_few,
    parse_number,
    parse_whole_number,
    unit_named,
)
from thermaxis.positioning import (
    APPROACHES,
    BACKWARD,
    FORWARD,
    FloatArray,
    PositioningTest,
)

DEFAULT_UNIT = "mm"
"""Unit of a file without UNIT."""
DEFAULT_CYCLES = 5
"""Number of cycles of a file without CYCLES. [1]"""
DEFAULT_POSITIONS = 8
"""Number of targets of a file without POSITIONS. [1]"""

_UNITS = ("m", "mm", "um", "nm", "deg")
_ARRAY_KEY = re.compile(r"(\w+) ?\[([^\]]*)\]", re.ASCII)
_APPROACH_OF = {"REF_DATA_FWD": FORWARD, "REF_DATA_BWD": BACKWARD}
_NOT_HEADER = frozenset({"UNIT", "CYCLES", "POSITIONS"})
_MOST_SETTINGS = 200
_MOST_DECLARED_PER_MEASURED = 2
_TARGET_DECIMALS = 9


@final
@dataclass(slots=True)
class _Content:
    """The lines of a file, sorted by what they state."""

    settings: dict[str, tuple[str, int]] = field(default_factory=dict[str, tuple[str, int]])
    targets: dict[int, tuple[float, int]] = field(default_factory=dict[int, tuple[float, int]])
    readings: list[tuple[int, int, int, int]] = field(
        default_factory=list[tuple[int, int, int, int]]
    )
    """Target and cycle from 0, approach, line."""
    position: list[float] = field(default_factory=list[float])
    words: list[str] = field(default_factory=list[str])
    unknown: list[str] = field(default_factory=list[str])


def dat_test(source: SourceText) -> PositioningTest:
    """Make a positioning test from the text of an ``_ISO230.dat`` file."""
    content = _read_lines(source)
    if not content.position:
        raise MeasurementFileError("no_readings_in_file", place=source.at())
    unit = _read_unit(source, content)
    targets = _read_count(source, content, "POSITIONS", DEFAULT_POSITIONS)
    cycles = _read_count(source, content, "CYCLES", DEFAULT_CYCLES)
    index, cycle, approach, line = np.array(content.readings, dtype=np.int64).T
    _check_indices(source, content, targets, cycles)
    _check_declared_cycles(source, content, cycles, measured=np.unique(cycle).size)
    target, descending = _read_targets(source, content, targets)

    listed = target[::-1] if descending else target
    deviation = unit.deviations(np.array(content.position) - listed[index])
    if unit.position != (1, 1):
        target = np.round(unit.positions(target), _TARGET_DECIMALS)  # 35400 um are 35.4 mm
    assembled = assemble_readings(
        at=source.at,
        target=target,
        target_index=targets - 1 - index if descending else index,
        cycle=cycle + 1,
        approach=approach,
        deviation=deviation,
        line=line,
    )
    test = PositioningTest(
        kind=unit.kind,
        target=target,
        deviation=assembled.deviation,
        header=_read_header(content),
        remarks=(
            *source.remarks,
            *_check_complete(source, content, targets, cycles),
            *_remarks(content, descending=descending),
        ),
    )
    check_enough_readings(test, source.at())
    return test


def _read_lines(source: SourceText) -> _Content:
    content = _Content()
    for number, raw in enumerate(source.lines, start=1):
        text = raw.partition("#")[0].strip()  # the comment may follow a key: TEST_DATA=# ...
        if not text:
            continue
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not key:
            raise MeasurementFileError("not_key_and_value", text=text, place=source.at(number))
        array = _ARRAY_KEY.fullmatch(key)
        if array is not None:
            _add_element(source, content, array, value, number)
        else:
            _add_setting(source, content, key.upper(), value, number)
    return content


def _add_setting(source: SourceText, content: _Content, key: str, value: str, number: int) -> None:
    known = content.settings.setdefault(key, (value, number))
    if known[0] != value:
        raise MeasurementFileError(
            "stated_differently", name=key, first=known[1], place=source.at(number)
        )


def _add_element(
    source: SourceText, content: _Content, array: re.Match[str], value: str, number: int
) -> None:
    name = array[1].upper()
    if name != "TGT_DATA" and name not in _APPROACH_OF:
        content.unknown.append(f"{name} (line {number})")
        return
    label = f"{name}[{array[2]}]"
    place = source.at(number, label)
    indices = [parse_whole_number(word, place) for word in array[2].split(",")]
    position = parse_number(value, place)
    if name == "TGT_DATA" and len(indices) == 1:
        if indices[0] in content.targets:
            raise MeasurementFileError("stated_twice", name=label, place=source.at(number))
        content.targets[indices[0]] = (position, number)
    elif name != "TGT_DATA" and len(indices) == 2:
        target, cycle = indices
        content.readings.append((target - 1, cycle - 1, _APPROACH_OF[name], number))
        content.position.append(position)
        content.words.append(value)
    else:
        raise MeasurementFileError(
            "number_of_indices", name=label, indices=len(indices), place=source.at(number)
        )


def _read_unit(source: SourceText, content: _Content) -> Unit:
    text, number = content.settings.get("UNIT", ("", None))
    unit = unit_named(text or DEFAULT_UNIT)
    if unit is None or unit not in map(unit_named, _UNITS):
        raise MeasurementFileError(
            "unknown_length_or_angle", unit=text, place=source.at(number, "UNIT")
        )
    return unit


def _read_count(source: SourceText, content: _Content, key: str, default: int) -> int:
    text, number = content.settings.get(key, ("", None))
    if not text:
        return default
    count = parse_whole_number(text, source.at(number, key))
    if count < 1:
        raise MeasurementFileError("not_positive", value=count, place=source.at(number, key))
    return count


def _check_indices(source: SourceText, content: _Content, targets: int, cycles: int) -> None:
    for target, cycle, _, line in content.readings:
        if not (0 <= target < targets and 0 <= cycle < cycles):
            raise MeasurementFileError(
                "reading_outside_plan",
                target=target + 1,
                cycle=cycle + 1,
                targets=targets,
                cycles=cycles,
                place=source.at(line),
            )


def _check_declared_cycles(
    source: SourceText, content: _Content, cycles: int, *, measured: int
) -> None:
    text, number = content.settings.get("CYCLES", ("", None))
    if text and cycles > _MOST_DECLARED_PER_MEASURED * measured:
        raise MeasurementFileError(
            "cycles_cut_short", stated=cycles, measured=measured, place=source.at(number, "CYCLES")
        )


def _read_targets(source: SourceText, content: _Content, targets: int) -> tuple[FloatArray, bool]:
    if content.targets.keys() != set(range(1, targets + 1)):
        count, place = len(content.targets), source.at(column="POSITIONS")
        raise MeasurementFileError("target_count", stated=targets, listed=count, place=place)
    positions, lines = zip(*(content.targets[k] for k in range(1, targets + 1)), strict=True)
    return rising_targets(np.array(positions), lines, source.at)


def _read_header(content: _Content) -> dict[str, str]:
    header = {
        clean_text(re.sub(r"\W+", "_", key.lower()), limit=60): clean_text(value)
        for key, (value, _) in islice(content.settings.items(), _MOST_SETTINGS)
        if key not in _NOT_HEADER
    }
    return {key: value for key, value in header.items() if value}


def _check_complete(
    source: SourceText, content: _Content, targets: int, cycles: int
) -> tuple[Message, ...]:
    index, cycle, approach, line = np.array(content.readings, dtype=np.int64).T
    if line[-1] == source.text.count("\n") + 1:
        check_last_number(content.words, source.at(int(line[-1])))
    approaches = sorted({row[2] for row in content.readings})
    stops = len(approaches) * cycles * targets
    have = len(content.position)
    if have == stops:
        return ()
    passes = approach - approaches[0]  # from 0, whether one approach was measured or both
    rank = (passes * cycles + cycle) * targets + index
    if int(rank.max()) == have - 1:
        # the tool writes forward before backward, cycle by cycle: only the tail is missing
        place = source.at(int(line[np.argmax(rank)]))
        raise MeasurementFileError("readings_cut_short", readings=have, expected=stops, place=place)
    names = _missing(rank, (len(approaches), cycles, targets), approaches)
    return (missing_remark(names, stops - have, stops),)


def _missing(
    rank: NDArray[np.int64], shape: tuple[int, int, int], approaches: list[int]
) -> Iterator[str]:
    there = set(rank.tolist())
    for k, (approach, cycle, target) in enumerate(np.ndindex(shape)):
        if k not in there:
            yield f"target {target + 1} cycle {cycle + 1} {APPROACHES[approaches[approach]]}"


def _remarks(content: _Content, *, descending: bool) -> Iterator[Message]:
    if content.unknown:
        yield remark("lists_unknown", names=first_few(content.unknown))
    approaches = {approach for _, _, approach, _ in content.readings}
    if len(approaches) == 1:
        yield remark("one_direction", direction=APPROACHES[approaches.pop()])
    if descending:
        yield remark("dat_targets_falling")
