"""The rows below the headings: one table, or blocks of readings that follow one another."""

import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import final

import numpy as np

from thermaxis.codes import remark
from thermaxis.errors import MeasurementFileError
from thermaxis.files.table._columns import (
    NO_PASS,
    QUANTITIES,
    Heading,
    Pass,
    Role,
    Unit,
    direction_named,
    is_summary,
    label_named,
    unit_named,
)
from thermaxis.files.table._metadata import Metadata
from thermaxis.files.table._numbers import number_form, without_groups
from thermaxis.files.table._source import is_number
from thermaxis.files.table._table import (
    HEADER_ROWS,
    MAX_COLUMNS,
    MAX_ROWS,
    Layout,
    Row,
    Table,
    TableSource,
    is_comment,
    left_out_remark,
    looks_turned,
    merged_heads,
    read_comment_row,
    read_rows_above,
    recognise,
    turned,
)
from thermaxis.positioning import APPROACHES

_CHUNK_ROWS = 4096
_BESIDE_REMARK = remark("cells_beside")
_NUMBER_STARTS = frozenset("0123456789+-.\N{MINUS SIGN}")
_NUMBER_ENDS = frozenset("0123456789.")
_SIGNS = str.maketrans({"\N{MINUS SIGN}": "-"})
_NUMERIC = frozenset("0123456789+-.,eE' \N{NO-BREAK SPACE}\N{NARROW NO-BREAK SPACE}")
_RULE = frozenset("-:")


def _no_columns() -> list[list[str]]:
    return []


def _key(heading: Heading) -> tuple[object, ...]:
    """Return what is the same in headings of two blocks that mean the same."""
    return heading.role or heading.text, heading.run, heading.approach


@final
@dataclass(slots=True)
class _Block:
    """Rows under one row of headings."""

    layout: Layout
    headings: tuple[Heading, ...]
    heading_row: int
    label: Pass = NO_PASS
    """What a row above says of all of its readings."""
    numbers: list[int] = field(default_factory=list[int])
    columns: list[list[str]] = field(default_factory=_no_columns)
    chunk: list[Sequence[str]] = field(default_factory=list[Sequence[str]])
    width: int = 0
    target: int = 0
    """Column in which a number stands in every row that holds readings."""

    def __post_init__(self) -> None:
        self.width = len(self.headings)
        while self.width and not self.headings[self.width - 1].text:
            self.width -= 1
        self.headings = tuple(
            replace(h, unit=self.label.unit)
            if self.label.unit and h.role is not Role.TARGET and _lacks_unit(h)
            else h
            for h in self.headings[: self.width]
        )
        self.columns = [[] for _ in range(self.width)]
        roles = [heading.role for heading in self.headings]
        self.target = roles.index(Role.TARGET) if Role.TARGET in roles else 0

    def move_to_columns(self) -> None:
        for column, cells in zip(
            self.columns, zip(*self.chunk, strict=True), strict=bool(self.chunk)
        ):
            # the minus sign of typesetting: nothing else can be meant by it
            plain = "\N{MINUS SIGN}" not in "".join(cells)
            column.extend(cells if plain else [cell.translate(_SIGNS) for cell in cells])
        self.chunk.clear()

    def columns_of(self, headings: Sequence[Heading]) -> list[list[str]]:
        """Return the columns in the order of other headings, empty where it has none."""
        own = {_key(heading): k for k, heading in enumerate(self.headings)}
        empty = [""] * len(self.numbers)
        places = [own.get(_key(heading)) for heading in headings]
        return [empty if place is None else self.columns[place] for place in places]


