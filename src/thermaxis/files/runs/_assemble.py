"""Columns of readings, one row per reading, become the arrays of a positioning test."""

import itertools
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, Place, remark
from thermaxis.errors import MeasurementFileError
from thermaxis.files.table import Role, Table, first_few, is_summary, numeric_cells, unit_named
from thermaxis.positioning import (
    APPROACHES,
    FloatArray,
    PositioningTest,
    is_single_run_axis,
)
from thermaxis.quantities import AxisKind

IntArray: TypeAlias = NDArray[np.int64]

MAX_CELLS = 20_000_000
"""Largest m * n * 2 of one array of readings: 160 MB of float64. [1]"""
MAX_CHANNEL_CELLS = 40_000_000
"""Largest number of cells of all further readings together: 320 MB of float64. [1]"""
CELLS_PER_READING = 20
"""How many cells of the array one reading may stand for before the table is called absurd. [1]"""
SMALL_TABLE = 20_000
"""Number of cells below which a sparse table does no harm. [1]"""
MAX_TARGETS = 10_000
"""Largest number of targets of an axis: more is a continuous record, not a positioning run. [1]"""
_NUMBER = re.compile(r"[0-9]+")
_WORD = re.compile(r"°?[^\W_]+")
_OTHER_SIZE = 10.0
"""Factor in typical values by which a column differs that holds no readings of the run. [1]"""
_MOSTLY = 0.5
"""Part of the rows in which a column of readings has a number. [1]"""
_BEYOND = 1000.0
"""How many times as far from the median as all others equal readings are none. [1]"""
_FEWEST_OTHERS = 12
"""Fewer readings do not tell how far one may lie. [1]"""


def _no_channels() -> dict[str, FloatArray]:
    return {}


@final
@dataclass(frozen=True, slots=True)
class Assembled:
    """Arrays of readings in the shape (m, n, 2): target, cycle, approach."""

    deviation: FloatArray
    """Deviations, NaN where no reading is. [µm or arcsec]"""
    order: FloatArray | None = None
    """Acquisition order, if it was given. [1]"""
    time_s: FloatArray | None = None
    """Times, if they were given. [s]"""
    channels: Mapping[str, FloatArray] = field(default_factory=_no_channels)
    """Further readings by the name of their column."""
    remarks: tuple[Message, ...] = ()
    """What was noticed: cycles without any reading."""


def assemble_readings(  # noqa: PLR0913  the columns of one table, each by its name
    *,
    at: Callable[..., Place],
    target: FloatArray,
    target_index: IntArray,
    cycle: IntArray,
    approach: IntArray,
    deviation: FloatArray,
    line: IntArray,
    order: FloatArray | None = None,
    time_s: FloatArray | None = None,
    channels: Mapping[str, FloatArray] | None = None,
) -> Assembled:
    """Put readings listed one per row into arrays of targets, cycles and approaches."""
    if not bool(np.any(np.isfinite(deviation))):
        raise MeasurementFileError("no_readings_in_file", place=at())
    if target.size > MAX_TARGETS:
        raise MeasurementFileError(
            "too_many_targets", targets=target.size, most=MAX_TARGETS, place=at()
        )
    cycles = _number_of_cycles(at, cycle, line)
    _check_error_codes(at, deviation, line)
    shape = (int(target.size), cycles, 2)
    _check_size(at, shape, int(deviation.size), cycle, line)
    _check_channels(at, shape, len(channels or {}))
    flat = (target_index * cycles + (cycle - 1)) * 2 + approach
    given = ~np.isnan(deviation)
    _check_duplicates(at, flat, given, line, target, shape)

    # A row that lists a reading as missing must not hide a row that has it.
    rank = np.concatenate((np.flatnonzero(~given), np.flatnonzero(given)))

    def spread(values: FloatArray) -> FloatArray:
        cells = np.full(shape, np.nan)
        cells.reshape(-1)[flat[rank]] = values[rank]
        return cells

    return Assembled(
        deviation=spread(deviation),
        order=None if order is None else spread(order),
        time_s=None if time_s is None else spread(time_s),
        channels={name: spread(values) for name, values in (channels or {}).items()},
        remarks=_empty_cycles(cycle[given], cycles),
    )


