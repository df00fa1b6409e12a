"""Numbers and names of thermal reports as they are printed."""

import hashlib
import math
from collections.abc import Sequence

import numpy as np

from thermaxis.compensation import CompensationModel, Part, Provenance
from thermaxis.positioning import FloatArray
from thermaxis.report._document import (
    Block,
    Column,
    Fields,
    ItemList,
    Paragraph,
    Section,
    Table,
    columns_of,
)
from thermaxis.report._text import NOT_STATED, as_given, fixed, plain_text
from thermaxis.thermal import ThermalLog

DASH = "–"
"""Printed where a number does not exist."""
_NAME = 60
_MOST_WARNINGS = 60
_MOST_LOGS = 40
_FAR = 1e4


def name_text(text: str, limit: int = _NAME) -> str:
    """Return a name from a file as one line; a sign where nothing of it can be shown."""
    return plain_text(text, limit) or "?"


def significant(value: float | None, digits: int = 4) -> str:
    """Return a number with significant digits, without an exponent from a thousandth up."""
    if value is None or not math.isfinite(value):
        return DASH
    if value == 0.0:
        return "0"
    exponent = math.floor(math.log10(abs(value)))
    if exponent < -4 or exponent > 8:
        return f"{value:.{digits - 1}e}"
    return fixed(value, max(0, digits - 1 - exponent))


def with_interval(value: float, std: float | None, factor: float) -> str:
    """Return a number with its interval, both to two digits of the interval."""
    if std is None or not math.isfinite(std) or std <= 0.0:
        return significant(value)
    half = factor * std
    decimals = min(9, max(0, 1 - math.floor(math.log10(half))))
    return f"{fixed(value, decimals)} ± {fixed(half, decimals)}"


def micrometres(value: float | None) -> str:
    """Return a displacement with two decimals; one that they would hide is said to be smaller."""
    if value is None or not math.isfinite(value):
        return DASH
    return "< 0.01" if 0.0 < value < 0.005 else fixed(value, 2)


def percent(value: float | None) -> str:
    """Return a percentage with one decimal."""
    return DASH if value is None else fixed(value, 1, absent=DASH)


def fold(value: float) -> str:
    """Return a reduction of the peak-to-peak value."""
    return f"{fixed(value, 1)}-fold" if value < _FAR else f"more than {_FAR:.0f}-fold"


def hours(seconds: float) -> str:
    """Return a time in hours, minutes or seconds, whatever is read best."""
    if seconds >= 3600.0:
        return f"{significant(seconds / 3600.0, 3)} h"
    return f"{significant(seconds / 60.0, 3)} min" if seconds >= 60.0 else f"{seconds:.3g} s"


def log_sha256(log: ThermalLog) -> str:
    """Return a hash of a log's content: names, times and values as they were read."""
    digest = hashlib.sha256()

    def add(name: str, values: FloatArray) -> None:
        digest.update(f"{len(name)}:{name}\n".encode("utf-8", "surrogatepass"))
        plain = np.where(np.isnan(values), np.nan, values) + 0.0
        digest.update(np.ascontiguousarray(plain, dtype="<f8").tobytes())

    add("", log.time_s)
    for name in sorted(log.columns):
        add(name, log.columns[name])
    return digest.hexdigest()


def warning_blocks(warnings: Sequence[str], extra: Sequence[str] = ()) -> tuple[Block, ...]:
    """Return what must be read first."""
    said = list(dict.fromkeys(plain_text(text, 500) for text in (*warnings, *extra)))
    if not said:
        return (Paragraph("No warnings."),)
    shown = said[:_MOST_WARNINGS]
    if len(said) > len(shown):
        shown.append(f"… and {len(said) - len(shown)} more")
    return (Paragraph("Read first", strong=True), ItemList(tuple(shown)))


def model_parts_table(model: CompensationModel, output_number: int) -> Table:
    """Return the parts of an output of a compensation model."""
    output = model.outputs[output_number]
    with_g = any(part.gain_by_diameter for part in output.parts)
    rows = tuple(
        (
            name_text(part.name, 30),
            name_text(f"{part.plus} - {part.minus}" if part.minus else part.plus),
            significant(part.dc_gain_um_per_k),
            significant(part.direct_gain_um_per_k),
            "; ".join(significant(s.gain_um_per_k) for s in part.sections) or DASH,
            "; ".join(significant(s.time_constant_s) for s in part.sections) or DASH,
            *((_gain_words(part),) if with_g else ()),
        )
        for part in output.parts
    )
    delays = {part.name: part.delay_s for part in output.parts if part.delay_s > 0}
    words = f"Parts of {name_text(output.name)}: gains in µm/K, time constants in s."
    if with_g:
        words += " The gain g goes by workpiece diameter in mm, linear in between."
    if delays:
        words += " Delays: " + ", ".join(f"{name_text(n, 30)} {d:g} s" for n, d in delays.items())
    columns = (
        Column("Input", "left"),
        Column("Channels", "left", wide=True),
        Column("DC gain"),
        Column("Direct"),
        Column("Gains of the lags", "left", wide=True),
        Column("Time constants", "left", wide=True),
        *((Column("g", "left", wide=True),) if with_g else ()),
    )
    return Table(columns, rows, words)


def _gain_words(part: Part) -> str:
    points = (f"{as_given(p.diameter_mm)}: {significant(p.gain, 3)}" for p in part.gain_by_diameter)
    return "; ".join(points) or "1"


def provenance_section(provenance: Provenance, further: Sequence[Block] = ()) -> Section:
    """Return where a model comes from."""
    fields = (
        ("Program", plain_text(provenance.program, 80) or NOT_STATED),
        ("Date", plain_text(provenance.date, 40) or NOT_STATED),
    )
    rows = tuple(
        (
            name_text(entry.name),
            f"{entry.first_row} to {entry.first_row + entry.rows - 1}",
            plain_text(entry.sha256, 70) or "no file",
        )
        for entry in provenance.logs[:_MOST_LOGS]
    )
    method = plain_text(provenance.method, 900) or NOT_STATED
    blocks: list[Block] = [Paragraph(f"Method: {method}"), Fields("", fields)]
    if rows:
        more = len(provenance.logs) - len(rows)
        words = "Training logs, rows from 0." + (f" {more} more are not listed." if more else "")
        columns = columns_of("*Log | Rows | <SHA-256 of the file")
        blocks.append(Table(columns, rows, words))
    return Section("Provenance", (*blocks, *further))
