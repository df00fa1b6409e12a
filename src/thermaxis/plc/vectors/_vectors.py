"""Test vectors: inputs of the block and what it must say, as a table for a spreadsheet or a PLC.

A row is one call, or several in which the inputs are the same and state, words and qualities do
not change; the outputs are those after the last. Numbers are written with as many digits as give
back the same number of the target: 17 for LREAL, 9 for REAL. A spreadsheet that keeps 15 digits
shows them, but is no way to hand LREAL on. One writer for the block with and without a line.
"""

import math
from collections import deque
from collections.abc import Iterator, Mapping
from itertools import groupby
from typing import NamedTuple, final

from thermaxis.compensation import Outcome, Reason, SampleQuality, SupervisorState
from thermaxis.plc._interface import NEVER_OUTCOMES, NEVER_QUALITIES, Kind, interface_of
from thermaxis.plc._line import LineSettings
from thermaxis.plc._numbers import rounded
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.vectors._call_sequence import MOST_CALLS, CallSequence
from thermaxis.plc.vectors._phases import LONG_ROW_CALLS
from thermaxis.plc.vectors._reference import (
    Cell,
    JudgedBlock,
    PlcInputs,
    PlcOutputs,
    by_variable,
    words_of,
)

LINE_LIMITED = "line_limited 1 - the limits of the corrections keep the line within its bounds"
"""What the rows of a block with a line have not: its bounds stand behind those limits."""
TOLERANCE_UM = 0.002
"""Largest difference of a number in REAL from the vectors. [µm]"""
_DIGITS = {True: 17, False: 9}


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
    """What the block may say or be told and that is not in the rows, in words."""
    cuts: tuple[str, ...]
    """Where the course was cut, in words."""


class _Row(NamedTuple):
    """Calls with the same inputs and words."""

    calls: int
    inputs: PlcInputs
    outputs: PlcOutputs
    """After the last call."""
    line: Mapping[str, Cell]
    """The block's own values where there is a line; else empty."""
    judged: bool
    """Whether the target must say the same."""


