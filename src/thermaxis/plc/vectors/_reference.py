"""What the exported block must say: `cycle` itself, called as a PLC calls the block."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from functools import cache
from typing import Any, NamedTuple, TypeAlias, cast, final

from thermaxis.compensation import (
    LONGEST_STEP_CYCLES,
    Answer,
    Compensation,
    CycleOutput,
    CycleReading,
    Outcome,
    Provenance,
    Quality,
    Reason,
    Request,
    RequestKind,
    Sample,
    SampleQuality,
    SupervisorState,
    cycle,
    cycle_state,
)
from thermaxis.plc._block import LARGEST_READ, UNREAD_UM
from thermaxis.plc._line import LineSettings
from thermaxis.plc._names import PlcNames
from thermaxis.plc._numbers import rounded
from thermaxis.plc._settings import PlcSettings

Cell: TypeAlias = float | bool | int
"""A value of the block."""
_Floats = tuple[float, ...]
_RISING = "rising"
_CALLS = 32_768
_LARGEST_GAP_S = 1e9
_ENUMERATIONS = (SupervisorState, Reason, Outcome, SampleQuality, Quality)
_RATE_SHARE, _BAND_SHARE, _APART_UM = 2e-5, 2e-4, 0.02
# By member, not by its word: two enumerations may share one.
_PLACES = {id(member): k for one in _ENUMERATIONS for k, member in enumerate(one)}


class PlcInputs(NamedTuple):
    """Inputs of the block in one call, as `Interface` names them: those in the plural are tuples.

    Temperatures and their status by channel [degC], trims and what the control reports by output
    [µm]; the time since the last call [s] and the diameter [mm]. Numbers may be NaN or infinite.
    """

    cycle_time_s: float
    enable: bool
    hold: bool
    reset: bool
    diameter_mm: float
    diameter_known: bool
    temperatures_c: _Floats
    ok: tuple[bool, ...]
    trims_um: _Floats
    interlocks_met: bool
    connected: bool
    other_compensation: bool
    read_um: _Floats
    read_ok: bool
    init: bool = False


class PlcOutputs(NamedTuple):
    """Outputs of the block after one call, as `Interface` names them.

    By output what is written, what the model says, what is wanted before rate and supervisor, trim
    and distance [µm], weight [1] and limit; by part what it contributes [µm]; by channel its place
    in `SampleQuality`. State and words are places and bits of the enumerations. [1]
    """

    correction_um: _Floats
    model_um: _Floats
    wanted_um: _Floats
    weight: _Floats
    at_limit: tuple[bool, ...]
    added_um: _Floats
    to_go_um: _Floats
    parts_um: _Floats
    qualities: tuple[int, ...]
    state: int
    enabled: bool
    held: bool
    linked: bool
    settled: bool
    standing: bool
    fault_word: int
    model_quality: int
    outcome_word: int
    refused: bool
    heartbeat: int


_STEMS = {
    "temperatures_c": ("t", "channels"),
    "ok": ("ok", "channels"),
    "trims_um": ("trim", "outputs"),
    "read_um": ("read", "outputs"),
    "correction_um": ("correction", "outputs"),
    "model_um": ("model", "outputs"),
    "wanted_um": ("wanted", "outputs"),
    "weight": ("weight", "outputs"),
    "at_limit": ("limit", "outputs"),
    "added_um": ("added", "outputs"),
    "to_go_um": ("to_go", "outputs"),
    "parts_um": ("part", "parts"),
    "qualities": ("quality", "channels"),
}


@cache
def variable_names(names: PlcNames, fields: tuple[str, ...]) -> dict[str, tuple[str, ...] | str]:
    """Return the variables of the block, one or several, by the field that has their values."""
    several = {
        field: tuple([f"{prefix}_{stem}" for stem in getattr(names, stems)])
        for field, (prefix, stems) in _STEMS.items()
    }
    return {field: several.get(field, field) for field in fields}


def by_variable(names: PlcNames, values: PlcInputs | PlcOutputs) -> dict[str, Cell]:
    """Return inputs or outputs by the names of the block's variables."""
    made: dict[str, Cell] = {}
    for field, variable in variable_names(names, values._fields).items():
        value: Any = getattr(values, field)
        made.update(
            [(variable, value)] if isinstance(variable, str) else zip(variable, value, strict=True)
        )
    return made


