"""Tidy CSV: one reading per row, in columns with units in their names."""

import csv
import io
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, remark
from thermaxis.errors import DataError, MeasurementFileError
from thermaxis.files._opened import write_content
from thermaxis.files.runs._assemble import (
    assemble_readings,
    check_enough_readings,
    check_left_out,
    doubts_about_readings,
)
from thermaxis.files.runs._travel import (
    FULL_TURN_DEG,
    passes_of_travel,
    rows_against_direction,
    targets_through_a_turn,
)
from thermaxis.files.table import (
    CHANNEL_PREFIX,
    NUMBER_LIMIT,
    TARGET_RESOLUTION,
    Heading,
    ReadingTimes,
    Role,
    Table,
    Unit,
    check_start_and_end,
    direction_named,
    encoded,
    is_date_name,
    listed,
    metadata_lines,
    numeric_cells,
    one_target_each,
    parse_heading,
    protected,
    read_stamps,
    reading_times,
    spread_in_intervals,
    target_column_of,
    unique_names,
    unit_of_kind,
)
from thermaxis.messages import sentence_of
from thermaxis.positioning import (
    APPROACHES,
    FORWARD,
    FloatArray,
    PositioningTest,
    TimeSource,
)
from thermaxis.quantities import AxisKind

_IntArray: TypeAlias = NDArray[np.int64]

_MOST_DECIMALS = 9
_MOST_OUT_OF_LINE = 0.05
"""Part of the times that may fall while the others rise, as with a typing error. [1]"""
_AGREEMENT = 1e-6
"""Smallest disagreement of measured and deviation that is told. [µm or arcsec]"""


def tidy_test(table: Table) -> PositioningTest:
    """Make a positioning test from a table with one reading per row."""
    metadata = table.metadata
    remarks: list[Message] = []
    target_column, unit = target_column_of(table)
    row_target = unit.positions(table.numbers(target_column, required=True))
    deviation, deviation_remarks = _deviations(table, unit, target_column, row_target)
    channels, channel_remarks = _channels(table)
    given = ~np.isnan(deviation)
    if not bool(given.any()):
        raise MeasurementFileError("no_readings_in_file", place=table.at())
    times, start, end = _times(table, given)
    order = times.order
    cycle, approach, pass_remarks = _passes(table, row_target, order)
    remarks += [*deviation_remarks, *pass_remarks, *channel_remarks]
    place = np.arange(row_target.size, dtype=np.float64) if order is None else order
    row_target, turn_remarks = targets_through_a_turn(unit.kind, row_target, cycle, approach, place)
    if order is None:
        turn_remarks += rows_against_direction(row_target, cycle, approach)
    target, target_index, target_remarks = one_target_each(
        table, row_target, np.column_stack((cycle, approach)), given, unit.kind.units.position
    )
    assembled = assemble_readings(
        at=table.source.at,
        target=target,
        target_index=target_index,
        cycle=cycle,
        approach=approach,
        deviation=deviation,
        line=table.row,
        order=order,
        time_s=times.time_s,
        channels=channels,
    )
    remarks += [*turn_remarks, *target_remarks, *times.remarks, *assembled.remarks]
    remarks += doubts_about_readings(unit.kind, target, assembled.deviation)
    source = times.source
    if source is TimeSource.FILE and metadata.interpolated:
        source = TimeSource.INTERPOLATED
    test = PositioningTest(
        kind=unit.kind,
        target=target,
        deviation=assembled.deviation,
        time_source=source,
        time_s=assembled.time_s,
        order=assembled.order,
        order_deduced=metadata.order_deduced and assembled.order is not None,
        start=start,
        end=end,
        cycle=metadata.cycle,
        channels=assembled.channels,
        environment=metadata.environment,
        header=metadata.header,
        # A file that was written before carries the remarks of its first reading.
        remarks=tuple({sentence_of(one): one for one in (*metadata.remarks, *remarks)}.values()),
    )
    check_enough_readings(test, table.source.at())
    return test