def vectors_of(
    settings: PlcSettings, line: LineSettings | None = None, *, most_calls: int = MOST_CALLS
) -> Vectors:
    """Return the test vectors: the sequence through every state and every refusal it can reach.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.
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
    seen: set[str] = set()
    rows: list[str] = []
    calls = 0
    before: _Row | None = None
    for row in _rows(sequence, block):
        seen.update(_occurring(settings, row, before))
        values = row.line or {
            **by_variable(settings.names, row.inputs),
            **by_variable(settings.names, row.outputs),
        }
        cells = [calls + 1, row.calls, row.judged, *(values[v.name] for v in variables)]
        rows.append(",".join([_text(cell, double=settings.double) for cell in cells]))
        calls, before = calls + row.calls, row
    missing = tuple(one for one in _demanded(settings, line) if one not in seen)
    cuts = tuple(sequence.cuts)
    units = [v.unit if v.kind is Kind.NUMBER else v.kind.value for v in variables]
    lines = [
        *(f"# {text}" for text in _head(settings, line, calls, missing, cuts)),
        ",".join(["call", "calls", "compare", *(v.name for v in variables)]),
        "# unit," + ",".join(["1", "BOOL", *units]),
        *rows,
    ]
    return Vectors("\n".join([*lines, ""]), len(rows), calls, missing, cuts)


def _rows(sequence: CallSequence, block: JudgedBlock) -> Iterator[_Row]:
    """Return the calls of a sequence, those that say the same together."""
    calls = (_Row(1, *step, block.values(), block.judged) for step in sequence.steps())
    for _, same in groupby(calls, _words):
        ((number, last),) = deque(enumerate(same, 1), maxlen=1)
        yield last._replace(calls=number)


def _words(row: _Row) -> tuple[object, ...]:
    return repr(row.inputs), words_of(row.outputs), row.judged, row.line.get("line_limited")


# ---- what is in them ----------------------------------------------------------------------------


def _occurring(settings: PlcSettings, row: _Row, before: _Row | None) -> Iterator[str]:
    """Yield what occurs in a row, as `_demanded` names it."""
    inputs, outputs = row.inputs, row.outputs
    yield f"state {list(SupervisorState)[outputs.state]}"
    for name, word in (
        ("fault_word", outputs.fault_word),
        ("outcome_word", outputs.outcome_word),
    ):
        yield from (f"{name} {2**k}" for k in range(word.bit_length()) if word & 2**k)
    yield from (f"quality {quality}" for quality in outputs.qualities)
    limited = zip(settings.names.outputs, outputs.at_limit, outputs.wanted_um, strict=True)
    yield from (f"{'upper' if um > 0.0 else 'lower'} limit of {s}" for s, at, um in limited if at)
    expired = (
        before is not None
        and repr(before.inputs.trims_um) == repr(inputs.trims_um)
        and any(before.outputs.added_um)
        and not any(outputs.added_um)
        and not inputs.init
    )
    for name, there in (
        ("a restart", inputs.init),
        ("a request that is refused", outputs.refused),
        ("another compensation", inputs.other_compensation),
        ("a weight below 1", min(outputs.weight) < 1.0),
        ("a trim that expires", expired),
        (LINE_LIMITED, row.line.get("line_limited")),
        (_LONG, row.calls >= LONG_ROW_CALLS),
    ):
        if there:
            yield name
    edges_mm = _edges_mm(settings)
    if edges_mm and any(outputs.parts_um):
        inside = edges_mm[0] <= inputs.diameter_mm <= edges_mm[-1]
        yield _DIAMETERS[2 if not inputs.diameter_known else not inside]


_LONG = f"{LONG_ROW_CALLS} calls without a change"
_DIAMETERS = ("a diameter within the gains", "a diameter outside the gains", "no diameter")


def _edges_mm(settings: PlcSettings) -> list[float]:
    parts = settings.compensation.model.layout.parts
    return sorted(point.diameter_mm for part in parts for point in part.gain_by_diameter)


def _demanded(settings: PlcSettings, line: LineSettings | None) -> Iterator[str]:
    """Yield what may occur."""
    compensation = settings.compensation
    ranged = any(part.lowest_k is not None for part in compensation.model.layout.parts)
    gained = bool(_edges_mm(settings))
    yield from (f"state {state}" for state in SupervisorState)
    yield from (f"fault_word {2**k}" for k in range(len(Reason)))
    never = {
        *NEVER_OUTCOMES,
        *([] if gained else [Outcome.DIAMETER_HELD]),
        *([] if ranged else [Outcome.OUTSIDE_VALIDITY]),
    }
    yield from (f"outcome_word {2**k}" for k, one in enumerate(Outcome) if one not in never)
    freezes = any(rule.frozen_s > 0.0 for rule in compensation.rules)
    lacking = {*NEVER_QUALITIES, *([] if freezes else [SampleQuality.FROZEN])}
    yield from (f"quality {k}" for k, one in enumerate(SampleQuality) if one not in lacking)
    yield from (f"{w} limit of {s}" for s in settings.names.outputs for w in ("upper", "lower"))
    yield from ("a restart", "a request that is refused", "another compensation")
    if any(bounds.largest_trim_um for bounds in compensation.bounds):
        yield "a trim that expires"
    if ranged:
        yield "a weight below 1"
    if gained:
        yield from _DIAMETERS
    if line is not None:
        yield LINE_LIMITED
    yield _LONG


# ---- text ---------------------------------------------------------------------------------------


def _text(cell: Cell, *, double: bool) -> str:
    if isinstance(cell, int):
        return str(int(cell))
    held = rounded(cell, double=double)
    if math.isnan(held):
        return "NaN"
    if math.isinf(held):
        return "+Inf" if held > 0.0 else "-Inf"
    text = f"{held + 0.0:.{_DIGITS[double]}g}".upper()
    return text if "." in text or "E" in text else f"{text}.0"


def _head(
    settings: PlcSettings,
    line: LineSettings | None,
    calls: int,
    missing: tuple[str, ...],
    cuts: tuple[str, ...],
) -> Iterator[str]:
    digits = _DIGITS[settings.double]
    kind = "LREAL binary64" if settings.double else "REAL binary32"
    yield f"test vectors of the block {settings.names.block}" + (
        "" if line is None else " with a straight line"
    )
    yield f"model sha256: {settings.model_sha256 or 'not stated'}"
    yield f"cycle: {settings.cycle_s:g} s"
    yield f"numbers: {kind} - {digits} digits give back the same number"
    yield f"calls: {calls}"
    yield from (f"cut: {text}" for text in cuts)
    yield from (f"not in the rows: {text}" for text in missing)
    yield "call: number of the first call of the row"
    yield "calls: how often the block is called with these inputs - the outputs are after the last"
    yield "init 1: the block begins anew, as after power-on"
    yield "compare 0: leave the row out - a rounding may move a change of state by a call here"
    yield "BOOL is 0 or 1 - NaN and +Inf and -Inf are such numbers"
    yield "a PLC that cannot make them in an input leaves out the rows up to the next init"
    yield "the outputs are those of the cycle that runs on the computer - in binary64"
    if settings.double:
        yield "compare with equality - a zero has no sign"
    else:
        yield f"compare BOOL and INT with equality - um within {TOLERANCE_UM} um - others 1.0E-6"
