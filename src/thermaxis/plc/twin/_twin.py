"""The exported block once more, plainly: what a PLC must say, in its own numbers.

Not made from the tree that is printed, and sharing no rule with it nor with `cycle`: written from
the docstrings of `cycle` and from ``docs/theory/supervisor.md``. In LREAL it says what `cycle`
says, bit for bit; in REAL every operation, input and constant is rounded to binary32. It makes
the expected outputs of the test vectors.
"""

from typing import NamedTuple, final

from thermaxis.compensation import (
    Limits,
    Outcome,
    Quality,
    Reason,
    SampleQuality,
    SupervisorState,
)
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.twin._model import ModelSaid, ModelTwin
from thermaxis.plc.twin._numbers import Rounding, rounding
from thermaxis.plc.twin._sensor import SensorTwin
from thermaxis.plc.twin._supervisor import Now, SupervisorTwin

LAST_BEAT = 32767
"""Value of the heartbeat after which it begins at 0 again: the largest INT. [1]"""
_LARGEST = 1e6
_LARGEST_DIAMETER_MM = 1e5
_STATES = {state: k for k, state in enumerate(SupervisorState)}
_QUALITIES = {quality: k for k, quality in enumerate(SampleQuality)}
_MODEL_QUALITIES = {quality: k for k, quality in enumerate(Quality)}
_REASON_BITS = {reason: 2**k for k, reason in enumerate(Reason)}
_OUTCOME_BITS = {outcome: 2**k for k, outcome in enumerate(Outcome)}
_RESTARTS = frozenset({Outcome.STARTED, Outcome.WAITING})

_Floats = tuple[float, ...]


class PlcInputs(NamedTuple):
    """Inputs of the block in one call. Numbers may be NaN or infinite."""

    cycle_time_s: float
    """Measured time since the last call; the nominal one in the first. [s]"""
    enable: bool
    """Level: a rising edge enables, a falling one disables; no level of the first call, nor a
    trim, asks for anything."""
    hold: bool
    """Level: while it is TRUE a compensation that is enabled and without a fault is held, also one
    that is enabled meanwhile; a falling edge resumes."""
    reset: bool
    """A rising edge acknowledges."""
    diameter_mm: float
    """Clamping diameter of the workpiece. [mm]"""
    diameter_known: bool
    """Whether it is stated; else the gain at the tool centre point is used."""
    temperatures_c: _Floats
    """By channel of the model. [degC]"""
    ok: tuple[bool, ...]
    """Whether the status of each is good."""
    trims_um: _Floats
    """By output; a value that differs from that of the last call is a request. [µm]"""
    interlocks_met: bool
    """Whether every condition is met."""
    connected: bool
    """Whether the machine can be written to."""
    other_compensation: bool
    """Whether another compensation is active on an axis."""
    read_um: _Floats
    """What the machine reports as the offset that was written last, by output. [µm]"""
    read_ok: bool
    """Whether that could be read."""
    restart: bool = False
    """No input of the block: whether the PLC was switched off and on before this call, so that
    nothing of the block's memory is left."""


class PlcOutputs(NamedTuple):
    """Outputs of the block after one call."""

    correction_um: _Floats
    """What is to be written, by output. [µm]"""
    model_um: _Floats
    """Displacement by output. [µm]"""
    wanted_um: _Floats
    """The correction before rate and supervisor, by output. [µm]"""
    weight: _Floats
    """Weight of the model by output. [1]"""
    at_limit: tuple[bool, ...]
    """Whether the model asks for more than the magnitude, by output."""
    added_um: _Floats
    """Trim in force, by output; 0 once it has expired. [µm]"""
    parts_um: _Floats
    """What every part contributes, in the order of the outputs. [µm]"""
    qualities: tuple[int, ...]
    """What was wrong with each channel: place in `SampleQuality`. [1]"""
    state: int
    """Place in `SupervisorState`. [1]"""
    enabled: bool
    """Whether somebody has enabled it."""
    held: bool
    """Whether the hold of an operator is in force, or has expired."""
    linked: bool
    """Whether the corrections may be written: the machine can be reached, and the offset that
    stood there was taken over."""
    fault_word: int
    """Sum of 2**k over the reasons, k the place in `Reason`. [1]"""
    model_quality: int
    """0 good, 1 held, 2 bad. [1]"""
    outcome_word: int
    """Sum of 2**k over the outcomes, k the place in `Outcome`. [1]"""
    refused: bool
    """Whether a request of this call was refused."""
    heartbeat: int
    """Counts the calls, 0 after `LAST_BEAT`. [1]"""


