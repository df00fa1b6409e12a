"""HEIDENHAIN iTNC 530: Klartext program of a plan, and its compensation table ``AXIS-X.COM``.

The table has one value for both directions at equidistant points; reversal is a machine parameter.

References
----------
Form of the file: the public program Paolico/AxisCorection [V, code]. Assignment by ``.CMA`` and
power-of-two spacing: HEIDENHAIN technical manual TNC 407/415/425 [V]; sign of the values by the
same two [S].
"""

import re
from collections.abc import Mapping
from typing import final

import numpy as np

from thermaxis.codes import Message
from thermaxis.controls._control import (
    GridRule,
    ReadTable,
    TableRequest,
    TableText,
    advice,
    check_points,
    finding,
    options_of,
)
from thermaxis.controls.heidenhain._com import (
    DECIMALS,
    HALF_DIGIT,
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
from thermaxis.controls.heidenhain._klartext import PROGRAM_OPTIONS, klartext_axis
from thermaxis.errors import ConfigurationError, MeasurementFileError
from thermaxis.positioning import CompensationTable, FloatArray
from thermaxis.quantities import AxisKind

_FIRST = re.compile(
    r"BEGIN +(?P<name>[A-Za-z0-9_-]{1,40})\.COM +DATUM: *(?P<datum>\S+) +DISTANCE: *(?P<step>\S+)",
    re.IGNORECASE,
)
_NUMBER_WIDTH, _POSITION_WIDTH, _HEADING_PLACE = 8, 12, 20
_STATION_SLACK = 1e-9


@final
class HeidenhainITnc530(HeidenhainControl):
    """HEIDENHAIN iTNC 530.

    Not protected: a program moves one axis and knows nothing of what stands in its way. A table
    acts when a ``.CMA`` table names it; its sign is from a secondary source, and whether it fits
    is shown by a measurement only. No machine has proven either yet.
    """

    title = "HEIDENHAIN iTNC 530"
    sign = advice("itnc530_sign")
    options = (*PROGRAM_OPTIONS, *options_of("heidenhain-itnc530"))

    def grid_rule(self, kind: AxisKind, options: Mapping[str, str]) -> GridRule:
        """Return the rule: up to 256 equidistant points, one value each."""
        power = options["spacing"] == "power_of_two"
        return GridRule(
            equidistant=True,
            most_points=MOST_POINTS,
            per_direction=False,
            backlash_apart=False,
            resolution=value_unit(kind) * 10.0**-DECIMALS,
            decimals=DECIMALS,
            advice=advice("itnc530_distance" if power else "itnc530_older_models"),
        )

    def format_table(self, request: TableRequest) -> TableText:
        """Return the table as ``AXIS-X.COM``."""
        table = request.table
        check_points(table, self.grid_rule(table.kind, request.options), self.title)
        axis = klartext_axis(table.axis)
        step = _written_step(table)
        if request.options["spacing"] == "power_of_two":
            _check_power_of_two(step)
        name = f"AXIS-{axis}.COM"
        lines = [
            f"BEGIN {name}  DATUM:{signed(float(table.position[0]))} DISTANCE:{signed(step)}",
            f"{'NR':<{_HEADING_PLACE}}{axis}",
        ]
        values = table.mean / value_unit(table.kind)
        for i, (place, value) in enumerate(zip(table.position, values, strict=True)):
            lines.append(
                f"{i:<{_NUMBER_WIDTH}}{signed(float(place)):<{_POSITION_WIDTH}}"
                f"{signed(float(value))}"
            )
        own = [advice("itnc530_one_value")]
        if table.backlash is not None:
            unit = table.kind.units.deviation
            own.append(advice("itnc530_reversal", reversal=table.backlash, unit=unit))
        return self.written(lines, table, name, *own)

    def read_table(
        self, text: str, path: str, kind: AxisKind, options: Mapping[str, str]
    ) -> ReadTable:
        """Read a table of this form.

        The control takes the positions from datum and distance [M]; a row whose own position
        differs is an error.
        """
        source = com_text(text, path)
        found = _FIRST.fullmatch(source.lines[0].strip())
        if found is None:
            raise MeasurementFileError(
                "first_line_unfit", form="BEGIN ... .COM with DATUM and DISTANCE", file=path, line=1
            )
        datum = source.number(found["datum"], 1, "DATUM")
        step = source.number(found["step"], 1, "DISTANCE")
        if step <= 0:
            raise MeasurementFileError(
                "not_positive", value=step, file=path, line=1, column="DISTANCE"
            )
        headings = headings_of(source, ("NR",))
        axis, findings = own_column(source, found["name"], list(headings))
        value = _rows(source, datum, step, headings, axis, findings)
        if options.get("spacing") == "power_of_two" and not _is_power_of_two(step):
            findings.append(finding("no_power_of_two", spacing_mm=step))
        deviation = np.array(value) * value_unit(kind)
        position: FloatArray = datum + step * np.arange(len(value), dtype=np.float64)
        return ReadTable(
            table=CompensationTable(
                kind=kind,
                axis=axis,
                position=np.round(position, 2 * DECIMALS),
                deviation=np.stack((deviation, deviation), axis=1),
            ),
            findings=(*source.findings, *findings),
        )


CONTROL = HeidenhainITnc530()
"""The control."""


# ---- writing ------------------------------------------------------------------------------------


def _written_step(table: CompensationTable) -> float:
    """Return the distance as it is written; the points must be what datum and it give."""
    check_positions(table)
    if table.position.size < 2:
        raise ConfigurationError("too_few_table_points", key="points")
    step = round(float(table.position[1] - table.position[0]), DECIMALS)
    even = table.position[0] + step * np.arange(table.position.size)
    if step <= 0 or bool(np.any(np.abs(table.position - even) > HALF_DIGIT)):
        raise ConfigurationError("points_not_equidistant", key="points")
    return step


def _is_power_of_two(step: float) -> bool:
    count = round(step * 10**DECIMALS)
    return count > 0 and count & (count - 1) == 0 and abs(count - step * 10**DECIMALS) < 1e-6


def _check_power_of_two(step: float) -> None:
    if _is_power_of_two(step):
        return
    below = int(np.floor(np.log2(step * 10**DECIMALS)))
    near = [2.0**power / 10**DECIMALS for power in (below, below + 1)]
    raise ConfigurationError(
        "spacing_no_power_of_two",
        spacing_mm=step,
        below_mm=near[0],
        above_mm=near[1],
        key="--set spacing",
    )


# ---- reading ------------------------------------------------------------------------------------


def _rows(
    source: ComText,
    datum: float,
    step: float,
    headings: Mapping[str, int],
    axis: str,
    findings: list[Message],
) -> list[float]:
    values: list[float] = []
    others: set[str] = set()
    for i, (line, words) in enumerate(rows_of(source, needs_end=False)):
        if len(words) < 2:
            raise MeasurementFileError("row_too_short", place=source.at(line))
        place = source.number(words[0][1], line, "position")
        # both are rounded: the distance once for each row before
        if abs(place - datum - i * step) > HALF_DIGIT * (i + 2) + _STATION_SLACK:
            raise MeasurementFileError(
                "rows_not_equidistant",
                position=place,
                expected=datum + i * step,
                row=i,
                place=source.at(line),
            )
        row = source.numbers(line, words[1:], headings)
        if axis not in row:
            raise MeasurementFileError("row_value_missing", place=source.at(line, axis))
        values.append(row.pop(axis))
        others |= row.keys()
    findings += findings_on_others(others)
    return values