@final
class CycleBlock:
    """`cycle` with inputs and outputs of the block: edges are requests, a wrong cycle time is none.

    One `step` is one call. In REAL the inputs are those that the target holds, and the outputs are
    computed in double precision: the block says the same states, and numbers within `TOLERANCE_UM`.

    Not protected: as `cycle`; and whether a PLC's compiler rounds every operation as IEEE 754
    says is what the comparison with these outputs shows.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.
    line : LineSettings, optional
        The line in the control: then the reported corrections are those that the control's line
        means, and a call returns what is in force there. Default: there is none.
    """

    def __init__(self, settings: PlcSettings, line: LineSettings | None = None) -> None:
        if not settings.double:
            settings = replace(settings, compensation=_in_real(settings.compensation))
        self.settings, self._line = settings, line
        self._outputs = settings.compensation.model.outputs
        self._values: dict[str, Cell] = {}
        self.cycle_output: CycleOutput | None = None
        """What `cycle` itself said in the last call."""
        self._switch_on()

    def _switch_on(self) -> None:
        count = len(self._outputs)
        self._state = cycle_state(self.settings.compensation)
        self._good_calls = self._calls = 0
        self._gaps_s = 0.0
        self._waiting, self._linked = True, False
        self._levels = (False, False, False)
        self._trims: _Floats = (0.0,) * count
        self._in_force = self._before = (0.0,) * count
        self._written = (0.0, 0.0)

    def step(self, inputs: PlcInputs) -> PlcOutputs:
        """Do what one call of the block does.

        Parameters
        ----------
        inputs : PlcInputs
            Inputs of the call.

        Returns
        -------
        PlcOutputs
            Outputs after the call.
        """
        if inputs.init:
            self._switch_on()
        if not self.settings.double:
            inputs = PlcInputs(*map(_in_real, inputs))
        return self._call(inputs) if self._line is None else self._line_call(self._line, inputs)

    def values(self) -> Mapping[str, Cell]:
        """Return every input and output of the last call with a line by its name."""
        return self._values

    def _line_call(self, line: LineSettings, inputs: PlcInputs) -> PlcOutputs:
        told = _line_inputs(line, inputs.read_um)
        away_um = _away_um(line, tuple(told.values()), self._written)
        read_um = tuple(c + d for c, d in zip(self._in_force, away_um, strict=True))
        inputs = inputs._replace(read_um=read_um)
        outputs = self._call(inputs)
        totals_um = tuple(b.total_um for b in self.settings.compensation.bounds)
        outside = any(abs(c) > most for c, most in zip(self._before, totals_um, strict=True))
        said = _laid(line, outputs.correction_um, totals_um, free=outside)
        names = self.settings.names
        self._values = by_variable(names, inputs) | by_variable(names, outputs) | told | said
        self._in_force = outputs.correction_um
        self._written = k0_mm, slope = said["k0_mm"], said["slope"]
        there_um = [line.um_per_mm * (k0_mm + slope * way) for way in _ways_mm(line)]
        return outputs._replace(correction_um=tuple(there_um))

    def _call(self, inputs: PlcInputs) -> PlcOutputs:
        settings, compensation = self.settings, self.settings.compensation
        ends_s = (settings.shortest_cycle_s, settings.longest_cycle_s)
        shortest_s, longest_s = (rounded(s, double=settings.double) for s in ends_s)
        gap = self._good_calls > 0 and inputs.cycle_time_s > compensation.model.longest_gap_s
        in_time = shortest_s <= inputs.cycle_time_s <= longest_s
        if gap:
            self._gaps_s += min(inputs.cycle_time_s, _LARGEST_GAP_S)
            # After a gap the block moves by no more than in any other call.
            share = 1.0 / LONGEST_STEP_CYCLES
            compensation = _with_limits(compensation, "largest_rate_um_per_s", share)
        self._good_calls += in_time
        time_s = settings.cycle_s * self._good_calls + self._gaps_s
        read = tuple(u if inputs.read_ok else None for u in inputs.read_um)
        if self._calls == 0:
            self._levels = inputs.reset, inputs.enable, inputs.hold
        off = self._state.memory.state is SupervisorState.OFF
        there = inputs.connected and inputs.read_ok
        there = there and all(abs(u) <= LARGEST_READ for u in inputs.read_um)
        self._waiting = self._waiting or off or gap or not inputs.connected
        found, self._waiting = self._waiting and there, self._waiting and not there
        self._linked = inputs.connected and not self._waiting
        samples = zip(inputs.temperatures_c, inputs.ok, strict=True)
        reading = CycleReading(
            time_s if in_time or gap else math.nan,
            tuple(Sample(value, good, 0.0) for value, good in samples),
            interlocks=(inputs.interlocks_met,),
            connected=self._linked,
            read_back_um=read,
            found_um=read if found else None,
            other_compensation=inputs.other_compensation,
            requests=tuple(self._requests(inputs)),
        )
        self._calls += 1
        self._state, output = cycle(compensation, self._state, reading)
        self._before, self.cycle_output = output.before_um, output
        return self._as_block(output)

    def _requests(self, inputs: PlcInputs) -> Iterator[Request]:
        reset, enable, hold = self._levels
        if inputs.reset and not reset:
            yield Request(RequestKind.ACKNOWLEDGE, "plc")
        if inputs.enable != enable:
            yield Request(RequestKind.ENABLE if inputs.enable else RequestKind.DISABLE, "plc")
        if inputs.hold or hold:  # asked for in every call: the cycle itself knows what is held
            kind = RequestKind.HOLD if inputs.hold else RequestKind.RESUME
            yield Request(kind, "plc", text=_RISING if not hold else "")
        diameter_mm = inputs.diameter_mm if inputs.diameter_known else None
        yield Request(RequestKind.DIAMETER, "plc", value=diameter_mm)
        longest_s = self.settings.compensation.supervisor.longest_trim_s
        for output, before, trim in zip(self._outputs, self._trims, inputs.trims_um, strict=True):
            if self._calls and not trim == before:  # noqa: SIM201 - NaN differs from itself
                yield Request(RequestKind.TRIM, "plc", output.name, trim, longest_s)
        self._levels = inputs.reset, inputs.enable, inputs.hold
        self._trims = inputs.trims_um

    def _as_block(self, output: CycleOutput) -> PlcOutputs:
        memory = self._state.memory
        return PlcOutputs(
            output.correction_um,
            output.model_um,
            output.wanted_um,
            output.weight,
            output.at_limit,
            output.trim_um,
            output.to_go_um,
            tuple(part for parts in output.contribution_um for part in parts),
            tuple(_PLACES[id(quality)] for quality in output.qualities),
            _PLACES[id(output.state)],
            memory.enabled,
            memory.held,
            self._linked,
            output.settled,
            self._standing(output),
            sum(2 ** _PLACES[id(reason)] for reason in output.reasons),
            _PLACES[id(output.quality)],
            sum(2 ** _PLACES[id(outcome)] for outcome in output.outcomes),
            any(map(_refused, output.answers)),
            self._calls % _CALLS,
        )

    def _standing(self, output: CycleOutput) -> bool:
        tolerance_um = self.settings.compensation.supervisor.read_back_tolerance_um
        off = output.state is SupervisorState.OFF
        return off and any(abs(c) > tolerance_um for c in output.correction_um)


