"""The certificate's annex: results of each target and all readings."""

import math

import numpy as np

from thermaxis.positioning import FloatArray
from thermaxis.report._document import Block, Column, Paragraph, Section, Table, columns_of
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._style import ARROWS
from thermaxis.report._text import MISSING, decimals_of, fixed, plain_text, positions
from thermaxis.report.certificate._drift import level_tables
from thermaxis.report.certificate._number_tables import number_table, numbered_positions
from thermaxis.report.charts import detail_decimals

_MOST_PRINTED = 20_000
"""More readings than these fill a hundred pages that nobody reads. [1]"""
_LINE_PT, _CHARACTER_PT, _GUTTER_PT = 445.0, 2.9, 4.8
"""Width of a row of readings, of one of its digits, and between columns, as printed. [pt]"""
_MOST_CHANNELS = 30


def target_section(report: PositioningReport) -> Section:
    """Return the results of each target."""
    result, test = report.iso230_2, report.test

    def of_approaches(symbol: str, values: FloatArray) -> list[tuple[str, FloatArray]]:
        return [(f"{symbol}{ARROWS[a]}", values[:, a]) for a in test.approaches]

    both, both_r = [("x̄", result.mean_bidirectional), ("B", result.B_i)], [("R", result.R_i)]
    if test.unidirectional:
        both, both_r = [], []
    values = [
        *of_approaches("x̄", result.mean),
        *of_approaches("s", result.s),
        *both,
        *of_approaches("R", result.R_i_unidirectional),
        *both_r,
    ]
    decimals = detail_decimals(report)
    caption = (
        f"Results of each target, in {test.kind.units.deviation}: mean unidirectional deviations,"
        " estimated standard deviations (divisor n - 1), mean bidirectional deviation, reversal"
        " and repeatabilities, as far as they exist."
    )
    table = number_table(
        f"<i | Target [{test.kind.units.position}]",
        numbered_positions(result.target),
        [(label, numbers, decimals) for label, numbers in values],
        caption,
    )
    return Section("results of each target", (table, *level_tables(report)))


def raw_section(report: PositioningReport) -> Section:
    """Return all readings, so that anybody can recompute the results."""
    test = report.test
    readings = int(np.sum(~np.isnan(test.deviation)))
    if test.target.size * test.cycles * len(report.test.approaches) > _MOST_PRINTED:
        heading = f"raw data (not printed: more than {_MOST_PRINTED} readings)"
        words = (
            f"The {readings} readings are not printed here. They are attached to the PDF"
            " (readings.csv), and in the measurement file whose SHA-256 this certificate states."
        )
        return Section(heading, (Paragraph(words), *_channels(report)))
    heading = "raw data (all readings)"
    missing = sum(
        int(np.sum(np.isnan(test.deviation[:, :, approach]))) for approach in report.test.approaches
    )
    words = (
        f"{readings} readings, {missing or 'none'} missing: deviations, measured minus target, in"
        f" {test.kind.units.deviation}, with all their decimals; one row per run, one column per"
        f" target (in {test.kind.units.position})."
    )
    return Section(heading, (Paragraph(words), *_reading_tables(report), *_channels(report)))


def _reading_tables(report: PositioningReport) -> list[Block]:
    test = report.test
    decimals = decimals_of(test.deviation)
    approaches = report.test.approaches
    texts = {
        approach: [
            [fixed(value, decimals, absent=MISSING) for value in row]
            for row in test.deviation[:, :, approach].T.tolist()
        ]
        for approach in approaches
    }
    where = positions(test.target)
    widest = max(len(cell) for rows in texts.values() for row in rows for cell in row)
    width = max(widest, *(len(position) for position in where)) * _CHARACTER_PT + _GUTTER_PT
    blocks = math.ceil(len(where) / max(1, int(_LINE_PT / width)))
    per_block = math.ceil(len(where) / blocks)
    tables: list[Block] = []
    for first in range(0, len(where), per_block):
        part = slice(first, first + per_block)
        columns = (Column("Cycle"), Column("", "left"), *(Column(w) for w in where[part]))
        rows = tuple(
            (str(cycle + 1), ARROWS[approach], *texts[approach][cycle][part])
            for cycle in range(test.cycles)
            for approach in approaches
        )
        last = min(first + per_block, len(where))
        caption = "" if blocks == 1 else f"Targets {first + 1} to {last}."
        tables.append(Table(columns, rows, caption, dense=True))
    return tables


def _channels(report: PositioningReport) -> list[Block]:
    """Return the range of every further reading that was taken at the stops."""
    channels = report.test.channels
    if not channels:
        return []
    rows: list[tuple[str, ...]] = []
    for name, values in list(channels.items())[:_MOST_CHANNELS]:
        known = values[~np.isnan(values)]
        decimals = min(6, decimals_of(values) + 1)
        statistics = (np.min, np.mean, np.max) if known.size else ()
        numbers = [fixed(float(of(known)), decimals) for of in statistics] or [MISSING] * 3
        rows.append((plain_text(name, 60) or "?", str(known.size), *numbers))
    if len(channels) > _MOST_CHANNELS:
        rows.append((f"… {len(channels) - _MOST_CHANNELS} more", "", "", "", ""))
    columns = columns_of("*Channel | Readings | Least | Mean | Largest")
    words = "Further channels of the file, in the unit of the file, which is not stated."
    return [Table(columns, tuple(rows), words)]
