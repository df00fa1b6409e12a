"""What the exported block must say: `cycle` itself, called as a PLC calls the block."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from itertools import count as count_from
from operator import itemgetter
from typing import Any, NamedTuple, cast, final

from thermaxis.compensation import (
    LONGEST_STEP_CYCLES,
    Answer,
    Compensation,
    CycleOutput,
    CycleReading,
    Limits,
    Outcome,
    Provenance,
    Quality,
    Reading,
    Reason,
    Request,
    RequestKind,
    Sample,
    SampleQuality,
    SupervisorState,
    Touch,
    TouchOutcome,
    cycle,
    cycle_state,
    limit_step,
    model_step,
    shifted,
)
from thermaxis.plc._block import LARGEST_READ, UNREAD_UM
from thermaxis.plc._interface import Kind, interface_of
from thermaxis.plc._line import LineSettings
from thermaxis.plc._numbers import rounded
from thermaxis.plc._settings import PlcSettings

_Floats = tuple[float, ...]
_BY_OUTPUT = {
    "correction": "correction_um",
    "model": "model_um",
    "wanted": "wanted_um",
    "weight": "weight",
    "limit": "at_limit",
    "added": "trim_um",
    "to_go": "to_go_um",
}
"""What `cycle` says of each output, by the prefix of the block's variable."""
_RISING = "rising"
_CALLS = 32_768
_LARGEST_GAP_S = 1e9
_MOST_STEPS = 10
_LARGEST_AGE_S = 1e30
_ENUMERATIONS = (SupervisorState, Reason, Outcome, SampleQuality, Quality, TouchOutcome)
_RATE_SHARE, _BAND_SHARE, _APART_UM = 2e-5, 2e-4, 0.02
# By member, not by its word: two enumerations may share one.
_PLACES = {id(member): k for one in _ENUMERATIONS for k, member in enumerate(one)}