@final
@dataclass(slots=True)
class _Rows:
    """The rows below the first headings, read one after the other."""

    source: TableSource
    metadata: Metadata
    blocks: list[_Block]
    left_out: list[Row] = field(default_factory=list[Row])
    texts: list[Row] = field(default_factory=list[Row])
    """Rows of text that may stand below the last reading only."""
    label: Pass | None = None
    """Label of the block whose first row comes next."""

    def read(self, rows: Iterator[Row]) -> None:
        """Read all rows."""
        rows = self._after_heads_below(rows)
        block = self.blocks[-1]
        last = self.source.mapping.last_row or sys.maxsize
        count = 0
        after_words = False
        for number, found in rows:
            cells = found
            if cells[0].startswith("#") and is_comment(cells):
                read_comment_row(self.metadata, (number, cells), self.source)
                continue
            if number > last:
                self.left_out.append((number, cells))
                continue
            target = cells[block.target] if len(cells) == block.width else ""
            if target[:1] not in _NUMBER_STARTS or target[-1] not in _NUMBER_ENDS:
                if not any(cells) or self._is_other(number, cells):
                    block, after_words = self.blocks[-1], True
                    continue
                cells = self._fitted(cells, block.width, number)
            if after_words:
                block, after_words = self._after_words(block), False
            block.numbers.append(number)
            block.chunk.append(cells)
            count += 1
            if len(block.chunk) == _CHUNK_ROWS:
                block.move_to_columns()
            if count > MAX_ROWS:
                place = self.source.at(number)
                raise MeasurementFileError("too_many_rows_to_read", most=MAX_ROWS, place=place)
        self.left_out += self.texts
        for one in self.blocks:
            one.move_to_columns()
        if self.left_out:
            self.metadata.remarks.append(left_out_remark(self.left_out))

    def _after_heads_below(self, rows: Iterator[Row]) -> Iterator[Row]:
        """Take what a second and a third row of headings say: numbers of passes, units."""
        block = self.blocks[-1]
        first = next(rows, None)
        target = "".join(first[1][block.target : block.target + 1]) if first else ""
        stated = block.headings[block.target].unit
        if first is not None and (not target or (stated and _unit_in(target) is stated)):
            texts = [heading.text for heading in block.headings]
            found = recognise(merged_heads(texts, first[1]) or (), (), self.source.mapping)
            if found is not None:
                block = self.blocks[-1] = _Block(*found, block.heading_row, block.label)
                first = next(rows, None)
        if first is None:
            return rows
        needy = [k for k, heading in enumerate(block.headings) if _lacks_unit(heading)]
        cells = [*first[1], *[""] * block.width][: block.width]
        if not needy or any(map(is_number, cells)):
            return chain((first,), rows)
        units = list(map(_unit_in, cells))
        needed = [k for k in needy if cells[k] or not block.headings[k].is_pass]
        if not any(units[k] for k in needed):
            return chain((first,), rows)
        for k in needed:
            if units[k] is None:
                place = self.source.at(first[0], k, block.headings[k].text)
                raise MeasurementFileError("unknown_length_or_angle", unit=cells[k], place=place)
        block.headings = tuple(
            replace(h, unit=units[k]) if k in needy else h for k, h in enumerate(block.headings)
        )
        return rows

    def _is_other(self, number: int, cells: Sequence[str]) -> bool:
        """Say whether a row holds no readings: a label, headings, a summary or other words."""
        filled = [cell for cell in cells if cell]
        if all(_RULE.issuperset(cell) and "-" in cell for cell in filled):
            return True  # the rule of a Markdown table
        roles = {heading.role for heading in self.blocks[-1].headings}
        complete = Role.DIRECTION in roles and roles & {Role.CYCLE, Role.RUN}
        label = None if complete else label_named(filled)
        if label is not None:
            self.label = label
            return True
        above = self.texts[-1][1] if self.texts else ()
        found = recognise(cells, above, self.source.mapping)
        if found is not None:
            if merged_heads(above, cells):
                self.texts.pop()
            self.left_out += self.texts
            self.texts.clear()
            self.blocks.append(_Block(*found, number, self.label or NO_PASS))
            self.label = None
            return True
        target = cells[self.blocks[-1].target] if len(cells) == self.blocks[-1].width else ""
        if is_summary(target) or (not target and is_summary(filled[0])):
            self.left_out.append((number, cells))
            return True
        words = any(c.isalpha() for c in filled[0]) and direction_named(filled[0]) is None
        if words and not (target and target[:1] in _NUMBER_STARTS):
            self.texts.append((number, cells))
            return True
        return False

    def _after_words(self, block: _Block) -> _Block:
        """Begin a block of the same headings below a label; refuse words between readings."""
        if self.texts:
            number, cells = self.texts[0]
            text = self._fitted(cells, block.width, number)[block.target]
            place = self.source.at(number, block.target, block.headings[block.target].text)
            raise MeasurementFileError("not_a_number", text=text, place=place)
        if self.label is not None:
            block = _Block(block.layout, block.headings, block.heading_row, self.label)
            self.blocks.append(block)
            self.label = None
        return block

    def _fitted(self, cells: Sequence[str], width: int, row: int) -> Sequence[str]:
        if len(cells) == width or (len(cells) > width and not any(cells[width:])):
            return cells[:width]
        if self.source.sheet is None and self.source.lines is None:
            raise MeasurementFileError(
                "cells_and_headings", cells=len(cells), headings=width, place=self.source.at(row)
            )
        if len(cells) > width and _BESIDE_REMARK not in self.metadata.remarks:
            self.metadata.remarks.append(_BESIDE_REMARK)
        return [*cells[:width], *([""] * (width - len(cells)))]


def _unit_in(cell: str) -> Unit | None:
    return unit_named(cell.strip("()[] "))


