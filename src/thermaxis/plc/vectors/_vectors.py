"""Test vectors: inputs of the block and what it must say, as a table for a spreadsheet or a PLC.

A row is one call, or several in which the inputs are the same and state, words and qualities do
not change; the outputs are those after the last. Numbers are written with as many digits as give
back the same number of the target: 17 for LREAL, 9 for REAL. A spreadsheet that keeps 15 digits
shows them, but is no way to hand LREAL on. One writer for the block with and without a line.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple, final

from thermaxis.codes import Place
from thermaxis.compensation import Outcome, Reason, SampleQuality, SupervisorState
from thermaxis.errors import ConfigurationError
from thermaxis.plc._interface import NEVER_OUTCOMES, NEVER_QUALITIES, Kind, Variable, interface_of
from thermaxis.plc._line import LineSettings
from thermaxis.plc._numbers import rounded
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.vectors._call_sequence import (
    MOST_CALLS,
    MOST_ROWS,
    CallSequence,
)
from thermaxis.plc.vectors._phases import LONG_ROW_CALLS
from thermaxis.plc.vectors._reference import (
    Cell,
    PlcInputs,
    PlcOutputs,
    block_beside_others,
    by_variable,
    words_of,
)
from thermaxis.plc.vectors._simulated_plant import NEAR_SHARE

DEFAULT_SEED = 1
"""Seed of the noise in the vectors. [1]"""
LINE_LIMITED = "line_limited 1 - the limits of the corrections keep the line within its bounds"
"""What the rows of a block with a line have not: its bounds stand behind those limits."""
_LIMITED = "line_limited"
TOLERANCE_UM = 0.002
"""Largest difference of a number in REAL from the vectors. [µm]"""
_LARGEST_ROWS = 1_000_000
_DIGITS = {True: 17, False: 9}
# Least squares through several positions may enlarge what a control rounds.
_LINE_SHARE = 0.4


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


def vectors_of(
    settings: PlcSettings,
    line: LineSettings | None = None,
    *,
    most_rows: int = MOST_ROWS,
    most_calls: int = MOST_CALLS,
) -> Vectors:
    """Return the test vectors: the sequence through every state and every refusal it can reach.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.
    line : LineSettings, optional
        The line. Default: there is none.
    most_rows : int
        Rows after which the table ends; the phases of the sequence share them. Default:
        `MOST_ROWS`. [1]
    most_calls : int
        Calls after which the sequence ends. Default: `MOST_CALLS`. [1]

    Returns
    -------
    Vectors
        The table; the same settings give the same bytes.

    Raises
    ------
    ConfigurationError
        If `most_rows` is not from 1 to a million.
    """
    if not 1 <= most_rows <= _LARGEST_ROWS:
        raise ConfigurationError(
            "outside_range",
            value=most_rows,
            least=1,
            most=_LARGEST_ROWS,
            place=Place(key="most_rows"),
        )
    block = block_beside_others(settings, line)
    face = interface_of(settings, line)
    variables = (*face.inputs, *face.outputs)
    sequence = CallSequence(
        settings,
        seed=DEFAULT_SEED,
        most_rows=most_rows,
        most_calls=most_calls,
        block=block,
        near_share=NEAR_SHARE if line is None else _LINE_SHARE,
    )
    seen = _Seen(settings, line)
    rows: list[str] = []
    calls = 0
    cuts: list[str] = []
    made = (
        _Call(inputs, outputs, {} if line is None else block.values(), block.judged)
        for inputs, outputs in sequence.steps()
    )
    for run in _runs(made):
        if len(rows) == most_rows:
            cuts.append(f"the table after {calls} calls for want of rows")
            break
        seen.note(run)
        rows.append(_row(settings, run, variables, first=calls + 1))
        calls += run.calls
    cuts += sequence.cuts
    missing = seen.missing()
    lines = [
        *(f"# {text}" for text in _head(settings, line, calls, (*missing,), (*cuts,))),
        ",".join(["call", "calls", "compare", *(v.name for v in variables)]),
        "# unit," + ",".join(["1", "BOOL", *map(_unit, variables)]),
        *rows,
    ]
    return Vectors("\n".join([*lines, ""]), len(rows), calls, missing, tuple(cuts))


# ---- calls --------------------------------------------------------------------------------------


class _Call(NamedTuple):
    inputs: PlcInputs
    outputs: PlcOutputs
    line: Mapping[str, Cell]
    """The block's own values where there is a line; else empty."""
    judged: bool
    """Whether the target must say the same."""


class _Run(NamedTuple):
    """Calls with the same inputs."""

    first: _Call
    calls: int
    last: _Call


def _runs(made: Iterable[_Call]) -> Iterator[_Run]:
    run: _Run | None = None
    for call in made:
        if run is not None and _same(run, call):
            run = _Run(run.first, run.calls + 1, call)
            continue
        if run is not None:
            yield run
        run = _Run(call, 1, call)
    if run is not None:
        yield run


def _same(run: _Run, call: _Call) -> bool:
    """Return whether a call belongs to a run."""
    return (
        words_of(run.last.outputs) == words_of(call.outputs)
        and run.last.judged == call.judged
        and run.last.line.get(_LIMITED) == call.line.get(_LIMITED)
        and repr(run.first.inputs) == repr(call.inputs)
    )


