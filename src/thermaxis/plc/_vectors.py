"""Test vectors: inputs of the block and what it must say, as a table for a spreadsheet or a PLC.

A row is one call, or several in which the inputs are the same and state, words and qualities do
not change; the outputs are those after the last. Numbers
are written with as many digits as give back the same number of the target: 17 for LREAL, 9 for
REAL. A spreadsheet that keeps 15 digits shows them, but is no way to hand LREAL on.
"""

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from thermaxis.errors import ConfigurationError
from thermaxis.plc._scenario import PlcStep, course_steps
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc._twin import PlcInputs, PlcOutputs
from thermaxis.plc._twin_numbers import rounding

MOST_ROWS = 2000
"""Most rows of a table. Default: what a person still looks through. [1]"""
DEFAULT_SEED = 1
"""Seed of the noise in the vectors. [1]"""
_LARGEST_ROWS = 1_000_000
_DIGITS = {True: 17, False: 9}


class _Column(NamedTuple):
    name: str
    unit: str


def vectors_csv(
    settings: PlcSettings, steps: Iterable[PlcStep] | None = None, *, most_rows: int = MOST_ROWS
) -> str:
    """Return the test vectors as comma-separated text.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.
    steps : iterable of PlcStep, optional
        Calls, as `scenario_steps` makes them. Default: the fixed course, which leads through
        every state and every refusal that the model can reach.
    most_rows : int
        Rows after which the table ends. Default: `MOST_ROWS`. [1]

    Returns
    -------
    str
        Lines with ``#`` that say what it is; names of the columns, their units, one row per call
        or run of equal calls. The same settings give the same bytes.

    Raises
    ------
    ConfigurationError
        If `most_rows` is not from 1 to a million.
    """
    if not 1 <= most_rows <= _LARGEST_ROWS:
        raise ConfigurationError(f"not from 1 to {_LARGEST_ROWS}", where="most_rows")
    columns = _columns(settings)
    rows: list[str] = []
    whole = True
    calls = 0
    made = course_steps(settings, seed=DEFAULT_SEED) if steps is None else steps
    for row in _runs(made):
        if len(rows) == most_rows:
            whole = False
            break
        rows.append(_row(settings, row, first=calls + 1))
        calls += row.calls
    lines = [
        *(f"# {line}" for line in _head(settings, calls=calls, whole=whole)),
        ",".join(column.name for column in columns),
        "# unit," + ",".join(column.unit for column in columns[1:]),
        *rows,
    ]
    return "\n".join([*lines, ""])


# ---- rows ---------------------------------------------------------------------------------------


class _Run(NamedTuple):
    """Calls with the same inputs."""

    inputs: PlcInputs
    calls: int
    outputs: PlcOutputs


def _runs(steps: Iterable[PlcStep]) -> Iterator[_Run]:
    run: _Run | None = None
    for inputs, outputs in steps:
        if (
            run is not None
            and not inputs.restart
            and _same(run.inputs, inputs)
            and _words(run.outputs) == _words(outputs)
        ):
            run = _Run(run.inputs, run.calls + 1, outputs)
            continue
        if run is not None:
            yield run
        run = _Run(inputs, 1, outputs)
    if run is not None:
        yield run


def _same(one: PlcInputs, other: PlcInputs) -> bool:
    """Return whether inputs are the same in every bit; a restart is of the first call only."""
    return repr(one._replace(restart=False)) == repr(other)


def _words(outputs: PlcOutputs) -> PlcOutputs:
    """Return the outputs without the numbers that may change from call to call."""
    return outputs._replace(
        correction_um=(), model_um=(), wanted_um=(), weight=(), parts_um=(), heartbeat=0
    )