@final
class _OutputTwin:
    """Correction, goal, trim and limits of one output."""

    def __init__(self, bounds: Limits, cycle_s: float, longest_s: float, r: Rounding) -> None:
        self._r = r
        self._cycle_s, self._longest_s = r(cycle_s), r(longest_s)
        self._largest_um, self._total_um = r(bounds.largest_um), r(bounds.total_um)
        self._deadband_um = r(bounds.deadband_um)
        self._largest_trim_um = r(bounds.largest_trim_um)
        self._step_um = r(bounds.largest_rate_um_per_s * cycle_s)
        self.correction_um = 0.0
        self._goal_um = 0.0
        self.trim_um = 0.0
        self._left_s = 0.0
        self.asked_um = 0.0

    def find(self, found_um: float) -> None:
        """Go on from an offset that stands in the control."""
        self.correction_um = found_um

    def outside(self) -> bool:
        """Return whether the correction in force lies outside the total."""
        return not -self._total_um <= self.correction_um <= self._total_um

    def age_trim(self) -> None:
        """Let a cycle go by for the trim."""
        if self._left_s > self._cycle_s:
            self._left_s = self._r(self._left_s - self._cycle_s)
        else:
            self.trim_um = self._left_s = 0.0

    def set_trim(self, trim_um: float, *, faulty: bool) -> bool:
        """Answer a request for a trim; return whether it takes effect."""
        if trim_um == 0.0:
            self.trim_um = self._left_s = 0.0
            return True
        if faulty or not (abs(trim_um) <= self._largest_trim_um and self._longest_s > 0.0):
            return False
        self.trim_um, self._left_s = trim_um, self._longest_s
        return True

    def wanted(self, weight: float, model_um: float) -> tuple[float, bool]:
        """Return minus the weighted model within its magnitude, and whether it was beyond."""
        c = self._r(-weight * model_um)
        if c > self._largest_um:
            return self._largest_um, True
        if c < -self._largest_um:
            return -self._largest_um, True
        return c, False

    def trimmed(self, wanted_um: float) -> float:
        """Return what is wanted with the trim, within the total. [µm]"""
        return self._within_total(self._r(wanted_um + self.trim_um))

    def followed(self, read_um: float | None, tolerance_um: float) -> float:
        """Return the goal of a fault while the machine keeps another offset. [µm]"""
        c = self.correction_um
        if read_um is None or abs(self._r(read_um - c)) <= tolerance_um:
            return 0.0
        if c > 0.0:
            return min(max(read_um, 0.0), c)
        return max(min(read_um, 0.0), c)

    def stay(self) -> None:
        """Leave the correction where it is."""
        self._goal_um = self.correction_um

    def go(self, wanted_um: float, *, moved: bool) -> None:
        """Go to a goal, as fast as the rate allows where the time went on."""
        r, c, goal = self._r, self.correction_um, wanted_um
        near = abs(r(wanted_um - self._goal_um)) <= self._deadband_um
        if self._deadband_um > 0.0 and near and wanted_um not in {0.0, c}:
            goal = self._goal_um
        self._goal_um = goal
        step_um = self._step_um if moved else 0.0
        highest, lowest = r(c + step_um), r(c - step_um)
        after = self._within_total(goal)
        if after > highest:
            after = highest
        elif after < lowest:
            after = lowest
        self.correction_um = after

    def _within_total(self, value_um: float) -> float:
        return min(max(value_um, -self._total_um), self._total_um)