def _refused(answer: Answer) -> bool:
    """Return whether the block says that this was refused: of hold only the rising edge."""
    level = answer.request.kind is RequestKind.HOLD and answer.request.text != _RISING
    return not (answer.accepted or level)


def words_of(outputs: PlcOutputs) -> PlcOutputs:
    """Return outputs without the numbers that may change from call to call."""
    return outputs._replace(
        correction_um=(),
        model_um=(),
        wanted_um=(),
        weight=(),
        to_go_um=(),
        parts_um=(),
        heartbeat=0,
    )


@final
class JudgedBlock:
    """`cycle` as a block that says whether rounding in REAL may move a change of state.

    A correction that goes to zero in equal steps arrives a call earlier or later by rounding
    alone, and with it a state changes; a goal at the edge of the deadband is taken or not. Where
    blocks whose rates and deadbands differ by a few roundings say the same, so does the target.
    """

    def __init__(self, settings: PlcSettings, line: LineSettings | None = None) -> None:
        self._block, self._others = CycleBlock(settings, line), list[CycleBlock]()
        self.judged = True
        """Whether the target must say what was said last."""
        compensation = settings.compensation
        shares = {"largest_rate_um_per_s": _RATE_SHARE, "deadband_um": _BAND_SHARE}
        for key, share in shares.items() if not settings.double else ():
            if any(getattr(bounds, key) for bounds in compensation.bounds):
                for times in (1.0 - share, 1.0 + share):
                    near = replace(settings, compensation=_with_limits(compensation, key, times))
                    self._others.append(CycleBlock(near, line))

    def step(self, inputs: PlcInputs) -> PlcOutputs:
        """Do what one call of the block does."""
        outputs = self._block.step(inputs)
        near = [_near(other.step(inputs), outputs) for other in self._others]
        self.judged = all(near)
        return outputs

    def values(self) -> Mapping[str, Cell]:
        """Return every input and output of the last call with a line by its name."""
        return self._block.values()


