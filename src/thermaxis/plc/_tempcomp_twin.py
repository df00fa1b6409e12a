"""The block with a line in plain Python, and its test vectors."""

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple, TypeAlias, final

from thermaxis.plc._scenario import PlcStep, course_steps
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc._tempcomp import LARGEST_READ, UNREAD_UM, LineSettings
from thermaxis.plc._twin import PlcInputs, PlcOutputs, Twin
from thermaxis.plc._twin_numbers import rounding

MOST_ROWS = 2000
"""Most rows of a table of vectors, as without a line. [1]"""
_LARGEST_UM = 1e6
_SEED = 1
_DIGITS = {True: 17, False: 9}


@final
class LineInputs(NamedTuple):
    """Inputs of the block with a line in one call."""

    plain: PlcInputs
    """Inputs of the block without a line; its reported corrections are not used."""
    read_k0_mm: float
    """K0 that the control reports. [mm]"""
    read_slope: float
    """Slope that it reports, in mm/mm. [1]"""
    read_reference_mm: float
    """Reference position that it reports. [mm]"""


@final
class LineOutputs(NamedTuple):
    """Outputs of the block with a line after one call."""

    plain: PlcOutputs
    """Outputs of the block without a line."""
    k0_mm: float
    """K0. [mm]"""
    slope: float
    """Slope, in mm/mm. [1]"""
    reference_mm: float
    """Reference position. [mm]"""
    residual_um: float
    """Largest distance of a correction from the line. [µm]"""
    limited: bool
    """Whether a bound of the line acts."""


@final
class LineTwin:
    """The block with a line, in the target's numbers: one `step` is one call.

    Not protected: as `Twin`.

    Parameters
    ----------
    settings : PlcSettings
        What is exported; an output for every position.
    line : LineSettings
        Positions and direction.
    """

    def __init__(self, settings: PlcSettings, line: LineSettings) -> None:
        r = self._r = rounding(double=settings.double)
        self._twin = Twin(settings)
        self._totals_um = [r(bounds.total_um) for bounds in settings.compensation.bounds]
        self._origin_mm = r(line.origin_mm)
        self._positions_mm = [r(p) for p in line.positions_mm]
        self._ways_mm = [r(p - self._origin_mm) for p in self._positions_mm]
        self._factor = line.um_per_mm
        k0, slope = line.weights()
        self._k0, self._slope = [r(w) for w in k0], [r(w) for w in slope]
        exact = line.bounds(tuple(b.total_um for b in settings.compensation.bounds))
        self._largest_k0_mm, self._largest_slope = (r(bound) for bound in exact)
        self._switch_on()

    def _switch_on(self) -> None:
        self._corrections_um = [0.0] * len(self._positions_mm)
        self._written = 0.0, 0.0

    def reported_um(self, inputs: LineInputs) -> tuple[float, ...]:
        """Return what the control's line means as corrections at the positions.

        Parameters
        ----------
        inputs : LineInputs
            Inputs of the call.

        Returns
        -------
        tuple of float
            The corrections. [µm]
        """
        r = self._r
        k0_mm, slope, origin_mm = (r(read) for read in inputs[1:])
        if not all(abs(read) <= LARGEST_READ for read in (k0_mm, slope, origin_mm)):
            return tuple([r(c + UNREAD_UM) for c in self._corrections_um])
        said: list[float] = []
        for position_mm, way_mm, c in zip(
            self._positions_mm, self._ways_mm, self._corrections_um, strict=True
        ):
            own_mm = r(self._written[0] + r(self._written[1] * way_mm))
            there_mm = r(k0_mm + r(slope * r(position_mm - origin_mm)))
            said.append(r(c + r(r(there_mm - own_mm) * self._factor)))
        return tuple(said)

    def step(self, inputs: LineInputs) -> LineOutputs:
        """Do what one call of the block does.

        Parameters
        ----------
        inputs : LineInputs
            Inputs of the call.

        Returns
        -------
        LineOutputs
            Outputs after the call.
        """
        if inputs.plain.restart:
            self._switch_on()
        reported_um = self.reported_um(inputs)
        told = inputs.plain._replace(read_um=reported_um)
        if self._twin.takes_over(told):
            found = zip(self._corrections_um, reported_um, strict=True)
            self._corrections_um = [u if abs(u) <= _LARGEST_UM else c for c, u in found]
        pairs = zip(self._corrections_um, self._totals_um, strict=True)
        outside = any(not -total <= c <= total for c, total in pairs)
        plain = self._twin.step(told)
        self._corrections_um = list(plain.correction_um)
        k0_mm, slope = self._sum(self._k0), self._sum(self._slope)
        limited = False
        if not outside:
            k0_mm, cut_k0 = _within(k0_mm, self._largest_k0_mm)
            slope, cut_slope = _within(slope, self._largest_slope)
            limited = cut_k0 or cut_slope
        self._written = k0_mm, slope
        residual_um = max(self._away_um(k) for k in range(len(self._positions_mm)))
        return LineOutputs(plain, k0_mm, slope, self._origin_mm, residual_um, limited)

    def _sum(self, weights: list[float]) -> float:
        total = 0.0
        for weight, c in zip(weights, self._corrections_um, strict=True):
            total = self._r(total + self._r(weight * c))
        return total

    def _away_um(self, k: int) -> float:
        r = self._r
        k0_mm, slope = self._written
        line_um = r(r(k0_mm + r(slope * self._ways_mm[k])) * self._factor)
        return abs(r(self._corrections_um[k] - line_um))