def format_tidy_csv(test: PositioningTest) -> str:
    """Write a positioning test as the text of a tidy CSV file.

    Numbers are written so that reading gives the same floats. Header, environment and remarks
    stand in lines of comment above the headings. A reading that is missing keeps its row, with an
    empty cell.

    Returns
    -------
    str
        Lines that end in a line feed; `read_positioning` gives the same test back.

    Raises
    ------
    DataError
        If the file could not be read again: two targets are equal after rounding to 1e-6 mm or
        deg, or a number is larger than 1e9.
    """
    _check_readable(test)
    i, j, a = np.nonzero(_cells_to_write(test))
    if test.order is not None:
        by_order = np.lexsort((i, a, j, np.nan_to_num(test.order[i, j, a], nan=np.inf)))
        i, j, a = i[by_order], j[by_order], a[by_order]
    else:
        by_pass = np.lexsort((np.where(a == 0, i, -i), a, j))
        i, j, a = i[by_pass], j[by_pass], a[by_pass]

    units = test.kind.units
    names = ["cycle", "direction", f"target_{units.position_suffix}"]
    names += [f"deviation_{units.deviation_suffix}", *map(_channel_heading, test.channels)]
    columns: list[list[str]] = [
        [str(k) for k in (j + 1).tolist()],
        [APPROACHES[k] for k in a.tolist()],
        _written(test.target[i]),
        _written(test.deviation[i, j, a]),
        *(_written(values[i, j, a]) for values in test.channels.values()),
    ]
    if test.time_s is not None:
        names.insert(0, "time_s")
        columns.insert(0, _written(test.time_s[i, j, a]))
    if test.order is not None:
        names.insert(0, "order")
        columns.insert(0, _written(test.order[i, j, a]))
    text = io.StringIO()
    text.writelines(f"{line}\n" for line in metadata_lines(test))
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(zip(*columns, strict=True))
    return text.getvalue()


def write_tidy_csv(test: PositioningTest, path: Path | str) -> None:
    """Write a positioning test as a tidy CSV file, in UTF-8.

    Parameters
    ----------
    path : Path or str
        The file; an existing one is replaced.

    Raises
    ------
    DataError
        If the file could not be read again: two targets are equal after rounding to 1e-6 mm or
        deg, or a number is larger than 1e9.
    MeasurementFileError
        If the file cannot be written.
    """
    write_content(path, format_tidy_csv(test).encode())


def _deviations(
    table: Table, unit: Unit, target_column: int, row_target: FloatArray
) -> tuple[FloatArray, list[Message]]:
    measured_column = table.column_of(Role.MEASURED)
    deviation_column = table.column_of(Role.DEVIATION)
    stated = None
    if deviation_column is not None:
        stated_unit = unit_of_kind(table, deviation_column, unit.kind, "deviation_um")
        stated = stated_unit.deviations(table.numbers(deviation_column))
    if measured_column is None:
        if stated is None:
            raise MeasurementFileError(
                "no_deviation_column", unknown=_not_understood(table), place=table.at()
            )
        return stated, []
    measured_unit = unit_of_kind(table, measured_column, unit.kind, "measured_mm")
    measured = measured_unit.positions(table.numbers(measured_column))
    deviation, remarks = _difference(unit.kind, measured, row_target)
    exact = _exact_decimals(table, (measured_column, measured_unit), (target_column, unit))
    if exact is not None:
        deviation = np.round(deviation, exact)
    if stated is None or deviation_column is None:
        return deviation, remarks
    step = max(
        _last_digit(table, measured_column, measured_unit),
        _last_digit(table, deviation_column, table.headings[deviation_column].unit),
    )
    remarks += _disagreement(table, deviation, stated, step)
    remarks += _mixture(table, deviation, stated)
    return np.where(np.isnan(deviation), stated, deviation), remarks


def _difference(
    kind: AxisKind, measured: FloatArray, target: FloatArray
) -> tuple[FloatArray, list[Message]]:
    """Return measured minus target, and what was done to it."""
    difference = measured - target
    if kind is AxisKind.LINEAR:
        return difference * kind.units.deviations_per_position, []
    turns = np.rint(difference / FULL_TURN_DEG)
    wrapped = int(np.count_nonzero(turns[~np.isnan(turns)]))
    deviation = (difference - turns * FULL_TURN_DEG) * kind.units.deviations_per_position
    if not wrapped:
        return deviation, []
    return deviation, [remark("turns_taken_off", count=wrapped)]