def _with_limits(compensation: Compensation, key: str, times: float) -> Compensation:
    limits = {
        name: replace(one, **{key: times * getattr(one, key)})
        for name, one in compensation.limits.items()
    }
    return replace(compensation, limits=limits)


def _near(one: PlcOutputs, other: PlcOutputs) -> bool:
    """Whether two blocks say the same words, and corrections that rounding may make different."""
    pairs = zip(one.correction_um, other.correction_um, strict=True)
    return words_of(one) == words_of(other) and all(abs(a - b) <= _APART_UM for a, b in pairs)


def _in_real(part: Any) -> Any:
    """Return a part of a compensation, or an input, with the numbers that REAL holds."""
    if isinstance(part, float):
        return rounded(part, double=False)
    if isinstance(part, tuple):
        return tuple(map(_in_real, cast("tuple[object, ...]", part)))
    if isinstance(part, Mapping):
        return {k: _in_real(v) for k, v in cast("Mapping[str, object]", part).items()}
    if is_dataclass(part) and not isinstance(part, type | Provenance):
        values = {
            entry.name: _in_real(getattr(part, entry.name)) for entry in fields(part) if entry.init
        }
        return replace(part, **values)
    return part


# ---- the line in the control --------------------------------------------------------------------


def _line_inputs(line: LineSettings, read_um: _Floats) -> dict[str, float]:
    """Return the line by which the control reports corrections at the positions."""
    k0_mm = slope = 0.0
    for to_k0, to_slope, read in zip(*line.weights(), read_um, strict=True):
        k0_mm += to_k0 * read
        slope += to_slope * read
    return {"read_k0_mm": k0_mm, "read_slope": slope, "read_reference_mm": line.origin_mm}


def _ways_mm(line: LineSettings) -> list[float]:
    return [position_mm - line.origin_mm for position_mm in line.positions_mm]


def _away_um(line: LineSettings, read: _Floats, written: tuple[float, float]) -> _Floats:
    """Return how far the control's line is from the one that was written, by position. [µm]"""
    if not all(abs(value) <= LARGEST_READ for value in read):
        return (UNREAD_UM,) * len(line.positions_mm)
    k0_mm, slope, reference_mm = read
    return tuple(
        ((k0_mm + slope * (p - reference_mm)) - (written[0] + written[1] * way)) * line.um_per_mm
        for p, way in zip(line.positions_mm, _ways_mm(line), strict=True)
    )


def _laid(
    line: LineSettings, correction_um: _Floats, totals_um: _Floats, *, free: bool
) -> dict[str, float]:
    """Return the outputs of the line through the corrections."""
    k0_mm = slope = 0.0
    for to_k0, to_slope, c in zip(*line.weights(), correction_um, strict=True):
        k0_mm += to_k0 * c
        slope += to_slope * c
    laid = (k0_mm, slope)
    if not free:
        bounds = line.bounds(totals_um)
        k0_mm, slope = (min(max(v, -b), b) for v, b in zip(laid, bounds, strict=True))
    pairs = zip(correction_um, _ways_mm(line), strict=True)
    return {
        "k0_mm": k0_mm,
        "slope": slope,
        "reference_mm": line.origin_mm,
        "residual_um": max(abs(c - (k0_mm + slope * way) * line.um_per_mm) for c, way in pairs),
        "line_limited": (k0_mm, slope) != laid,
    }