def _within(value: float, bound: float) -> tuple[float, bool]:
    if value > bound:
        return bound, True
    return (-bound, True) if value < -bound else (value, False)


class LineStep(NamedTuple):
    """One call: what goes in, and what must come out."""

    inputs: LineInputs
    """Inputs of the block."""
    outputs: LineOutputs
    """Outputs after the call."""


def line_steps(
    settings: PlcSettings, line: LineSettings, steps: Iterable[PlcStep]
) -> Iterator[LineStep]:
    """Return a scenario with a line in the control, call by call.

    What the machine reports away from the corrections is reported by the control as a line: the
    one that was written, and the straight line through the differences.

    Parameters
    ----------
    settings : PlcSettings
        What is exported; an output for every position.
    line : LineSettings
        Positions and direction.
    steps : iterable of PlcStep
        The scenario without a line.

    Yields
    ------
    LineStep
        One call.
    """
    twin = LineTwin(settings, line)
    k0_weights, slope_weights = line.weights()
    nothing = (0.0,) * len(line.positions_mm)
    before, written = nothing, (0.0, 0.0)
    for step in steps:
        if step.inputs.restart:
            before, written = nothing, (0.0, 0.0)
        apart = [u - c for u, c in zip(step.inputs.read_um, before, strict=True)]
        inputs = LineInputs(
            step.inputs,
            written[0] + _product(k0_weights, apart),
            written[1] + _product(slope_weights, apart),
            line.origin_mm,
        )
        outputs = twin.step(inputs)
        before, written = step.outputs.correction_um, (outputs.k0_mm, outputs.slope)
        yield LineStep(inputs, outputs)


def _product(weights: tuple[float, ...], values: list[float]) -> float:
    total = 0.0
    for weight, value in zip(weights, values, strict=True):
        total += weight * value
    return total


# ---- test vectors -------------------------------------------------------------------------------

_Cell: TypeAlias = float | bool | int


def line_vectors_csv(
    settings: PlcSettings, line: LineSettings, *, most_rows: int = MOST_ROWS
) -> str:
    """Return the test vectors of a block with a line, in the form of those without one.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.
    line : LineSettings
        Positions and direction.
    most_rows : int
        Calls after which the table ends. Default: `MOST_ROWS`. [1]

    Returns
    -------
    str
        Lines with ``#`` that say what it is; names of the columns, their units, one row per call.
        The same settings give the same bytes.
    """
    columns = _columns(settings)
    rows: list[str] = []
    course = line_steps(settings, line, course_steps(settings, seed=_SEED))
    for call, step in zip(range(1, most_rows + 1), course, strict=False):
        cells = (call, 1, *_input_cells(step.inputs), *_output_cells(step.outputs))
        rows.append(",".join(_text(cell, double=settings.double) for cell in cells))
    head = (
        f"test vectors of the block {settings.names.block} with a straight line",
        f"model sha256: {settings.model_sha256 or 'not stated'}",
        f"cycle: {settings.cycle_s:g} s",
        (
            f"numbers: {'LREAL binary64' if settings.double else 'REAL binary32'} -"
            f" {_DIGITS[settings.double]} digits give back the same number"
        ),
        f"calls: {len(rows)}",
        "restart 1: a new instance of the block begins with this row",
        (
            "BOOL is 0 or 1 - NaN and +Inf and -Inf are such numbers - a PLC that cannot make them"
            " leaves the rows out up to the next restart"
        ),
        (
            "the outputs are of the rules written a second time in the arithmetic of the PLC -"
            " compare with equality - a zero has no sign"
        ),
    )
    lines = [
        *(f"# {text}" for text in head),
        ",".join(name for name, _ in columns),
        "# unit," + ",".join(unit for _, unit in columns[1:]),
        *rows,
    ]
    return "\n".join([*lines, ""])


