"""Wide CSV: one target per row, one run per column, headed by run numbers."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, remark
from thermaxis.errors import MeasurementFileError
from thermaxis.files.runs._assemble import (
    assemble_readings,
    check_enough_readings,
    check_left_out,
    doubts_about_readings,
)
from thermaxis.files.runs._travel import targets_through_a_turn
from thermaxis.files.table import (
    Heading,
    Role,
    Table,
    Unit,
    check_start_and_end,
    deviation_unit,
    group_targets,
    listed,
    target_column_of,
    unit_elsewhere,
    unit_named,
    unit_of_kind,
)
from thermaxis.positioning import (
    APPROACHES,
    BACKWARD,
    FORWARD,
    FloatArray,
    PositioningTest,
    TimeSource,
)

_IntArray: TypeAlias = NDArray[np.int64]

_LEAST_PLAUSIBLE = 0.05
"""Largest deviation below which no machine stays; own choice. [µm or arcsec]"""


def wide_test(table: Table) -> PositioningTest:
    """Make a positioning test from a table with one target per row and one run per column."""
    if table.source.mapping.target_tolerance is not None:
        raise MeasurementFileError(
            "reading_option_unused", name="target_tolerance", what=table.layout, place=table.at()
        )
    target_column, target_unit = target_column_of(table)
    row_target = target_unit.positions(table.numbers(target_column, required=True))
    runs = _run_columns(table)
    unit, remarks = _unit_of_runs(table, runs, target_unit)
    values = np.column_stack([table.numbers(column) for column in runs.values()])
    if any(one.code == "remark-unit_assumed" for one in remarks):
        _check_assumed(table, values, unit)
    _check_not_positions(table, values, row_target, unit)
    remarks += _left_out(table, target_column, runs, values)
    headed = (table.headings[k] for k in runs.values())
    stated = all(h.approach is not None or _is_mapped(table, h) for h in headed)
    remarks.append(remark("order_from_passes" if stated else "order_from_runs"))

    rows = np.arange(row_target.size)
    row_target, turn_remarks = targets_through_a_turn(
        target_unit.kind,
        row_target,
        cycle=np.ones_like(rows),
        approach=np.full_like(rows, FORWARD),
        place=rows.astype(np.float64),
    )
    remarks += turn_remarks
    target, index = group_targets(row_target)
    once = np.array(list(dict.fromkeys(row_target.tolist())))  # blocks repeat the targets
    falling = once.size > 1 and bool(np.all(np.diff(once) < 0))
    if falling:
        remarks.append(remark("wide_targets_falling"))
    travelled = target.size - 1 - index if falling else index
    run = np.array(list(runs), dtype=np.int64)
    assembled = assemble_readings(
        at=table.source.at,
        target=target,
        target_index=np.repeat(index, run.size),
        cycle=np.tile((run + 1) // 2, index.size),
        approach=np.tile((run + 1) % 2, index.size),
        deviation=unit.deviations(values).reshape(-1),
        line=np.repeat(table.row, run.size),
        order=_deduced_order(travelled, target.size, run, values).reshape(-1),
    )
    metadata = table.metadata
    check_start_and_end(table, metadata.start, metadata.end)
    test = PositioningTest(
        kind=target_unit.kind,
        target=target,
        deviation=assembled.deviation,
        time_source=TimeSource.ORDER,
        order=assembled.order,
        order_deduced=True,
        start=metadata.start,
        end=metadata.end,
        environment=metadata.environment,
        header=metadata.header,
        remarks=(
            *(*metadata.remarks, *remarks, *assembled.remarks),
            *doubts_about_readings(target_unit.kind, target, assembled.deviation),
        ),
    )
    check_enough_readings(test, table.source.at())
    return test.with_cycle(metadata.cycle)


def _run_columns(table: Table) -> dict[int, int]:
    """Return the index of the column of each run, odd forward, even backward, by rising number."""
    passes = {k: heading for k, heading in enumerate(table.headings) if heading.is_pass}
    headed = [heading for heading in passes.values() if not _is_mapped(table, heading)]
    numbers = {a: {h.run or 1 for h in headed if h.approach == a} for a in (0, 1)}
    stated = all(heading.approach is not None for heading in headed)
    alternate = all(h.run and h.approach in {None, _approach(h.run)} for h in headed)
    # cycles are counted, not runs, where both directions have the same numbers
    counts_cycles = stated and (not alternate or numbers[FORWARD] == numbers[BACKWARD])
    shared = numbers[FORWARD] <= numbers[BACKWARD] or numbers[FORWARD] >= numbers[BACKWARD]
    columns: dict[int, int] = {}
    for column, heading in passes.items():
        approach, run = heading.approach, heading.run or 1
        if approach is not None and counts_cycles and shared:
            run = 2 * run - (approach == FORWARD)
        elif approach is not None and approach != _approach(run):
            direction, place = APPROACHES[approach], table.at(column=column)
            raise MeasurementFileError(
                "run_of_other_direction", run=run, direction=direction, place=place
            )
        if run in columns:
            raise MeasurementFileError("run_twice", run=run, place=table.at(column=column))
        columns[run] = column
    return dict(sorted(columns.items()))


def _is_mapped(table: Table, heading: Heading) -> bool:
    """Say whether the user states the cycle and the direction of a column."""
    stated = table.source.mapping.columns.get(heading.text)
    return stated is not None and stated.cycle is not None


def _approach(run: int) -> int:
    return FORWARD if run % 2 else BACKWARD


def _unit_of_runs(
    table: Table, runs: dict[int, int], target_unit: Unit
) -> tuple[Unit, list[Message]]:
    stated: Unit | None = None
    for column in runs.values():
        heading = table.headings[column]
        if heading.unit is None and not heading.unit_text:
            continue
        unit = unit_of_kind(table, column, target_unit.kind, "run_1_um")
        if stated is not None and unit is not stated:
            raise MeasurementFileError(
                "units_of_runs_differ",
                first=stated.name,
                second=unit.name,
                place=table.at(column=column),
            )
        stated = unit
    if stated is not None:
        return stated, []
    named = unit_elsewhere(table, Role.DEVIATION)
    if named:
        unit = unit_named(named)
        if unit is None or unit.kind is not target_unit.kind:
            raise MeasurementFileError(
                "unit_of_deviations", unit=named, kind=target_unit.kind, place=table.at()
            )
        return unit, []
    if table.metadata.unit is not None or table.metadata.unit_in_doubt:
        place = table.at(column=next(iter(runs.values())))
        raise MeasurementFileError("unit_not_stated", example="run_1_um", place=place)
    assumed = deviation_unit(target_unit.kind)
    word = assumed.kind.units.deviation_suffix
    said = remark("unit_assumed", unit=assumed.name, word=word)
    return assumed, [said]


def _check_assumed(table: Table, values: FloatArray, unit: Unit) -> None:
    """Refuse deviations that are too small for the unit that nothing states."""
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    if not 0.0 < largest < _LEAST_PLAUSIBLE:
        return
    units = unit.kind.units
    raise MeasurementFileError(
        "unit_implausible",
        largest=largest,
        unit=units.deviation,
        other=units.position,
        converted=largest * units.deviations_per_position,
        word=units.deviation_suffix,
        other_word=units.position_suffix,
        place=table.at(),
    )


def _check_not_positions(
    table: Table, values: FloatArray, row_target: FloatArray, unit: Unit
) -> None:
    """Refuse measured positions: deviations in the unit of positions must stay near zero."""
    if unit.kind.units.deviation == unit.name:
        return
    given = ~np.isnan(values)
    if not bool(given.any()):
        return
    positions = unit.positions(values)
    distance = np.abs(positions - row_target[:, None])[given]
    if float(np.median(distance)) < float(np.median(np.abs(positions[given]))) / 2:
        raise MeasurementFileError("positions_not_deviations", unit=unit.name, place=table.at())


def _left_out(
    table: Table, target_column: int, runs: dict[int, int], values: FloatArray
) -> list[Message]:
    """Name the columns that hold no run."""
    known = {target_column, *runs.values()}
    left = [
        column
        for column, heading in enumerate(table.headings)
        if column not in known and (heading.text or any(table.columns[column]))
    ]
    check_left_out(table, left, list(runs.values()), values)
    names = [table.headings[column].text or f"column {column + 1}" for column in left]
    return [remark("columns_of_no_run", names=listed(names))] if names else []


def _deduced_order(
    travelled: _IntArray, targets: int, run: _IntArray, values: FloatArray
) -> FloatArray:
    """Count readings from 1 along passes that follow one another, each along all targets."""
    measured = ~np.all(np.isnan(values), axis=0)
    passes = np.cumsum(measured) - 1
    place = np.where(run % 2 == 1, travelled[:, None], targets - 1 - travelled[:, None])
    place = (passes * targets + place).astype(np.float64)
    given = ~np.isnan(values)
    order = np.full(values.shape, np.nan)
    order[given] = np.argsort(np.argsort(place[given])) + 1
    return order
