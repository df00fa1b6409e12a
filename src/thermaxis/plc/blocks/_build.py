"""The compensation as a program for a PLC: what `thermaxis.compensation.cycle` does, as a tree."""

from dataclasses import asdict
from itertools import pairwise

from thermaxis.compensation import (
    LARGEST_DIAMETER_MM,
    LARGEST_RULE,
    Part,
    Quality,
    SupervisorState,
)
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.blocks._head import head_of
from thermaxis.plc.blocks._library import library_block, number_of, numbered
from thermaxis.plc.blocks._model import channel_values, model_values, output_values, part_values
from thermaxis.plc.tree import Block, Program

LARGEST_NUMBER = {True: 1.7976931348623157e308, False: 3.4028234663852886e38}
"""Largest finite number, by whether numbers are LREAL."""
LARGEST_READ_UM = LARGEST_RULE
"""A larger magnitude that is read back is no offset. [um]"""
IDENTITY_DIGITS = 3
"""Hexadecimal digits of the model's hash in one number that every control holds. [1]"""


def build_program(settings: PlcSettings) -> Program:
    """Return the program of a compensation.

    One call is one cycle of `thermaxis.compensation.cycle`, in the same order and, with LREAL, in
    the same operations. Times are counted from call to call: with LREAL and cycles that a binary
    number cannot hold, such as 0.1 s, a time limit may be met a cycle earlier or later than there.
    With REAL such cycles are refused, and times are counted exactly.

    In every call in Off the offset that stands in the control is read and taken over, as it is
    after a loss of the connection; in every call before that was done it is `cycle` without a
    connection. Levels that stand in the first call ask for nothing.

    Not protected: the block knows neither whether its inputs are wired to the sensors that the
    model means, nor whether the sign is right on this machine, nor whether the control adds what
    it is given. It keeps nothing over a loss of power: it starts at steady state. Its supervisor
    believes its signals: an interlock that is wired to nothing is met or not met for ever. A
    correction that lies outside the total comes back at the rate, no faster. Of a sensor a slow
    drift is not seen.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.

    Returns
    -------
    Program
        The program: the same settings give the same one.

    Raises
    ------
    ConfigurationError
        If a number is none that the target's numbers hold.
    """
    double = settings.double
    model = settings.compensation.model
    layout = model.layout
    has_lags = bool(layout.taus_s) or model.input_filter_s > 0.0
    lengths = {settings.delay_cycles(layout.parts[k]) for k in layout.delayed} - {0}
    blocks = (
        *((library_block("lag", double=double),) if has_lags else ()),
        library_block("sensor", double=double, largest_number=LARGEST_NUMBER[double]),
        *(
            library_block("delay", double=double, name=f"tx_delay_{cycles}", cycles=cycles)
            for cycles in sorted(lengths)
        ),
        *(
            _gain_block(f"tx_gain_{n}", layout.parts[k], double=double)
            for n, k in enumerate(layout.gained, 1)
        ),
        library_block("model", double=double, **model_values(settings)),
        library_block("trim", double=double),
        library_block("requests", double=double),
        library_block("read_back", double=double, largest_read_um=LARGEST_READ_UM),
        library_block("wanted", double=double),
        _supervisor_block(settings),
        library_block("limit", double=double),
        _main_block(settings),
    )
    return Program(name=settings.names.block, double=double, head=head_of(settings), blocks=blocks)


def _gain_block(name: str, part: Part, *, double: bool) -> Block:
    points = part.gain_by_diameter
    spans = [
        {"k": k, "next": k + 1, "width_mm": b.diameter_mm - a.diameter_mm, "rise": b.gain - a.gain}
        for k, (a, b) in enumerate(pairwise(points), 1)
    ]
    return library_block(
        "gain",
        double=double,
        name=name,
        tool_gain=part.tool_gain,
        point=[{"k": k, **asdict(point)} for k, point in enumerate(points, 1)],
        span=spans,
        several=bool(spans),
        last=len(points),
    )


def _supervisor_block(settings: PlcSettings) -> Block:
    rules, cycle_s = settings.compensation.supervisor, settings.cycle_s
    return library_block(
        "supervisor",
        double=settings.double,
        states=numbered(SupervisorState, ", "),
        cycle_s=cycle_s,
        bridged_and_held_s=rules.input_timeout_s + rules.hold_input_s,
        first_differs_s=min(cycle_s, rules.read_back_s),
        first_at_limit_s=min(cycle_s, rules.at_limit_s),
        **asdict(rules),
    )


def _main_block(settings: PlcSettings) -> Block:
    rules = settings.compensation.supervisor
    return library_block(
        "main",
        double=settings.double,
        name=settings.names.block,
        channel=channel_values(settings),
        output=output_values(settings),
        part=part_values(settings),
        states=numbered(SupervisorState),
        bad=number_of(Quality.BAD),
        qualities=numbered(Quality),
        identity=_identity(settings.model_sha256),
        cycle_s=settings.cycle_s,
        shortest_cycle_s=settings.shortest_cycle_s,
        longest_cycle_s=settings.longest_cycle_s,
        largest_read_um=LARGEST_READ_UM,
        read_back_tolerance_um=rules.read_back_tolerance_um,
        largest_mm=LARGEST_DIAMETER_MM,
        longest_trim_s=rules.longest_trim_s,
    )


def _identity(digits: str) -> list[dict[str, int]]:
    """Return the first digits of the model's hash, as numbers that every control holds."""
    n = IDENTITY_DIGITS
    return [
        {"n": k + 1, "value": int(digits[k * n : (k + 1) * n], 16),
         "first": k * n + 1, "last": (k + 1) * n}
        for k in range(2 if digits else 0)
    ]  # fmt: skip