def rising_targets(
    listed: FloatArray, lines: Sequence[int], at: Callable[..., Place]
) -> tuple[FloatArray, bool]:
    """Return targets in rising order, and whether they were listed from the largest down."""
    descending = bool(listed[0] > listed[-1])
    wrong = np.flatnonzero(np.diff(-listed if descending else listed) <= 0)
    if wrong.size:
        before, target = listed[wrong[0] : wrong[0] + 2].tolist()
        place = at(lines[int(wrong[0]) + 1])
        raise MeasurementFileError(
            "targets_not_in_order", target=target, before=before, place=place
        )
    return listed[::-1] if descending else listed, descending


def missing_remark(names: Iterator[str], missing: int, stops: int) -> Message:
    """Say how many readings are missing, and name the first of them."""
    first = list(islice(names, 6))
    named = ", ".join(first[:5]) + (" and others" if len(first) > 5 else "")
    return remark("readings_missing", missing=missing, stops=stops, names=named)


def doubts_about_readings(
    kind: AxisKind, target: FloatArray, deviation: FloatArray
) -> list[Message]:
    """Say what a table lacks, and whether its deviations can be in their unit.

    What was not measured at all, an approach or a cycle, is not lacking.
    """
    missing = np.isnan(deviation)
    travel = float(np.ptp(target)) * kind.units.deviations_per_position
    typical = float(np.median(np.abs(deviation[~missing])))
    doubts = [remark("beyond_travel", unit=kind.units.deviation)] if typical > travel else []
    if not bool(missing.any()):
        return doubts
    cycles = [j for j in range(missing.shape[1]) if not missing[:, j].all()]
    approaches = [a for a in range(2) if not missing[:, :, a].all()]
    stops = list(itertools.product(range(target.size), cycles, approaches))
    lacking = [stop for stop in stops if missing[stop]]
    names = (f"target {target[i]:.10g} cycle {j + 1} {APPROACHES[a]}" for i, j, a in lacking)
    return doubts + ([missing_remark(names, len(lacking), len(stops))] if lacking else [])


def check_left_out(
    table: Table, left: Sequence[int], used: Sequence[int], values: FloatArray
) -> None:
    """Refuse columns that may hold readings: as many, as numbered or as large as those of runs."""
    found = {k: cells for k in left if (cells := _possible_readings(table, k)) is not None}
    numbers = {number for k in used for number in _NUMBER.findall(table.headings[k].text)}
    typical = np.median(np.abs(values[~np.isnan(values)])) if np.isfinite(values).any() else np.nan
    for column, cells in found.items():
        size = np.nanmedian(np.abs(cells))
        name = table.headings[column].text or f"column {column + 1}"
        alike = typical / _OTHER_SIZE <= size <= typical * _OTHER_SIZE
        if alike or len(found) == len(used) or not numbers.isdisjoint(_NUMBER.findall(name)):
            raise MeasurementFileError(
                "column_like_runs", name=name, count=len(found), place=table.at(column=column)
            )


def _possible_readings(table: Table, column: int) -> FloatArray | None:
    """Return the numbers of a column of which nothing says that they are something else."""
    from thermaxis.thermal.log import unit_named as log_unit  # noqa: PLC0415  rarely needed

    heading = table.headings[column]
    words = _WORD.findall(heading.text)
    other_unit = any(log_unit(word) and unit_named(word) is None for word in words[-1:])
    stated = heading.text in table.source.mapping.columns
    if stated or other_unit or is_summary(heading.text):
        return None
    if heading.role not in {None, Role.DEVIATION}:
        return None
    cells = numeric_cells(table.columns[column], table.decimal)
    if cells is None:
        cells = table.measured_numbers(column)
    if cells is None or np.isfinite(cells).mean() <= _MOSTLY:
        return None
    return None if bool(np.all(np.diff(cells) == 1.0)) else cells  # they count the rows


def check_last_number(words: Sequence[str], place: Place) -> None:
    """Refuse a file that ends inside its last number, which would read as another one."""
    decimals = [len(word.partition(".")[2]) for word in words]
    if len(decimals) > 1 and decimals[-1] < min(decimals[:-1]):
        raise MeasurementFileError("cut_short", place=place)