@final
class PlcStep(NamedTuple):
    """One call: what goes in, and what must come out, by the names of the block's variables."""

    inputs: Mapping[str, Any]
    """Inputs of the block. Numbers may be NaN or infinite."""
    outputs: Mapping[str, Any]


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
        touches = settings.compensation.touches
        shown = {name: replace(own, acts=False) for name, own in touches.items()}
        self._only_shown = replace(settings.compensation, touches=shown)
        self._values: dict[str, Any] = {}
        ends_s = (settings.shortest_cycle_s, settings.longest_cycle_s)
        self._ends_s = [rounded(end_s, double=settings.double) for end_s in ends_s]
        self._totals_um = tuple(bounds.total_um for bounds in settings.compensation.bounds)
        if line is not None:  # in exact fractions, which take their time
            self._weights, self._most = line.weights(), line.bounds(self._totals_um)
        names = settings.names
        self._names = {
            prefix: tuple([f"{prefix}_{stem}" for stem in stems])
            for prefixes, stems in (
                (("t", "ok", "quality"), names.channels),
                (("trim", "read", *_BY_OUTPUT), names.outputs),
                (("part",), names.parts),
            )
            for prefix in prefixes
        }
        kinds = [(v.name, v.kind) for v in interface_of(settings).outputs if v.name != "heartbeat"]
        words = [name for name, kind in kinds if kind is not Kind.NUMBER]
        self._words = itemgetter(*words, *self._names["added"])
        self.cycle_output: CycleOutput | None = None
        """What `cycle` itself said in the last call."""
        self._switch_on()

    def _switch_on(self) -> None:
        count = len(self.settings.names.outputs)
        self._state = cycle_state(self.settings.compensation)
        self._good_calls = self._calls = 0
        self._gaps_s = self._behind_s = 0.0
        self._waiting, self._linked = True, False
        self._levels = (False, False, False)
        self._trims: _Floats = (0.0,) * count
        self._counts, self._numbers = dict[str, int](), count_from(1)
        self._touched: dict[str, int] = {}
        self._in_force = self._before = (0.0,) * count
        self._written = (0.0, 0.0)

    def step(self, told: Mapping[str, Any]) -> dict[str, Any]:
        """Do what one call of the block does.

        Parameters
        ----------
        told : mapping of str to float or bool
            Inputs by name; with a line the reported corrections in place of what is reported.

        Returns
        -------
        dict of str to float, bool or int
            Outputs by name; with a line the corrections are those that it makes.
        """
        if told["init"]:
            self._switch_on()
        if not self.settings.double:
            numbers = {n: rounded(v, double=False) for n, v in told.items() if isinstance(v, float)}
            told = {**told, **numbers}
        if self._line is not None:
            return self._line_call(self._line, told)
        said = self._call(told)
        self._values = {**told, **said}
        return said

    def values(self) -> Mapping[str, Any]:
        """Return every input and output of the last call by its name."""
        return self._values

    def words(self, said: Mapping[str, Any]) -> tuple[Any, ...]:
        """Return outputs without the numbers that may change from call to call."""
        return self._words(said)

    def _line_call(self, line: LineSettings, told: Mapping[str, Any]) -> dict[str, Any]:
        read = (*self._through(told[name] for name in self._names["read"]), line.origin_mm)
        away_um = _away_um(line, read, self._written)
        read_um = [c + d for c, d in zip(self._in_force, away_um, strict=True)]
        told = {**told, **dict(zip(self._names["read"], read_um, strict=True))}
        said = self._call(told)
        self._in_force = tuple(said[name] for name in self._names["correction"])
        laid = self._written = self._through(self._in_force)
        outside = any(abs(c) > um for c, um in zip(self._before, self._totals_um, strict=True))
        if not outside:
            k0_mm, slope = (min(max(v, -b), b) for v, b in zip(laid, self._most, strict=True))
            self._written = k0_mm, slope
        k0_mm, slope = self._written
        there_um = [(k0_mm + slope * way) * line.um_per_mm for way in _ways_mm(line)]
        self._values = {
            **told,
            **said,
            **dict(zip(("read_k0_mm", "read_slope", "read_reference_mm"), read, strict=True)),
            "k0_mm": k0_mm,
            "slope": slope,
            "reference_mm": line.origin_mm,
            "residual_um": max(abs(c - u) for c, u in zip(self._in_force, there_um, strict=True)),
            "line_limited": self._written != laid,
        }
        return {**said, **dict(zip(self._names["correction"], there_um, strict=True))}

    def _through(self, um: Iterable[float]) -> tuple[float, float]:
        """Return K0 and slope of the line through values at the positions. [mm, 1]"""
        k0_mm = slope = 0.0
        for to_k0, to_slope, value in zip(*self._weights, um, strict=True):
            k0_mm += to_k0 * value
            slope += to_slope * value
        return k0_mm, slope

    def _call(self, told: Mapping[str, Any]) -> dict[str, Any]:
        settings, compensation = self.settings, self.settings.compensation
        if not told.get("touches_act", True):
            compensation = self._only_shown
        shortest_s, longest_s = self._ends_s
        cycle_time_s: float = told["cycle_time_s"]
        gap = self._good_calls > 0 and cycle_time_s > compensation.model.longest_gap_s
        in_time = shortest_s <= cycle_time_s <= longest_s
        if gap:
            self._gaps_s += min(cycle_time_s, _LARGEST_GAP_S)
            # After a gap the block moves by no more than in any other call.
            share = 1.0 / LONGEST_STEP_CYCLES
            compensation = _with_limits(compensation, "largest_rate_um_per_s", share)
            self._behind_s = 0.0
        elif in_time:
            self._make_up()
        elif cycle_time_s > 0.0:
            owed_s = rounded(self._behind_s + cycle_time_s, double=settings.double)
            self._behind_s = min(owed_s, compensation.model.longest_gap_s)
        self._good_calls += in_time
        time_s = settings.cycle_s * self._good_calls + self._gaps_s
        read_um = tuple(told[name] for name in self._names["read"])
        connected, read_ok = told["connected"], told["read_ok"]
        if self._calls == 0:
            self._levels = told["reset"], told["enable"], told["hold"]
        off = self._state.memory.state is SupervisorState.OFF
        there = connected and read_ok and all(abs(u) <= LARGEST_READ for u in read_um)
        self._waiting = self._waiting or off or gap or not connected
        found, self._waiting = self._waiting and there, self._waiting and not there
        self._linked = connected and not self._waiting
        samples = zip(self._names["t"], self._names["ok"], strict=True)
        reading = CycleReading(
            time_s if in_time or gap else math.nan,
            tuple(Sample(told[t], told[ok], 0.0) for t, ok in samples),
            interlocks=(told["interlocks_met"],),
            connected=self._linked,
            read_back_um=tuple(u if read_ok else None for u in read_um),
            found_um=read_um if found else None,
            other_compensation=told["other_compensation"],
            requests=tuple(self._requests(told)),
            touches=tuple(self._touches(told, time_s, in_time=in_time)),
        )
        self._calls += 1
        self._state, output = cycle(compensation, self._state, reading)
        if self._behind_s >= settings.cycle_s:  # a touch would show what the model still lacks
            self._state = self._state._replace(expected=())
        outcomes = zip(reading.touches, output.touch_outcomes, strict=True)
        self._touched |= {touch.output: 1 + _PLACES[id(outcome)] for touch, outcome in outcomes}
        if cycle_time_s > longest_s and not gap:  # to the cycle no time has passed
            rows = zip(compensation.bounds, output.correction_um, self._state.goal_um, strict=True)
            correction_um = tuple(
                c if goal else limit_step(bounds, c, goal, settings.cycle_s)
                for bounds, c, goal in rows
            )
            self._state = self._state._replace(correction_um=correction_um)
            output = output._replace(correction_um=correction_um)
        self._before, self.cycle_output = output.before_um, output
        return self._as_block(output)

    def _make_up(self) -> None:
        """Advance the model by cycles that are owed, with the inputs that acted last."""
        thermal, cycle_s, steps = self._state.thermal, self.settings.cycle_s, 1
        time_s, model = thermal.time_s, self.settings.compensation.model
        if time_s is None:  # it starts
            self._behind_s = 0.0
            return
        whole = all(good_s == time_s for good_s in thermal.good_s)
        while whole and self._behind_s >= cycle_s and steps < _MOST_STEPS:
            self._behind_s = rounded(self._behind_s - cycle_s, double=self.settings.double)
            values = dict(zip(model.channels, thermal.value, strict=True))
            thermal, _ = model_step(model, thermal, Reading(time_s + steps * cycle_s, values))
            steps += 1
        if steps > 1:  # to everything else no time has passed
            made_up = shifted(self._state._replace(thermal=thermal), (1 - steps) * cycle_s)
            self._state = self._state._replace(thermal=made_up.thermal)

    def _requests(self, told: Mapping[str, Any]) -> Iterator[Request]:
        reset, enable, hold = self._levels
        self._levels = told["reset"], told["enable"], told["hold"]
        if told["reset"] and not reset:
            yield Request(RequestKind.ACKNOWLEDGE, "plc")
        if told["enable"] != enable:
            yield Request(RequestKind.ENABLE if told["enable"] else RequestKind.DISABLE, "plc")
        if told.get("datum"):
            yield Request(RequestKind.DATUM, "plc")
        if told["hold"] or hold:  # asked for in every call: the cycle itself knows what is held
            kind = RequestKind.HOLD if told["hold"] else RequestKind.RESUME
            yield Request(kind, "plc", text=_RISING if not hold else "")
        diameter_mm = told["diameter_mm"] if told["diameter_known"] else None
        yield Request(RequestKind.DIAMETER, "plc", value=diameter_mm)
        longest_s = self.settings.compensation.supervisor.longest_trim_s
        trims_um = tuple(told[name] for name in self._names["trim"])
        outputs = self.settings.compensation.model.outputs
        for output, before, trim in zip(outputs, self._trims, trims_um, strict=True):
            if self._calls and not trim == before:  # noqa: SIM201 - NaN differs from itself
                yield Request(RequestKind.TRIM, "plc", output.name, trim, longest_s)
        self._trims = trims_um

    def _touches(self, told: Mapping[str, Any], time_s: float, *, in_time: bool) -> Iterator[Touch]:
        """Return the touches whose counters have changed, at the time of the call they refer to."""
        cycle_s, compensation = self.settings.cycle_s, self.settings.compensation
        noted_s = [since_s for since_s, _ in self._state.expected]
        for stem, output in zip(
            self.settings.names.outputs, compensation.model.outputs, strict=True
        ):
            if output.name not in compensation.touches:
                continue
            count, age_s = told[f"count_{stem}"], told[f"age_{stem}"]
            if count != self._counts.setdefault(stem, count):
                calls = enumerate(noted_s, 1)
                stood_s = (at_s for k, at_s in calls if in_time and k * cycle_s >= age_s)
                at_s = next(stood_s, time_s - (len(noted_s) + 1) * cycle_s)
                usable = 0.0 <= age_s <= _LARGEST_AGE_S
                at_s = at_s if usable else math.nan
                yield Touch(output.name, told[f"touch_{stem}"], at_s, next(self._numbers))
            self._counts[stem] = count

    def _as_block(self, output: CycleOutput) -> dict[str, Any]:
        memory = self._state.memory
        behind = self._behind_s >= self.settings.cycle_s
        outcomes = {*output.outcomes, *([Outcome.CLOCK_UNUSABLE] if behind else [])}
        said: dict[str, Any] = {
            "state": _PLACES[id(output.state)],
            "enabled": memory.enabled,
            "held": memory.held,
            "linked": self._linked,
            "settled": output.settled and not behind,
            "standing": self._standing(output),
            "fault_word": sum(2 ** _PLACES[id(reason)] for reason in output.reasons),
            "model_quality": _PLACES[id(output.quality)],
            "outcome_word": sum(2 ** _PLACES[id(outcome)] for outcome in outcomes),
            "refused": any(map(_refused, output.answers)),
            "heartbeat": self._calls % _CALLS,
        }
        for prefix, field in _BY_OUTPUT.items():
            said.update(zip(self._names[prefix], getattr(output, field), strict=True))
        parts_um = (part_um for parts in output.contribution_um for part_um in parts)
        said.update(zip(self._names["part"], parts_um, strict=True))
        qualities = (_PLACES[id(quality)] for quality in output.qualities)
        said.update(zip(self._names["quality"], qualities, strict=True))
        for stem, of, state, std_um in zip(
            self.settings.names.outputs,
            self.settings.compensation.model.outputs,
            self._state.offsets,
            output.offset_std_um,
            strict=False,
        ):
            if std_um is not None:
                said |= {
                    f"offset_{stem}": state.in_force_um,
                    f"believed_{stem}": state.belief.offset_um if state.belief else 0.0,
                    f"std_{stem}": std_um,
                    f"touched_{stem}": self._touched.get(of.name, 0),
                    f"off_{stem}": state.off is not None,
                }
        return said

    def _standing(self, output: CycleOutput) -> bool:
        tolerance_um = self.settings.compensation.supervisor.read_back_tolerance_um
        off = output.state is SupervisorState.OFF
        return off and any(abs(c) > tolerance_um for c in output.correction_um)