def _columns(settings: PlcSettings) -> list[tuple[str, str]]:
    names = settings.names
    columns = [
        *(("call", "1"), ("calls", "1"), ("restart", "BOOL"), ("cycle_time_s", "s")),
        *(("enable", "BOOL"), ("hold", "BOOL"), ("reset", "BOOL")),
        *(("diameter_mm", "mm"), ("diameter_known", "BOOL")),
    ]
    for channel in names.channels:
        columns += [(f"t_{channel}", "degC"), (f"ok_{channel}", "BOOL")]
    columns += [(f"trim_{output}", "um") for output in names.outputs]
    columns += [
        *(("interlocks_met", "BOOL"), ("connected", "BOOL"), ("other_compensation", "BOOL")),
        *(("read_k0_mm", "mm"), ("read_slope", "mm/mm"), ("read_reference_mm", "mm")),
        ("read_ok", "BOOL"),
        *(("k0_mm", "mm"), ("slope", "mm/mm"), ("reference_mm", "mm"), ("residual_um", "um")),
        ("line_limited", "BOOL"),
    ]
    for output in names.outputs:
        columns += [(f"correction_{output}", "um"), (f"model_{output}", "um")]
        columns += [(f"wanted_{output}", "um"), (f"weight_{output}", "1")]
        columns.append((f"limit_{output}", "BOOL"))
    columns += [(f"part_{part}", "um") for part in names.parts]
    columns += [(f"quality_{channel}", "INT") for channel in names.channels]
    columns += [("state", "INT"), ("enabled", "BOOL"), ("linked", "BOOL")]
    words = ("fault_word", "model_quality", "outcome_word")
    columns += [(word, "INT") for word in words]
    return [*columns, ("refused", "BOOL"), ("heartbeat", "INT")]


def _input_cells(inputs: LineInputs) -> Iterator[_Cell]:
    plain = inputs.plain
    yield from (plain.restart, plain.cycle_time_s, plain.enable, plain.hold, plain.reset)
    yield from (plain.diameter_mm, plain.diameter_known)
    for temperature_c, ok in zip(plain.temperatures_c, plain.ok, strict=True):
        yield from (temperature_c, ok)
    yield from plain.trims_um
    yield from (plain.interlocks_met, plain.connected, plain.other_compensation)
    yield from (*inputs[1:], plain.read_ok)


def _output_cells(outputs: LineOutputs) -> Iterator[_Cell]:
    plain = outputs.plain
    yield from outputs[1:]
    for of_output in zip(
        plain.correction_um,
        plain.model_um,
        plain.wanted_um,
        plain.weight,
        plain.at_limit,
        strict=True,
    ):
        yield from of_output
    yield from (*plain.parts_um, *plain.qualities, plain.state, plain.enabled, plain.linked)
    yield plain.fault_word
    yield from (plain.model_quality, plain.outcome_word, plain.refused, plain.heartbeat)


def _text(cell: _Cell, *, double: bool) -> str:
    if isinstance(cell, int):
        return str(int(cell))
    held = rounding(double=double)(cell)
    if math.isnan(held):
        return "NaN"
    if math.isinf(held):
        return "+Inf" if held > 0.0 else "-Inf"
    text = f"{held + 0.0:.{_DIGITS[double]}g}".upper()
    return text if "." in text or "E" in text else f"{text}.0"
