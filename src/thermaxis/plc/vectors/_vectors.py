"""Test vectors: inputs of the block and what it must say, as a table for a spreadsheet or a PLC.

A row is one call, or several in which the inputs are the same and state, words and qualities do
not change; the outputs are those after the last. Numbers are written with as many digits as give
back the same number of the target: 17 for LREAL, 9 for REAL. A spreadsheet that keeps 15 digits
shows them, but is no way to hand LREAL on. One writer for the block with and without a line.
"""

import math
from collections import deque
from collections.abc import Mapping
from itertools import groupby
from operator import itemgetter
from typing import Any, NamedTuple, final

from thermaxis.plc._interface import interface_of
from thermaxis.plc._line import LineSettings
from thermaxis.plc._numbers import DIGITS, digits_text, rounded
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc._template import rendered
from thermaxis.plc.vectors._call_sequence import MOST_CALLS, CallSequence
from thermaxis.plc.vectors._reference import JudgedBlock, PlcStep

LINE_LIMITED = "line_limited 1 - the limits of the corrections keep the line within its bounds"
"""What the rows of a block with a line have not: its bounds stand behind those limits."""
TOLERANCE_UM = 0.002
"""Largest difference of a number in REAL from the vectors. [µm]"""


@final
class Vectors(NamedTuple):
    """Test vectors, and what is not in them."""

    text: str
    """The table: lines with ``#``, names of the columns, units, rows."""
    rows: int
    """Rows. [1]"""
    calls: int
    """Calls that they stand for. [1]"""
    missing: tuple[str, ...]
    """What this block cannot reach, or for which there were not calls enough, in words."""
    cuts: tuple[str, ...]
    """Where the course was cut, in words."""


def vectors_of(
    settings: PlcSettings, line: LineSettings | None = None, *, most_calls: int = MOST_CALLS
) -> Vectors:
    """Return the test vectors: the sequence through every state and every refusal it can reach.

    Parameters
    ----------
    line : LineSettings, optional
        The line. Default: there is none.
    most_calls : int
        Calls after which the sequence ends; its phases share them. Default: `MOST_CALLS`. [1]

    Returns
    -------
    Vectors
        The table; the same settings give the same bytes.
    """
    face = interface_of(settings, line)
    variables = (*face.inputs, *face.outputs)
    block = JudgedBlock(settings, line)
    sequence = CallSequence(settings, most_calls=most_calls, block=block)
    told = itemgetter(*(v.name for v in face.inputs))

    def called(step: PlcStep) -> tuple[bool, Mapping[str, Any], tuple[object, ...]]:
        values = block.values()
        limited = values.get("line_limited")  # of a line alone
        # Numbers that are none differ from themselves, but not what is written for them.
        same = repr(told(values)), block.words(step.outputs), block.judged, limited
        return block.judged, values, same

    rows: list[str] = []
    calls = 0
    for _, some in groupby(map(called, sequence.steps()), itemgetter(2)):
        ((number, (judged, values, _)),) = deque(enumerate(some, 1), maxlen=1)
        cells = [calls + 1, number, judged, *(values[v.name] for v in variables)]
        rows.append(",".join([_text(cell, double=settings.double) for cell in cells]))
        calls += number
    missing, cuts = (*sequence.missing(), *([LINE_LIMITED] if line else [])), tuple(sequence.cuts)
    values = {
        "settings": settings,
        "line": line,
        "digits": DIGITS[settings.double],
        "tolerance_um": TOLERANCE_UM,
        "calls": calls,
        "cuts": cuts,
        "missing": missing,
        "variables": variables,
        "rows": rows,
    }
    return Vectors(rendered("vectors.csv.j2", values), len(rows), calls, missing, cuts)


def _text(cell: float, *, double: bool) -> str:
    if isinstance(cell, int):
        return str(int(cell))
    held = rounded(cell, double=double) + 0.0
    if math.isfinite(held):
        return digits_text(held, double=double)
    return f"{held:+}".capitalize() if math.isinf(held) else "NaN"