def _refused(answer: Answer) -> bool:
    """Return whether the block says that this was refused: of hold only the rising edge."""
    level = answer.request.kind is RequestKind.HOLD and answer.request.text != _RISING
    return not (answer.accepted or level)


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

    def step(self, told: Mapping[str, Any]) -> dict[str, Any]:
        """Do what one call of the block does."""
        said = self._block.step(told)
        near = [self._near(other.step(told), said) for other in self._others]
        self.judged = all(near)
        return said

    def values(self) -> Mapping[str, Any]:
        """Return every input and output of the last call by its name."""
        return self._block.values()

    def words(self, said: Mapping[str, Any]) -> tuple[Any, ...]:
        """Return outputs without the numbers that may change from call to call."""
        return self._block.words(said)

    def _near(self, one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
        """Whether two say the same words, and corrections that rounding may make different."""
        names = [f"correction_{stem}" for stem in self._block.settings.names.outputs]
        near = all(abs(one[name] - other[name]) <= _APART_UM for name in names)
        return near and self.words(one) == self.words(other)


def _with_limits(compensation: Compensation, key: str, times: float) -> Compensation:
    def changed(one: Limits) -> Limits:
        return replace(one, **{key: times * getattr(one, key)})

    touches = compensation.touches.items()
    return replace(
        compensation,
        limits={name: changed(one) for name, one in compensation.limits.items()},
        touches={name: replace(own, limits=changed(own.limits)) for name, own in touches},
    )


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