def _lacks_unit(heading: Heading) -> bool:
    quantity = heading.role in QUANTITIES or heading.is_pass
    return quantity and heading.unit is None and not heading.unit_text


def grid_table(source: TableSource, rows: Sequence[Row], *, certain: str) -> Table | None:
    """Read the first table of a grid of cells, with its headings in a row or in a column."""
    return either_way(
        lambda: _upright(source, rows, certain), source, lambda: rows, Metadata(), certain=certain
    )


def either_way(
    read: Callable[[], Table | None],
    source: TableSource,
    rows: Callable[[], Sequence[Row]],
    metadata: Metadata,
    *,
    certain: str,
) -> Table | None:
    """Return a table as it is read, or else one whose headings stand in its first column."""
    table = error = None
    try:
        table = read()
    except MeasurementFileError as failure:
        error = failure
    if table is not None and not looks_turned(table):
        return table
    if table is not None or source.mapping.transposed:
        return _turned_table(source, rows(), metadata, certain, words_only=False)
    try:
        if source.mapping.transposed is None:
            table = _turned_table(source, rows(), metadata, certain, words_only=True)
    except MeasurementFileError:
        pass  # what is wrong with the table as it stands is nearer
    if table is None and error is not None:
        raise error
    return table


def _turned_table(
    source: TableSource,
    rows: Sequence[Row],
    metadata: Metadata,
    certain: str,
    *,
    words_only: bool,
) -> Table | None:
    if len(rows) > MAX_COLUMNS:
        return None
    turned_source, columns = turned(source, rows, metadata)
    found = recognise(columns[0][1], (), source.mapping) if columns else None
    if found is None or (words_only and any(map(is_number, columns[0][1]))):
        return None
    metadata.remarks.append(remark("transposed"))
    return build_table(turned_source, *found, 1, metadata, columns[1:], certain=certain)


def _upright(source: TableSource, rows: Sequence[Row], certain: str) -> Table | None:
    metadata = Metadata()
    above: list[Row] = []
    below = iter(rows)
    for row in below:
        if is_comment(row[1]):
            read_comment_row(metadata, row, source)
            continue
        found = recognise(row[1], above[-1][1] if above else (), source.mapping)
        if found is not None:
            label = read_rows_above(metadata, above)
            return build_table(
                source, *found, row[0], metadata, below, certain=certain, label=label
            )
        above.append(row)
        if len(above) == HEADER_ROWS:
            break
    return None


def build_table(
    source: TableSource,
    layout: Layout,
    headings: tuple[Heading, ...],
    heading_row: int,
    metadata: Metadata,
    rows: Iterable[Row],
    *,
    certain: str,
    label: Pass | None = None,
) -> Table:
    """Collect the rows below the headings; a certain decimal sign goes where both could be."""
    reading = _Rows(source, metadata, [_Block(layout, headings, heading_row, label or NO_PASS)])
    reading.read(iter(rows))
    blocks = [part for block in reading.blocks if block.numbers for part in _by_approach(block)]
    if not blocks:
        raise MeasurementFileError("no_readings_in_file", place=source.at(heading_row))
    if any(block.layout is not blocks[0].layout for block in blocks):
        place = source.at(blocks[1].heading_row)
        raise MeasurementFileError("other_layout", layout=blocks[1].layout, place=place)
    first = blocks[0]
    targets = max((set(one.columns[one.target]) for one in blocks), key=len)
    for one in blocks:
        place = source.at(one.numbers[0])
        if not set(one.columns[one.target]) <= targets:
            raise MeasurementFileError("blocks_of_other_targets", place=place)
        if _said_by(one) != _said_by(first):
            raise MeasurementFileError("blocks_unlike", place=place)
    if len(blocks) > 1 or first.label != NO_PASS:
        for one in blocks:
            passes = Counter(_key(heading) for heading in one.headings)
            twice = [h.run or 1 for h in one.headings if h.is_pass and passes[_key(h)] > 1]
            if twice:  # joined, one of them would be lost
                place = source.at(one.heading_row)
                raise MeasurementFileError("run_twice", run=twice[0], place=place)
        first = (_joined_wide if first.layout is Layout.WIDE else _joined_tidy)(blocks)
        metadata.remarks.append(remark("blocks_joined", blocks=len(blocks)))
    return _with_numbers(source, first, metadata, certain=certain)


def _said_by(block: _Block) -> tuple[object, ...]:
    """Return what must be the same of all blocks: what their labels say, and units."""
    units = {heading.role: heading.unit for heading in block.headings if heading.role in QUANTITIES}
    return block.label.number is None, block.label.approach is None, tuple(units.items())