# ---- what is in them ----------------------------------------------------------------------------


@final
class _Seen:
    """What occurs in the rows."""

    def __init__(self, settings: PlcSettings, line: LineSettings | None) -> None:
        self._settings, self._has_line = settings, line is not None
        self._states: set[int] = set()
        self._faults = self._outcomes = 0
        self._qualities: set[int] = set()
        self._limits: set[tuple[int, bool]] = set()
        self._told: set[str] = set()
        self._longest = 0
        self._trims: tuple[float, ...] = ()
        self._trimmed_calls, self._accepted = 0, False
        self._line_limited = False
        parts = settings.compensation.model.layout.parts
        gains = [point for part in parts for point in part.gain_by_diameter]
        self._diameters = (
            (min(p.diameter_mm for p in gains), max(p.diameter_mm for p in gains))
            if gains
            else None
        )

    def note(self, run: _Run) -> None:
        """Note what occurs in a row."""
        inputs, outputs = run.first.inputs, run.last.outputs
        self._line_limited |= bool(run.last.line.get(_LIMITED))
        self._states.add(outputs.state)
        self._faults |= outputs.fault_word
        self._outcomes |= outputs.outcome_word
        self._qualities.update(outputs.qualities)
        self._longest = max(self._longest, run.calls)
        for k, (at_limit, wanted_um) in enumerate(
            zip(outputs.at_limit, outputs.wanted_um, strict=True)
        ):
            if at_limit:
                self._limits.add((k, wanted_um > 0.0))
        for name, told in (
            ("a restart", inputs.init),
            ("a request that is refused", outputs.refused),
            ("another compensation", inputs.other_compensation),
            ("a weight below 1", min(outputs.weight) < 1.0),
            ("a trim that expires", self._expired(run)),
            (self._workpiece(inputs), any(outputs.parts_um)),
        ):
            if told:
                self._told.add(name)

    def _expired(self, run: _Run) -> bool:
        trims = run.first.inputs.trims_um
        if repr(trims) != repr(self._trims) or run.first.inputs.init:
            self._trims, self._trimmed_calls = trims, 0
            self._accepted = any(trims) and not run.first.outputs.refused
        self._trimmed_calls += run.calls
        longest_s = self._settings.compensation.supervisor.longest_trim_s
        lasted_s = (self._trimmed_calls - 1) * self._settings.cycle_s
        return self._accepted and lasted_s > longest_s

    def _workpiece(self, inputs: PlcInputs) -> str:
        if self._diameters is None:
            return ""
        if not inputs.diameter_known:
            return "no diameter"
        lowest_mm, highest_mm = self._diameters
        if lowest_mm <= inputs.diameter_mm <= highest_mm:
            return "a diameter within the gains"
        return "a diameter outside the gains"

    def missing(self) -> tuple[str, ...]:
        """Return what may occur and does not."""
        return tuple(text for text, there in self._demanded() if not there)

    def _demanded(self) -> Iterator[tuple[str, bool]]:
        settings = self._settings
        compensation = settings.compensation
        parts = compensation.model.layout.parts
        for k, state in enumerate(SupervisorState):
            yield f"state {state}", k in self._states
        for k in range(len(Reason)):
            yield f"fault_word {2**k}", bool(self._faults & 2**k)
        ranged = any(part.lowest_k is not None for part in parts)
        absent = set(NEVER_OUTCOMES)
        absent |= set() if self._diameters else {Outcome.DIAMETER_HELD}
        absent |= set() if ranged else {Outcome.OUTSIDE_VALIDITY}
        for k, outcome in enumerate(Outcome):
            if outcome not in absent:
                yield f"outcome_word {2**k}", bool(self._outcomes & 2**k)
        freezes = any(rule.frozen_s > 0.0 for rule in compensation.rules)
        for k, quality in enumerate(SampleQuality):
            if quality not in NEVER_QUALITIES and (freezes or quality != SampleQuality.FROZEN):
                yield f"quality {k}", k in self._qualities
        for k, stem in enumerate(settings.names.outputs):
            for name, upper in (("upper", True), ("lower", False)):
                yield f"{name} limit of {stem}", (k, upper) in self._limits
        told = ["a restart", "a request that is refused", "another compensation"]
        told += (
            ["a trim that expires"] if any(b.largest_trim_um for b in compensation.bounds) else []
        )
        told += ["a weight below 1"] if ranged else []
        if self._diameters is not None:
            told += ["no diameter", "a diameter within the gains", "a diameter outside the gains"]
        for name in told:
            yield name, name in self._told
        if self._has_line:
            yield LINE_LIMITED, self._line_limited
        yield f"{LONG_ROW_CALLS} calls without a change", self._longest >= LONG_ROW_CALLS


# ---- rows ---------------------------------------------------------------------------------------


def _unit(variable: Variable) -> str:
    if variable.kind is not Kind.NUMBER:
        return variable.kind.value
    return variable.unit


def _row(settings: PlcSettings, run: _Run, variables: Iterable[Variable], *, first: int) -> str:
    names, last = settings.names, run.last
    values = last.line or by_variable(names, last.inputs) | by_variable(names, last.outputs)
    cells = [
        first,
        run.calls,
        last.judged,
        *(values[v.name] for v in variables),
    ]
    return ",".join([_text(cell, double=settings.double) for cell in cells])


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