def _decimals(table: Table, column: int) -> int | None:
    """Return the largest number of decimals of a column, None where a number has an exponent."""
    cells = table.columns[column]
    if any("e" in cell or "E" in cell for cell in cells):
        return None
    return max(len(cell.partition(table.decimal)[2]) for cell in cells)


def _exact_decimals(table: Table, *columns: tuple[int, Unit]) -> int | None:
    """Return how many decimals in µm the difference of two decimal numbers can have."""
    most = -_MOST_DECIMALS
    for column, unit in columns:
        decimals = _decimals(table, column)
        if decimals is None or unit.decimals is None:
            return None
        most = max(most, decimals - unit.decimals)
    return most if most <= _MOST_DECIMALS else None


def _last_digit(table: Table, column: int, unit: Unit | None) -> float:
    decimals = _decimals(table, column)
    if decimals is None or unit is None:
        return 0.0
    return 10.0**-decimals * unit.deviation[0] / unit.deviation[1]


def _disagreement(
    table: Table, deviation: FloatArray, stated: FloatArray, step: float
) -> list[Message]:
    tolerance = max(step * (1 + 1e-6), _AGREEMENT)
    wrong = np.flatnonzero(np.abs(deviation - stated) > tolerance)
    if not wrong.size:
        return []
    first = int(wrong[0])
    said = remark(
        "deviations_disagree",
        count=wrong.size,
        where=f"{table.source.row_word} {table.row[first]}",
        stated=f"{stated[first]:.6g}",
        computed=f"{deviation[first]:.6g}",
    )
    return [said]


def _mixture(table: Table, deviation: FloatArray, stated: FloatArray) -> list[Message]:
    """Say which readings have a deviation only, beside others that have a measured position."""
    alone = np.flatnonzero(np.isnan(deviation) & ~np.isnan(stated))
    if not alone.size or bool(np.all(np.isnan(deviation))):
        return []
    where = f"{table.source.row_word} {table.row[alone[0]]}"
    return [remark("not_measured", count=alone.size, where=where)]


def _passes(
    table: Table, row_target: FloatArray, order: FloatArray | None
) -> tuple[_IntArray, _IntArray, list[Message]]:
    """Return cycle and approach of every row."""
    cycle_column = table.column_of(Role.CYCLE)
    run_column = table.column_of(Role.RUN)
    direction_column = table.column_of(Role.DIRECTION)
    if direction_column is not None:
        approach = _directions(table, direction_column)
        if cycle_column is not None:
            return table.whole_numbers(cycle_column), approach, []
        if run_column is not None:
            return _cycles_of_runs(table.whole_numbers(run_column), approach)
        raise MeasurementFileError(
            "no_cycle_column", unknown=_not_understood(table), place=table.at()
        )
    if run_column is None:
        cycle = None if cycle_column is None else table.whole_numbers(cycle_column)
        found = None if order is None else passes_of_travel(row_target, order, cycle)
        if found is not None:
            return *found, [remark("directions_from_targets")]
        raise MeasurementFileError(
            "no_direction_column", unknown=_not_understood(table), place=table.at()
        )
    run = table.whole_numbers(run_column)
    cycle, approach = (run + 1) // 2, (run + 1) % 2
    if cycle_column is not None:
        wrong = np.flatnonzero(table.whole_numbers(cycle_column) != cycle)
        if wrong.size:
            raise MeasurementFileError(
                "cycle_and_run_disagree", place=table.at(int(wrong[0]), cycle_column)
            )
    return cycle, approach, [remark("directions_from_runs")]


def _directions(table: Table, column: int) -> _IntArray:
    words = table.columns[column]
    known = {word: direction_named(word, table.source.mapping) for word in set(words)}
    if None in known.values():
        index = next(i for i, word in enumerate(words) if known[word] is None)
        raise MeasurementFileError(
            "not_a_direction", text=words[index], place=table.at(index, column)
        )
    return np.array([known[word] for word in words], dtype=np.int64)