@final
class Twin:
    """The block: one `step` is one call.

    Not protected: as `cycle`; and whether a PLC's compiler rounds every operation as IEEE 754
    says is what the comparison with this twin's outputs shows.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.
    """

    def __init__(self, settings: PlcSettings) -> None:
        self._settings = settings
        self._switch_on()

    def _switch_on(self) -> None:
        compensation, cycle_s = self._settings.compensation, self._settings.cycle_s
        rules = compensation.supervisor
        r = self._r = rounding(double=self._settings.double)
        self._shortest_s = r(self._settings.shortest_cycle_s)
        self._longest_s = r(self._settings.longest_cycle_s)
        self._tolerance_um = r(rules.read_back_tolerance_um)
        self._margin_k = r(compensation.validity_margin_k)
        self._lowest_weight = r(compensation.lowest_weight)
        self._sensors = [SensorTwin(rule, cycle_s, r) for rule in compensation.rules]
        self._model = ModelTwin(compensation.model, cycle_s, r)
        self._supervisor = SupervisorTwin(rules, cycle_s, r)
        self._outputs = [
            _OutputTwin(bounds, cycle_s, rules.longest_trim_s, r) for bounds in compensation.bounds
        ]
        self._diameter_mm: float | None = None
        self._enable = self._hold = self._reset = False
        self._called = self._timed = False
        self._waiting = True
        self._heartbeat = 0

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
        if inputs.restart:
            self._switch_on()
        r = self._r
        good = self._shortest_s <= r(inputs.cycle_time_s) <= self._longest_s
        moved = good and self._timed
        self._timed = self._timed or good
        read_um = self._read(inputs)
        agrees = self._found(read_um, found=self.takes_over(inputs))
        linked = self._link(inputs.connected, read_um)
        outside = any(output.outside() for output in self._outputs)
        at_zero = all(output.correction_um == 0.0 for output in self._outputs)
        if moved:
            for output in self._outputs:
                output.age_trim()
        now = Now(
            inputs_usable=False,
            model_runs=False,
            connected=linked,
            interlocks_met=inputs.interlocks_met,
            agrees=agrees,
            at_limit=False,
            other=inputs.other_compensation,
            outside=outside,
            at_zero=at_zero,
        )
        refused = self._ask(inputs, now)
        values, qualities = self._judge(inputs, moved=moved)
        said = (
            self._model.advance(values, self._diameter_mm)
            if good
            else self._model.stand(self._diameter_mm)
        )
        weight = self._weights(said)
        wanted_um, at_limit = self._wanted(weight, said.model_um)
        now = now._replace(
            inputs_usable=moved and None not in values and said.quality is not Quality.BAD,
            model_runs=_RESTARTS.isdisjoint(said.outcomes),
            at_limit=any(at_limit),
        )
        reasons = self._supervisor.advance(now)
        follows = agrees and said.quality is not Quality.BAD
        self._correct(wanted_um, read_um, now, follows=follows, moved=moved)
        self._heartbeat = 0 if self._heartbeat == LAST_BEAT else self._heartbeat + 1
        return PlcOutputs(
            tuple([output.correction_um for output in self._outputs]),
            said.model_um,
            wanted_um,
            weight,
            at_limit,
            tuple([output.trim_um for output in self._outputs]),
            said.parts_um,
            qualities,
            _STATES[self._supervisor.state],
            self._supervisor.enabled,
            self._supervisor.held,
            linked,
            sum(_REASON_BITS[reason] for reason in reasons),
            _MODEL_QUALITIES[said.quality],
            sum(_OUTCOME_BITS[outcome] for outcome in said.outcomes),
            refused,
            self._heartbeat,
        )

    def takes_over(self, inputs: PlcInputs) -> bool:
        """Return whether the next call takes over the offset that it reads.

        Parameters
        ----------
        inputs : PlcInputs
            Inputs of the next call.

        Returns
        -------
        bool
            Whether all of it is read, and it is Off or this is the first time since the
            connection was lost.
        """
        waits = inputs.restart or self._waiting or self._supervisor.state is SupervisorState.OFF
        return waits and inputs.connected and None not in self._read(inputs)

    def _read(self, inputs: PlcInputs) -> list[float | None]:
        """Return what the machine reports, None where that is no offset."""
        return [_usable(self._r(u)) if inputs.read_ok else None for u in inputs.read_um]

    def _link(self, connected: bool, read_um: list[float | None]) -> bool:  # noqa: FBT001
        """Return whether the machine can be reached and what stood there is known."""
        if not connected or self._supervisor.state is SupervisorState.OFF:
            self._waiting = True
        if connected and None not in read_um:
            self._waiting = False
        return not self._waiting

    def _found(self, read_um: list[float | None], *, found: bool) -> bool:
        """Take over the offset where it is asked for; return whether the machine agrees."""
        agrees = True
        for output, said in zip(self._outputs, read_um, strict=True):
            if said is None:
                agrees = False
            elif found:
                output.find(said)
            elif abs(self._r(said - output.correction_um)) > self._tolerance_um:
                agrees = False
        return agrees

    def _ask(self, inputs: PlcInputs, now: Now) -> bool:
        """Answer the requests of the call; return whether one was refused."""
        answers: list[bool] = []
        supervisor = self._supervisor
        if not self._called:
            # No level of the first call is an edge.
            self._reset, self._enable, self._hold = inputs.reset, inputs.enable, inputs.hold
        if inputs.reset and not self._reset:
            acknowledged = supervisor.acknowledge(now)
            answers.append(acknowledged)
            if acknowledged:
                for sensor in self._sensors:
                    sensor.forget()
        if inputs.enable and not self._enable:
            answers.append(supervisor.enable(other=now.other, outside=now.outside))
        elif self._enable and not inputs.enable:
            answers.append(supervisor.disable())
        if inputs.hold:
            held = supervisor.hold()
            answers.append(held or self._hold)  # only a rising edge is refused
        elif self._hold and not inputs.hold:
            answers.append(supervisor.resume())
        self._reset, self._enable, self._hold = inputs.reset, inputs.enable, inputs.hold
        answers.append(self._measure(inputs))
        faulty = supervisor.state is SupervisorState.FAULT
        for output, trim_um in zip(self._outputs, inputs.trims_um, strict=True):
            asked_um = self._r(trim_um)
            if self._called and asked_um != output.asked_um:
                answers.append(output.set_trim(asked_um, faulty=faulty))
            output.asked_um = asked_um
        self._called = True
        return not all(answers)

    def _measure(self, inputs: PlcInputs) -> bool:
        """Take the workpiece's diameter; return whether it is one."""
        if not inputs.diameter_known:
            self._diameter_mm = None
            return True
        diameter_mm = self._r(inputs.diameter_mm)
        if not 0.0 <= diameter_mm <= _LARGEST_DIAMETER_MM:
            return False
        self._diameter_mm = diameter_mm
        return True

    def _judge(
        self, inputs: PlcInputs, *, moved: bool
    ) -> tuple[list[float | None], tuple[int, ...]]:
        """Return the usable value of every channel, and the number of its quality."""
        values: list[float | None] = []
        qualities: list[int] = []
        channels = zip(self._sensors, inputs.temperatures_c, inputs.ok, strict=True)
        for sensor, read_c, ok in channels:
            value = self._r(read_c)
            quality = sensor.judged(value, ok=ok, moved=moved, timed=self._timed)
            values.append(value if quality is SampleQuality.GOOD else None)
            qualities.append(_QUALITIES[quality])
        return values, tuple(qualities)

    def _weights(self, said: ModelSaid) -> _Floats:
        """Return the weight of every output: less than 1 where an input is outside its range."""
        r = self._r
        return tuple(
            [
                max(self._lowest_weight, r(1.0 - r(outside_k / self._margin_k)))
                for outside_k in said.outside_k
            ]
        )

    def _wanted(self, weight: _Floats, model_um: _Floats) -> tuple[_Floats, tuple[bool, ...]]:
        pairs = [
            output.wanted(w, y)
            for output, w, y in zip(self._outputs, weight, model_um, strict=True)
        ]
        wanted_um = [c for c, _ in pairs]
        if any(output.trim_um != 0.0 for output in self._outputs):
            wanted_um = [
                output.trimmed(c) for output, c in zip(self._outputs, wanted_um, strict=True)
            ]
        return tuple(wanted_um), tuple([beyond for _, beyond in pairs])

    def _correct(
        self,
        wanted_um: _Floats,
        read_um: list[float | None],
        now: Now,
        *,
        follows: bool,
        moved: bool,
    ) -> None:
        """Let every correction go where its state allows."""
        state = self._supervisor.state
        free = now.agrees or not now.connected
        for output, wanted, said in zip(self._outputs, wanted_um, read_um, strict=True):
            if state is SupervisorState.ACTIVE and follows:
                output.go(wanted, moved=moved)
            elif state in {SupervisorState.FADING, SupervisorState.FAULT} and free:
                output.go(0.0, moved=moved)
            elif state is SupervisorState.FAULT:
                output.go(output.followed(said, self._tolerance_um), moved=moved)
            else:
                output.stay()


def _usable(value: float) -> float | None:
    return value if abs(value) <= _LARGEST else None