def _by_approach(block: _Block) -> list[_Block]:
    """Return a block for each approach that has a column of its own beside that of cycles."""
    sides = [k for k, heading in enumerate(block.headings) if heading.is_pass]
    roles = {heading.role for heading in block.headings}
    numbered = any(block.headings[k].run is not None for k in sides)
    complete = roles & {Role.DEVIATION, Role.MEASURED, Role.DIRECTION}
    if block.layout is Layout.WIDE or not sides or numbered or complete:
        return [block]
    parts: list[_Block] = []
    for k in sides:
        kept = [j for j in range(block.width) if j == k or j not in sides]
        side = replace(block.headings[k], role=Role.DEVIATION, approach=None)
        headings = tuple(side if j == k else block.headings[j] for j in kept)
        label = block.label._replace(approach=block.headings[k].approach)
        part = _Block(block.layout, headings, block.heading_row, label, list(block.numbers))
        part.columns = [block.columns[j] for j in kept]
        parts.append(part)
    return parts


def _joined_wide(blocks: Sequence[_Block]) -> _Block:
    """Put blocks of one target per row under one row of headings: one column per pass."""
    for block in blocks:
        block.headings = tuple(
            replace(
                heading,
                run=heading.run or block.label.number,
                approach=block.label.approach if heading.approach is None else heading.approach,
            )
            if heading.is_pass
            else heading
            for heading in block.headings
        )
    return _stacked(blocks)


def _joined_tidy(blocks: Sequence[_Block]) -> _Block:
    """Put blocks of one reading per row below each other, with what their labels say."""
    roles = {heading.role for block in blocks for heading in block.headings}
    seen: list[Pass] = []
    for block in blocks:
        label = block.label
        added: list[tuple[Role, str]] = []
        if Role.DIRECTION not in roles and label.approach is not None:
            added.append((Role.DIRECTION, APPROACHES[label.approach]))
        if not roles & {Role.CYCLE, Role.RUN}:
            number = label.number or 1 + sum(one.approach == label.approach for one in seen)
            added.append((label.counted or Role.CYCLE, str(number)))
        seen.append(label)
        for role, cell in added:
            block.headings = (*block.headings, Heading(role, role))
            block.columns.append([cell] * len(block.numbers))
    return _stacked(blocks)


def _stacked(blocks: Sequence[_Block]) -> _Block:
    every: dict[object, Heading] = {}
    for heading in (heading for block in blocks for heading in block.headings):
        every.setdefault(_key(heading), heading)
    headings = tuple(every.values())
    whole = _Block(blocks[0].layout, headings, blocks[0].heading_row)
    for block in blocks:
        whole.numbers += block.numbers
        for column, cells in zip(whole.columns, block.columns_of(headings), strict=True):
            column.extend(cells)
    return whole


def _is_numeric(heading: Heading, cells: Sequence[str]) -> bool:
    if heading.role is None and not heading.is_pass:
        return _NUMERIC.issuperset("".join(cells))
    return heading.role is not Role.DIRECTION and (
        heading.role is not Role.TIME or heading.seconds is not None
    )


def _with_numbers(source: TableSource, block: _Block, metadata: Metadata, *, certain: str) -> Table:
    """Find how the numbers are written, and take the signs between thousands away."""
    row = np.array(block.numbers, dtype=np.int64)
    for k, heading in enumerate(block.headings):
        stated = source.mapping.columns.get(heading.text)
        if stated is not None and stated.leave_out:
            block.columns[k] = [""] * row.size
    numeric = [
        (k, block.columns[k])
        for k, heading in enumerate(block.headings)
        if _is_numeric(heading, block.columns[k])
    ]
    form = number_form(numeric, source.mapping, certain=certain, stored=source.sheet is not None)
    places = [
        (int(row[i]), source.at(int(row[i]), k, block.headings[k].text), block.columns[k][i])
        for i, k in form.first
    ]
    if len(places) > 1:
        (first, *_), (_, place, _) = places
        raise MeasurementFileError("decimal_signs_mixed", row=first, place=place)
    if places:
        _, place, text = places[0]
        raise MeasurementFileError("decimal_sign_unclear", text=text, place=place)
    grouped = 0
    for k, cells in numeric if form.grouped else ():
        block.columns[k] = plain = without_groups(cells, form.decimal)
        grouped += sum(map(str.__ne__, cells, plain))
    if grouped:
        sign = "point" if form.decimal == "." else "comma"
        metadata.remarks.append(remark("thousands_removed", count=grouped, sign=sign))
    return Table(
        source,
        block.layout,
        block.heading_row,
        block.headings,
        row,
        tuple(block.columns),
        form.decimal,
        metadata,
    )
