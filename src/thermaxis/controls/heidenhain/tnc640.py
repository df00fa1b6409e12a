"""HEIDENHAIN TNC 640, TNC 620, MANUALplus: Klartext program, and the table ``AXIS_X.COM``.

The table states the position of every point, so that they need not be equidistant, and has a value
for each direction.

References
----------
HEIDENHAIN technical manual MANUALplus 620, p. 716 and 718 [V]: AXISPOS from the machine datum,
BACKLASH with the values measured in negative direction, assignment by ``.CMA``. Widths of the
columns and sign: the public program Paolico/AxisCorection [S].
"""

import re
from collections.abc import Mapping
from typing import final

import numpy as np

from thermaxis.controls._control import (
    GridRule,
    ReadTable,
    TableRequest,
    TableText,
    advice,
    check_points,
)
from thermaxis.controls.heidenhain._com import (
    DECIMALS,
    MOST_POINTS,
    ComText,
    HeidenhainControl,
    check_positions,
    com_text,
    findings_on_others,
    headings_of,
    own_column,
    rows_of,
    signed,
    value_unit,
)
from thermaxis.errors import ConfigurationError, MeasurementFileError
from thermaxis.positioning import BACKWARD, FORWARD, CompensationTable, FloatArray
from thermaxis.quantities import AxisKind

_FIRST = re.compile(r"BEGIN +(?P<name>[A-Za-z0-9_-]{1,40})\.COM +(?P<unit>[A-Za-z]{1,10})")
_AXIS = re.compile(r"[A-Z][A-Z0-9]{0,7}")
_NUMBER_WIDTH, _WIDTH = 5, 14
_POSITION, _BACKWARD = "AXISPOS", "BACKLASH"


@final
class HeidenhainTnc640(HeidenhainControl):
    """HEIDENHAIN TNC 640, TNC 620 and MANUALplus 620.

    Not protected: a program moves one axis and knows nothing of what stands in its way. A table
    acts when the active line of a ``.CMA`` table names it; its sign is from a secondary source,
    and whether it fits is shown by a measurement only. No machine has proven either yet.
    """

    title = "HEIDENHAIN TNC 640"
    sign = advice("tnc640_sign")

    def grid_rule(self, kind: AxisKind, options: Mapping[str, str]) -> GridRule:
        """Return the rule: up to 256 points at any distances, a value for each direction."""
        del options
        return GridRule(
            equidistant=False,
            most_points=MOST_POINTS,
            per_direction=True,
            backlash_apart=False,
            resolution=value_unit(kind) * 10.0**-DECIMALS,
            decimals=DECIMALS,
            advice=advice("tnc640_distances"),
        )

    def format_table(self, request: TableRequest) -> TableText:
        """Return the table as ``AXIS_X.COM``."""
        table = request.table
        check_points(table, self.grid_rule(table.kind, request.options), self.title)
        check_positions(table)
        axis = table.axis.upper()
        if _AXIS.fullmatch(axis) is None or axis in {"NR", _POSITION, _BACKWARD}:
            raise ConfigurationError(
                "axis_name_unfit", name=table.axis, control=self.title, key="axis"
            )
        name = f"AXIS_{axis}.COM"
        # a reversal that another control holds apart belongs into the two columns here
        value = table.deviation_at(table.position) / value_unit(table.kind)
        both = bool(np.any(value[:, FORWARD] != value[:, BACKWARD]))
        lines = [
            f"BEGIN {name} MM",
            f"{'NR':<{_NUMBER_WIDTH}}{_POSITION:<{_WIDTH}}{_BACKWARD:<{_WIDTH}}{axis}",
        ]
        for i, place in enumerate(table.position.tolist()):
            other = signed(float(value[i, BACKWARD])) if both else ""
            lines.append(
                f"{i:<{_NUMBER_WIDTH}}{signed(place):<{_WIDTH}}"
                f"{other:<{_WIDTH}}{signed(float(value[i, FORWARD]))}"
            )
        lines.append("[END]")
        columns = advice("tnc640_two_columns", axis=axis) if both else advice("tnc640_one_column")
        return self.written(lines, table, name, columns)

    def read_table(
        self, text: str, path: str, kind: AxisKind, options: Mapping[str, str]
    ) -> ReadTable:
        """Read a table of this form."""
        del options
        source = com_text(text, path)
        found = _FIRST.fullmatch(source.lines[0].strip())
        if found is None:
            raise MeasurementFileError(
                "first_line_unfit", form="BEGIN ... .COM MM", file=path, line=1
            )
        if found["unit"].upper() != "MM":
            raise MeasurementFileError("table_not_in_mm", unit=found["unit"], file=path, line=1)
        headings = headings_of(source, ("NR", _POSITION))
        labels = [name for name in headings if name not in {_POSITION, _BACKWARD}]
        axis, findings = own_column(source, found["name"], labels)
        rows = _rows(source, headings)
        deviation = _deviation(source, rows, axis) * value_unit(kind)
        findings += findings_on_others({n for row in rows for n in row if n in labels} - {axis})
        return ReadTable(
            table=CompensationTable(
                kind=kind,
                axis=axis,
                position=np.array([row[_POSITION] for row in rows]),
                deviation=deviation,
            ),
            findings=(*source.findings, *findings),
        )


CONTROL = HeidenhainTnc640()
"""The control."""


# ---- reading ------------------------------------------------------------------------------------


def _rows(source: ComText, headings: Mapping[str, int]) -> list[dict[str, float]]:
    """Return each row's numbers by heading."""
    rows: list[dict[str, float]] = []
    for line, words in rows_of(source, needs_end=True):
        row = source.numbers(line, words, headings)
        if _POSITION not in row:
            raise MeasurementFileError("row_value_missing", place=source.at(line, _POSITION))
        if rows and row[_POSITION] <= rows[-1][_POSITION]:
            raise MeasurementFileError(
                "position_not_rising",
                position=row[_POSITION],
                before=rows[-1][_POSITION],
                place=source.at(line),
            )
        rows.append(row)
    return rows


def _deviation(source: ComText, rows: list[dict[str, float]], axis: str) -> FloatArray:
    """Return the values per direction, (k, 2). [mm or deg]"""
    both = any(_BACKWARD in row for row in rows)
    for line, row in enumerate(rows, start=3):
        if axis not in row:
            raise MeasurementFileError("row_value_missing", place=source.at(line, axis))
        if both and _BACKWARD not in row:
            raise MeasurementFileError("row_value_missing", place=source.at(line, _BACKWARD))
    side = _BACKWARD if both else axis
    return np.array([[row[axis], row[side]] for row in rows])