def _cycles_of_runs(
    run: _IntArray, approach: _IntArray
) -> tuple[_IntArray, _IntArray, list[Message]]:
    """Tell runs that are passes in one direction from runs that are whole cycles."""
    numbers, first = np.unique(run, return_index=True)
    direction = approach[first]
    one_way = bool(np.all(direction[np.searchsorted(numbers, run)] == approach))
    if not one_way or np.unique(direction).size < 2:
        return run, approach, []
    parity = (numbers + direction) % 2
    if bool(np.any(parity != parity[0])):
        return run, approach, [remark("runs_not_alternating")]
    # the first pass of the file opens cycle 1, also where the numbers begin with an even one
    skipped = int(numbers[0] % 2 == 0 and direction[0] == FORWARD)
    cycle = (run + 1 - skipped) // 2
    k = 1 + skipped
    said = remark("runs_paired", run=k, second=k + 1, third=k + 2, fourth=k + 3)
    return cycle, approach, [said]


def _not_understood(table: Table) -> str:
    """Name the headings in which no role was found, for an error about one that is missing."""
    unknown = [
        heading.text
        for heading in table.headings
        if heading.text and heading.role is None and not heading.text.startswith(CHANNEL_PREFIX)
    ]
    return listed(unknown) or "none"


def _channels(table: Table) -> tuple[dict[str, FloatArray], list[Message]]:
    """Return the columns of numbers whose names are not known, and say what became of each."""
    used = {table.column_of(role) for role in Role if role is not Role.TIME}
    used |= {_time_column(table), _date_column(table)}
    if table.column_of(Role.CYCLE) is not None and table.column_of(Role.DIRECTION) is not None:
        used.discard(table.column_of(Role.RUN))
    kept: dict[int, FloatArray] = {}
    ignored: list[str] = []
    for column, heading in enumerate(table.headings):
        if column in used:
            continue
        values = numeric_cells(table.columns[column], table.decimal)
        if values is None:
            values = table.measured_numbers(column)
        if values is not None and bool(np.any(np.isinf(values))):
            values = None
        if values is not None and not bool(np.all(np.isnan(values))):
            kept[column] = values
        elif heading.text or any(table.columns[column]):
            ignored.append(heading.text or f"column {column + 1}")
    deviation = table.column_of(Role.DEVIATION)
    if deviation is not None and parse_heading(table.headings[deviation].text).is_pass:
        check_left_out(table, list(kept), [deviation], table.numbers(deviation))
    names = unique_names(table.headings, list(kept))
    remarks: list[Message] = []
    if names:
        from thermaxis.thermal.log import unit_of_name  # noqa: PLC0415  thermal is not needed else

        with_unit = [name for name in names if unit_of_name(name)]
        without = [name for name in names if name not in with_unit]
        kinds = (("channels_kept", without), ("channels_with_unit", with_unit))
        remarks += [remark(code, names=listed(kind)) for code, kind in kinds if kind]
    if ignored:
        remarks.append(remark("columns_left_out", names=listed(ignored)))
    return dict(zip(names, kept.values(), strict=True)), remarks


def _times(
    table: Table, given: NDArray[np.bool_]
) -> tuple[ReadingTimes, datetime | None, datetime | None]:
    """Return columns of time and order, judged, with the time of day if it is known."""
    order_column = table.column_of(Role.ORDER)
    time_column = _time_column(table)
    order = None if order_column is None else table.numbers(order_column)
    time_s = None
    start, end = table.metadata.start, table.metadata.end
    stamps = None
    if time_column is not None:
        seconds = table.headings[time_column].seconds
        if seconds is None:
            cells = [c if g else "" for c, g in zip(_dated(table, time_column), given, strict=True)]
            stamps = read_stamps(
                cells, lambda index: table.at(index, time_column), table.source.mapping
            )
            time_s = None if bool(np.isnan(stamps.time_s).all()) else stamps.time_s
            start, end = stamps.start or start, stamps.end or end
        else:
            time_s = table.numbers(time_column) * seconds
            if bool(np.any(np.abs(time_s) > NUMBER_LIMIT)):
                raise MeasurementFileError(
                    "magnitude_too_large", most=NUMBER_LIMIT, place=table.at(column=time_column)
                )
    remarks = () if stamps is None else stamps.remarks
    if time_column is not None and time_s is not None and order is None:
        remarks += _times_out_of_line(table, time_column, time_s)
    if stamps is not None and time_s is not None and stamps.interval_s:
        spread = spread_in_intervals(time_s, given, order, stamps.interval_s)
        if spread is not None:
            time_s, table.metadata.interpolated = spread, True
            remarks = (*remarks, remark("times_in_intervals", interval_s=stamps.interval_s))
    readings = reading_times(
        given=given, order=order, time_s=time_s, line=table.row, at=table.source.at
    )
    readings = replace(readings, remarks=(*remarks, *readings.remarks))
    if start is not None and end is None and readings.time_s is not None:
        end = start + timedelta(seconds=float(readings.time_s[given].max()))
    check_start_and_end(table, start, end)
    return readings, start, end


