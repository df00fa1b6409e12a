"""Write a thermal log as CSV that reads back the same."""

from math import isnan
from pathlib import Path

import numpy as np

from thermaxis.files._opened import write_content
from thermaxis.files.logs._columns import parse_log_heading
from thermaxis.files.table import encoded, protected, quoted
from thermaxis.messages import sentence_of
from thermaxis.thermal import ThermalLog


def write_thermal_log(
    log: ThermalLog, path: Path | str, *, first_time_s: float | None = None
) -> None:
    """Write a thermal log as CSV.

    Parameters
    ----------
    path : Path or str
        The file; one that is there is replaced.
    first_time_s : float, optional
        Times begin with this number, and no line of comment stands above the headings: what every
        spreadsheet reads. Default: as of `format_thermal_log`. [s]

    Raises
    ------
    MeasurementFileError
        If the file cannot be written.
    """
    write_content(path, format_thermal_log(log, first_time_s=first_time_s).encode("ascii"))


def format_thermal_log(log: ThermalLog, *, first_time_s: float | None = None) -> str:
    """Return a thermal log as CSV text: ASCII, comma between cells, decimal point.

    Times count from the first row; start, the recorder's clock at the first row and remarks stand
    in lines of comment above the headings. Numbers have the shortest form that reads back as the
    same float64, and a value that was not measured is an empty cell.

    Parameters
    ----------
    first_time_s : float, optional
        Times begin with this number, and there are no lines of comment. Default: times from the
        first row. [s]

    Returns
    -------
    str
        The text of the file.
    """
    lines = _comments(log) if first_time_s is None else []
    time_s = log.time_s + (first_time_s or 0.0)
    lines.append(",".join(["time_s", *(_cell(n, log.units[n]) for n in log.columns)]))
    columns = [_numbers(time_s), *(_numbers(values) for values in log.columns.values())]
    lines += map(",".join, zip(*columns, strict=True))
    return "\n".join(lines) + "\n"


def _comments(log: ThermalLog) -> list[str]:
    lines: list[str] = []
    if log.start is not None:
        lines.append(f"# start: {log.start.isoformat()}")
    if log.origin_s:
        lines.append(f"# origin_s: {_number(log.origin_s)}")
    return lines + [f"# remark: {_ascii(sentence_of(remark))}" for remark in log.remarks]


def _ascii(text: str) -> str:
    return encoded(text) if text.isascii() else quoted(text)


def _cell(name: str, unit: str) -> str:
    """Write name and unit so that the reader finds both again."""
    heading = _as_heading(name, unit)
    return '"' + heading.replace('"', '""') + '"' if set(heading) & set(',;"\t') else heading


def _as_heading(name: str, unit: str) -> str:
    plain = protected(name)
    if not name.isascii() or not name.isprintable() or name != name.strip() or "\\" in name:
        plain = quoted(name)
    shown = unit.replace("°", "deg")
    candidates = [plain, f"{plain} [{shown}]", f"{quoted(name)} [{shown}]"]
    for heading in candidates:
        parsed = parse_log_heading(heading)
        if (parsed.name, parsed.unit) == (name, unit):
            return heading
    return candidates[-1]


def _numbers(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> list[str]:
    return [_number(value) for value in values.tolist()]


def _number(value: float) -> str:
    if isnan(value):  # not measured
        return ""
    text = repr(value)
    return text.removesuffix(".0")