def check_enough_readings(test: PositioningTest, place: Place) -> None:
    """Check that every target can be evaluated in every approach that was measured.

    References
    ----------
    ISO 230-2:2014, clause 5.3 (tests up to and over 2000 mm), as described by
    GOST ISO 230-2-2016, clause 6.2.
    """
    if test.target.size < 2:
        raise MeasurementFileError("one_target", target=float(test.target[0]), place=place)
    needed = 1 if is_single_run_axis(test) else 2
    too_few = (test.readings < needed) & np.array(test.measured_approaches)
    if not bool(too_few.any()):
        return
    if needed == 2 and test.deviation.shape[1] == 1:
        raise MeasurementFileError("one_cycle", needed=needed, place=place)
    i, a = (int(k) for k in np.argwhere(too_few)[0])
    raise MeasurementFileError(
        "too_few_readings_of_target",
        target=float(test.target[i]),
        direction=APPROACHES[a],
        readings=int(test.readings[i, a]),
        needed=needed,
        others=int(too_few.sum()) - 1,
        place=place,
    )


def _number_of_cycles(at: Callable[..., Place], cycle: IntArray, line: IntArray) -> int:
    lowest = int(np.argmin(cycle))
    if cycle[lowest] < 1:
        raise MeasurementFileError(
            "cycle_below_one", cycle=int(cycle[lowest]), place=at(int(line[lowest]))
        )
    return int(cycle.max())


def _check_error_codes(at: Callable[..., Place], deviation: FloatArray, line: IntArray) -> None:
    """Refuse equal values far beyond all others: codes of errors, not readings."""
    distance = np.abs(deviation - np.nanmedian(deviation))
    ranked = np.sort(distance[~np.isnan(distance)])
    least = max(ranked.size // 2, _FEWEST_OTHERS)
    jumps = np.flatnonzero((ranked[1:] > _BEYOND * ranked[:-1]) & (ranked[:-1] > 0.0))
    jumps = jumps[jumps >= least]
    if not jumps.size:
        return
    far = np.flatnonzero(distance > ranked[jumps[0]])
    value, count = np.unique(deviation[far], return_counts=True)
    most = int(np.argmax(count))
    if count[most] < 2:
        return
    rows = line[far[deviation[far] == value[most]]]
    raise MeasurementFileError(
        "error_code_as_reading",
        count=int(count[most]),
        value=f"{value[most]:.10g}",
        others=float(ranked[jumps[0]]),
        rows=first_few([str(row) for row in rows.tolist()]),
        place=at(int(rows[0])),
    )


def _check_size(
    at: Callable[..., Place],
    shape: tuple[int, int, int],
    readings: int,
    cycle: IntArray,
    line: IntArray,
) -> None:
    targets, cycles, approaches = shape
    cells = targets * cycles * approaches
    if cells <= MAX_CELLS and cells <= max(SMALL_TABLE, CELLS_PER_READING * readings):
        return
    largest = int(np.argmax(cycle))
    place = at(int(line[largest]))
    raise MeasurementFileError(
        "table_too_sparse", targets=targets, cycles=cycles, readings=readings, place=place
    )


def _check_channels(at: Callable[..., Place], shape: tuple[int, int, int], channels: int) -> None:
    targets, cycles, approaches = shape
    if channels * targets * cycles * approaches > MAX_CHANNEL_CELLS:
        raise MeasurementFileError("too_many_channels", channels=channels, place=at())


def _check_duplicates(
    at: Callable[..., Place],
    flat: IntArray,
    given: NDArray[np.bool_],
    line: IntArray,
    target: FloatArray,
    shape: tuple[int, int, int],
) -> None:
    cells = flat[given]
    lines = line[given]
    ranked = np.argsort(cells, kind="stable")
    twice = np.flatnonzero(np.diff(cells[ranked]) == 0)
    if not twice.size:
        return
    first = twice[np.argmin(lines[ranked[twice + 1]])]
    i, j, a = (int(k) for k in np.unravel_index(int(cells[ranked[first]]), shape))
    raise MeasurementFileError(
        "reading_twice",
        cycle=j + 1,
        direction=APPROACHES[a],
        target=float(target[i]),
        first=int(lines[ranked[first]]),
        place=at(int(lines[ranked[first + 1]])),
    )


def _empty_cycles(cycle: IntArray, cycles: int) -> tuple[Message, ...]:
    empty = np.flatnonzero(np.bincount(cycle - 1, minlength=cycles) == 0) + 1
    if not empty.size:
        return ()
    named = first_few([str(k) for k in empty.tolist()])
    return (remark("cycles_empty", count=empty.size, cycles=named),)