def _times_out_of_line(table: Table, column: int, time_s: FloatArray) -> tuple[Message, ...]:
    """Name the few times that lie outside those of the rows beside them, which else rise."""
    rows = np.flatnonzero(~np.isnan(time_s))
    before, time, after = (
        np.concatenate(([-np.inf], time_s[rows], [np.inf]))[k : k + rows.size] for k in range(3)
    )
    wrong = np.flatnonzero((before < after) & ((time < before) | (time > after)))
    falls = np.count_nonzero(np.diff(time) < 0)
    if not falls <= wrong.size <= _MOST_OUT_OF_LINE * rows.size or not wrong.size:
        return ()
    k = int(wrong[0])
    row = int(rows[k])
    off = max(before[k] - time[k], time[k] - after[k])
    where = f"{table.source.row_word} {table.row[row]}"
    text = table.columns[column][row]
    return (remark("times_out_of_line", where=where, text=text, off=off, more=wrong.size - 1),)


def _dated(table: Table, column: int) -> Sequence[str]:
    """Return the cells of a column of times, behind those of a column of dates if there is one."""
    date = _date_column(table)
    if date is None:
        return table.columns[column]
    pairs = zip(table.columns[date], table.columns[column], strict=True)
    return [f"{day} {time}" if day and time else time for day, time in pairs]


def _date_column(table: Table) -> int | None:
    """Return the column of dates that stands beside one of times of the day."""
    dates = [k for k, heading in enumerate(table.headings) if is_date_name(heading.text)]
    time = _time_column(table)
    beside = time is not None and table.headings[time].seconds is None
    return dates[0] if beside and len(dates) == 1 else None


def _time_column(table: Table) -> int | None:
    """Return the column of times; one of dates with time goes before one of seconds."""
    found = [i for i, heading in enumerate(table.headings) if heading.role is Role.TIME]
    dated = [i for i in found if table.headings[i].seconds is None]
    if len(dated) == 1 or not found:
        return dated[0] if dated else None
    return table.column_of(Role.TIME)


def _check_readable(test: PositioningTest) -> None:
    if np.unique(np.rint(test.target / TARGET_RESOLUTION)).size < test.target.size:
        raise DataError("targets_too_close", least=TARGET_RESOLUTION)
    stated = [v for pair in test.environment.values() for v in (pair.start, pair.end)]
    environment = np.array([np.nan if value is None else value for value in stated])
    for values in (test.target, test.deviation, test.time_s, environment):
        if values is not None and bool(np.any(np.abs(values) > NUMBER_LIMIT)):
            raise DataError("magnitude_too_large", most=NUMBER_LIMIT)


def _cells_to_write(test: PositioningTest) -> NDArray[np.bool_]:
    """Say which readings get a row: all of an approach that was measured."""
    rows = np.zeros(test.deviation.shape, dtype=bool)
    rows[:, :, list(test.measured_approaches)] = True
    for values in (test.time_s, test.order, *test.channels.values()):
        if values is not None:
            rows |= np.isfinite(values)
    return rows


def _written(values: FloatArray) -> list[str]:
    """Write numbers in the shortest form that reads back as the same float."""
    return [
        (str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value))
        if np.isfinite(value)
        else ""
        for value in values.tolist()
    ]


def _channel_heading(name: str) -> str:
    heading: Heading = parse_heading(name)
    plain = encoded(name) == name and not name.startswith((CHANNEL_PREFIX.strip(), "#"))
    if name and plain and heading.role is None and not heading.is_pass:
        return protected(name)
    return CHANNEL_PREFIX + encoded(name)