def _columns(settings: PlcSettings) -> list[_Column]:
    names = settings.names
    columns = [
        _Column("call", "1"),
        _Column("calls", "1"),
        _Column("restart", "BOOL"),
        _Column("cycle_time_s", "s"),
        _Column("enable", "BOOL"),
        _Column("hold", "BOOL"),
        _Column("reset", "BOOL"),
        _Column("diameter_mm", "mm"),
        _Column("diameter_known", "BOOL"),
    ]
    for channel in names.channels:
        columns += [_Column(f"t_{channel}", "degC"), _Column(f"ok_{channel}", "BOOL")]
    columns += [_Column(f"trim_{output}", "um") for output in names.outputs]
    columns += [
        _Column("interlocks_met", "BOOL"),
        _Column("connected", "BOOL"),
        _Column("other_compensation", "BOOL"),
    ]
    columns += [_Column(f"read_{output}", "um") for output in names.outputs]
    columns += [_Column("read_ok", "BOOL")]
    for output in names.outputs:
        columns += [
            _Column(f"{what}_{output}", unit)
            for what, unit in (
                ("correction", "um"),
                ("model", "um"),
                ("wanted", "um"),
                ("weight", "1"),
                ("limit", "BOOL"),
            )
        ]
    columns += [_Column(f"part_{part}", "um") for part in names.parts]
    columns += [_Column(f"quality_{channel}", "INT") for channel in names.channels]
    columns += [_Column("state", "INT"), _Column("enabled", "BOOL"), _Column("linked", "BOOL")]
    numbers = ("fault_word", "model_quality", "outcome_word")
    columns += [_Column(name, "INT") for name in numbers]
    return [*columns, _Column("refused", "BOOL"), _Column("heartbeat", "INT")]


def _row(settings: PlcSettings, run: _Run, *, first: int) -> str:
    inputs, outputs = run.inputs, run.outputs
    cells: list[float | bool] = [
        inputs.restart,
        inputs.cycle_time_s,
        inputs.enable,
        inputs.hold,
        inputs.reset,
        inputs.diameter_mm,
        inputs.diameter_known,
    ]
    for value, ok in zip(inputs.temperatures_c, inputs.ok, strict=True):
        cells += [value, ok]
    cells += inputs.trims_um
    cells += [inputs.interlocks_met, inputs.connected, inputs.other_compensation]
    cells += [*inputs.read_um, inputs.read_ok]
    for of_output in zip(
        outputs.correction_um,
        outputs.model_um,
        outputs.wanted_um,
        outputs.weight,
        outputs.at_limit,
        strict=True,
    ):
        cells += of_output
    cells += outputs.parts_um
    words = (
        *outputs.qualities,
        outputs.state,
        int(outputs.enabled),
        int(outputs.linked),
        outputs.fault_word,
        outputs.model_quality,
        outputs.outcome_word,
        int(outputs.refused),
        outputs.heartbeat,
    )
    texts = [str(first), str(run.calls)]
    texts += [_text(cell, double=settings.double) for cell in cells]
    return ",".join([*texts, *map(str, words)])


def _text(value: float | bool, *, double: bool) -> str:  # noqa: FBT001 - a cell
    if isinstance(value, bool):
        return str(int(value))
    held = rounding(double=double)(value)
    if math.isnan(held):
        return "NaN"
    if math.isinf(held):
        return "+Inf" if held > 0.0 else "-Inf"
    text = f"{held + 0.0:.{_DIGITS[double]}g}".upper()
    return text if "." in text or "E" in text else f"{text}.0"


def _head(settings: PlcSettings, *, calls: int, whole: bool) -> list[str]:
    digits = _DIGITS[settings.double]
    kind = "LREAL binary64" if settings.double else "REAL binary32"
    cut = "" if whole else " - cut: the course goes on behind the last row"
    return [
        f"test vectors of the block {settings.names.block}",
        f"model sha256: {settings.model_sha256 or 'not stated'}",
        f"cycle: {settings.cycle_s:g} s",
        f"numbers: {kind} - {digits} digits give back the same number",
        f"calls: {calls}{cut}",
        "call: number of the first call of the row",
        "calls: how often the block is called with these inputs - the outputs are after the last",
        "restart 1: a new instance of the block begins with the first call of the row",
        "BOOL is 0 or 1 - NaN and +Inf and -Inf are such numbers",
        "a PLC that cannot make them in an input leaves out the rows up to the next restart",
        "the outputs are of the rules written a second time - in the arithmetic of the PLC",
        "compare with equality - a zero has no sign",
    ]
