"""A hostile world for the cycle, and the laws that must hold in it whatever comes.

The world is seeded and keeps its moods for some time, so that every state is visited and left.
The laws judge from outside: they compute what was in force and how long everything has been there
from the readings, not from the memory of the program.
"""

import math
import random
from typing import Any

from thermaxis.compensation import (
    AnswerCode,
    Compensation,
    CompensationModel,
    CycleOutput,
    CycleReading,
    CycleState,
    GainPoint,
    Limits,
    Outcome,
    Output,
    Part,
    Quality,
    Request,
    RequestKind,
    Sample,
    Section,
    SensorRules,
    SupervisorRules,
    SupervisorState,
)

ODD = (math.nan, math.inf, -math.inf, 1e300, -1e300, 1e7, 0.0, -40.0)
ODD_OBJECTS: tuple[Any, ...] = (None, True, "20", 7, (), *ODD)
QUICK = {
    "settle_s": 3.0,
    "recovery_delay_s": 2.0,
    "input_timeout_s": 1.5,
    "hold_input_s": 5.0,
    "hold_connection_s": 4.0,
    "hold_interlock_s": 2.0,
    "hold_operator_s": 8.0,
    "at_limit_s": 6.0,
    "read_back_s": 3.0,
    "longest_trim_s": 20.0,
}


def quick_lathe(**rules: float) -> Compensation:
    """Return two outputs, three channels, a redundant sensor, interlocks, deadband and ranges."""
    points = (GainPoint(0.0, 0.5), GainPoint(1000.0, 2.0))
    spindle = (Section(8.0, 30.0), Section(-3.0, 300.0))
    z = Output(
        "Z_um",
        (
            Part("spindle", "s", "a", 1.0, spindle, lowest_k=-4.0, highest_k=12.0),
            Part("table", "t", "", 2.0, (Section(2.0, 10.0),), gain_by_diameter=points),
        ),
        offset_um=0.25,
    )
    x = Output("X_um", (Part("spindle", "s", "", -3.0, (Section(1.0, 50.0),)),))
    model = CompensationModel(
        outputs=(z, x),
        reference="stated",
        reference_c={"s": 20.0, "a": 20.0, "t": 20.0},
        longest_gap_s=40.0,
        longest_hold_s=4.0,
    )
    sensors = {
        name: SensorRules(lowest_c=1.0, highest_c=60.0, largest_rate_k_per_s=0.5, frozen_s=frozen_s)
        for name, frozen_s in (("s", 30.0), ("a", 0.0), ("t", 0.0))
    }
    limits = {
        "Z_um": Limits(20.0, 0.7, 22.0, 0.4, largest_trim_um=4.0),
        "X_um": Limits(9.0, 1.3),
    }
    return Compensation(
        model=model,
        sensors=sensors,
        limits=limits,
        supervisor=SupervisorRules(**(QUICK | rules)),
        redundant=frozenset({"a"}),
        interlocks=("referenced", "machine on"),
        validity_margin_k=2.0,
        lowest_weight=0.1,
    )


def bare_lathe(**rules: float) -> Compensation:
    """Return one output on one channel with nothing that waits: every time of the rules is 0."""
    model = CompensationModel(outputs=(Output("Z_um", (Part("s", "s", "", 4.0),)),))
    instant = dict.fromkeys(QUICK, 0.0) | {"hold_operator_s": 3.0, "longest_trim_s": 5.0}
    return Compensation(
        model=model,
        sensors={"s": SensorRules(lowest_c=1.0, highest_c=60.0, frozen_s=0.0)},
        limits={"Z_um": Limits(15.0, 2.0)},
        supervisor=SupervisorRules(**(instant | rules)),
        cycle_s=0.5,
    )


class HostilePlant:
    """Readings from a machine that fails in every way that is known, and some that are not."""

    def __init__(self, compensation: Compensation, seed: int) -> None:
        self.compensation = compensation
        self.rng = random.Random(seed)  # noqa: S311 - a test that can be repeated
        self.time_s = self.rng.choice((0.0, 1e3, 1.8e9, -5.0))
        self.channels = len(compensation.model.channels)
        self.outputs = [output.name for output in compensation.model.outputs]
        self.temperatures = [20.0] * self.channels
        self.moods: dict[str, tuple[str, int]] = {}
        self.machine = [self.rng.choice((0.0, 0.0, 6.0, -80.0)) for _ in self.outputs]
        self.was_connected = False
        self.wickedness = self.rng.choice((0.002, 0.02, 0.1))

    def mood(self, name: str, *moods: str) -> str:
        """Return a mood that lasts for some cycles; the first one is the usual."""
        now, left = self.moods.get(name, (moods[0], 0))
        if left <= 0:
            evil = self.rng.random() < self.wickedness
            now = self.rng.choice(moods) if evil else moods[0]
            left = self.rng.choice((1, 2, 5, 12, 30)) if evil else 3
        self.moods[name] = now, left - 1
        return now

    def reading(self, last: CycleOutput | None) -> CycleReading:
        rng = self.rng
        connected: Any = {"there": True, "lost": False, "flaps": rng.random() < 0.5}.get(
            self.mood("connection", "there", "lost", "flaps", "odd"), rng.choice((None, 1, "yes"))
        )
        if last is not None and self.was_connected:
            self.written(last)
        found = None
        if connected is True and not self.was_connected:
            found = self.found()
        read_back = self.read_back() if self.was_connected and found is None else None
        self.was_connected = connected is True
        return CycleReading(
            self.clock(),
            self.samples("sample"),
            self.samples("redundant") if rng.random() < 0.98 else (),
            self.interlocks(),
            connected,
            read_back,
            found,
            {"none": False, "on": True}.get(self.mood("other", "none", "on", "unread")),
            self.requests(),
        )

    def clock(self) -> Any:
        rng, cycle_s = self.rng, self.compensation.cycle_s
        mood = self.mood("clock", "runs", "still", "jitters", "odd", "back", "late", "day", "int")
        step_s = {
            "still": 0.0,
            "jitters": rng.uniform(-1.0, 3.0) * cycle_s,
            "back": -rng.choice((1e-9, 1.0, 86400.0)),
            "late": rng.uniform(1.0, 60.0),
            "day": rng.choice((86400.0, 1e9)),
        }.get(mood, cycle_s)
        if mood == "odd":
            return rng.choice((math.nan, math.inf, -math.inf, 1e300, None, "now", True))
        self.time_s += step_s
        return int(self.time_s) if mood == "int" else self.time_s

    def samples(self, kind: str) -> tuple[Any, ...]:
        rng = self.rng
        made: list[Any] = []
        for k in range(self.channels):
            if kind == "sample":
                pull = 0.02 * (rng.choice((15.0, 30.0)) - self.temperatures[k])
                self.temperatures[k] += 0.3 * rng.uniform(-1.0, 1.0) + pull
            mood = self.mood(
                f"{kind}{k}", "well", "odd", "bad", "old", "none", "jump", "swap", "same", "object"
            )
            value: Any = round(self.temperatures[k], 1)
            sample: Any = Sample(value, True, 0.1)
            if mood == "odd":
                sample = sample._replace(value=rng.choice(ODD))
            elif mood == "bad":
                sample = sample._replace(good=rng.choice((False, None, 1)))
            elif mood == "old":
                sample = sample._replace(age_s=rng.choice((1e3, None, -99.0, math.nan, "x")))
            elif mood == "none":
                sample = sample._replace(value=None)
            elif mood == "jump":
                sample = sample._replace(value=value + 12.0)
            elif mood == "swap":
                sample = sample._replace(value=self.temperatures[k - 1])
            elif mood == "same":
                sample = sample._replace(value=21.0)
            elif mood == "object":
                sample = rng.choice((None, 3.0, sample._replace(value="x"), (20.0, True, 0.0)))
            made.append(sample)
        if self.mood(f"{kind}s", "all", "fewer") == "fewer":
            made = made[: rng.randrange(self.channels + 1)]
        return tuple(made)

    def interlocks(self) -> tuple[Any, ...]:
        met = [
            {"met": True, "open": False, "unread": None, "flaps": self.rng.random() < 0.5}.get(
                self.mood(f"interlock {name}", "met", "open", "unread", "flaps", "odd"),
                self.rng.choice((1, 1.0, 2, "yes", math.nan)),
            )
            for name in self.compensation.interlocks
        ]
        return tuple(met[:1] if self.mood("interlocks", "all", "fewer") == "fewer" else met)

    def written(self, last: CycleOutput) -> None:
        mood = self.mood("machine", "obeys", "stuck", "overwritten", "halves")
        if mood == "obeys":
            self.machine = list(last.correction_um)
        elif mood == "overwritten":
            self.machine = [self.rng.uniform(-30.0, 30.0) for _ in self.outputs]
        elif mood == "halves":
            self.machine = [0.5 * c for c in last.correction_um]

    def found(self) -> tuple[Any, ...]:
        mood = self.mood("found", "true", "watchdog", "outside", "odd", "fewer")
        if mood == "watchdog":
            self.machine = [0.0] * len(self.outputs)
        elif mood == "outside":
            self.machine = [self.rng.choice((-1.0, 1.0)) * 300.0 for _ in self.outputs]
        elif mood == "odd":
            return tuple(self.rng.choice(ODD_OBJECTS) for _ in self.outputs)
        return tuple(self.machine[:1] if mood == "fewer" else self.machine)

    def read_back(self) -> Any:
        rng = self.rng
        mood = self.mood("read back", "true", "none", "odd", "zero", "negative", "garbage", "short")
        if mood == "none":
            return rng.choice((None, (None,) * len(self.outputs)))
        if mood == "odd":
            return tuple(rng.choice(ODD_OBJECTS) for _ in self.outputs)
        factor = {"zero": 0.0, "negative": -1.0, "garbage": rng.uniform(-5.0, 5.0)}.get(mood, 1.0)
        said = tuple(factor * c for c in self.machine)
        return said[1:] if mood == "short" else said

    def requests(self) -> tuple[Any, ...]:
        rng = self.rng
        if rng.random() > 0.15:
            return ()
        return tuple(self.request() for _ in range(rng.choice((1, 1, 1, 2, 5))))

    def request(self) -> Any:
        rng = self.rng
        kind: Any = rng.choice(
            (RequestKind.ENABLE,) * 8
            + (RequestKind.ACKNOWLEDGE,) * 3
            + tuple(RequestKind)
            + ("enable", "nonsense", None, [])
        )
        if rng.random() < 0.01:
            return rng.choice((None, "enable", 3))
        value = rng.choice((*ODD_OBJECTS, 0.5, -2.0, 3.0, 500.0))
        duration = rng.choice((*ODD_OBJECTS, 1.0, 5.0, 20.0))
        output = rng.choice((*self.outputs, "", "W_um"))
        return Request(kind, "anybody", output, value, duration, "", rng.randrange(99))


# ---- laws ---------------------------------------------------------------------------------------


def _number(value: object) -> float | None:
    if type(value) in {int, float} and abs(value) <= 1e6:
        return float(value)
    return None


OFF_OR_KEPT = {SupervisorState.OFF, SupervisorState.WARMING, SupervisorState.HOLDING}
MODEL_BREAKS = {
    Outcome.STARTED,
    Outcome.WAITING,
    Outcome.GAP,
    Outcome.CLOCK_BACKWARD,
    Outcome.STATE_UNUSABLE,
}


class Laws:
    """Checks one cycle after the other; remembers only what a witness could have seen."""

    def __init__(self, compensation: Compensation) -> None:
        self.compensation = compensation
        self.correction_um = [0.0] * len(compensation.bounds)
        self.state = SupervisorState.OFF
        self.enabled = False
        self.there_s = 0.0
        self.running_s = 0.0
        self.away_s = 0.0
        self.seen: set[SupervisorState] = set()
        self.cycles = 0

    def check(self, reading: CycleReading, state: CycleState, output: CycleOutput) -> None:
        before = self.in_force(reading)
        self.requests_are_answered(reading, output)
        self.numbers_are_finite(output)
        self.limits_hold(before, output)
        self.goals_are_reached(before, state, output)
        self.states_do_what_they_say(before, reading, output)
        self.transitions_are_allowed(reading, output)
        self.correction_um = list(output.correction_um)
        self.state = output.state
        self.seen.add(output.state)
        self.cycles += 1

    def in_force(self, reading: CycleReading) -> list[float]:
        found = [_number(f) for f in reading.found_um or ()]
        found += [None] * len(self.correction_um)
        return [c if f is None else f for c, f in zip(self.correction_um, found, strict=False)]

    def requests_are_answered(self, reading: CycleReading, output: CycleOutput) -> None:
        assert len(output.answers) == len(reading.requests)
        for request, answer in zip(reading.requests, output.answers, strict=True):
            assert answer.request is request
            assert type(answer.accepted) is bool
            assert isinstance(answer.code, AnswerCode)
            kind = getattr(request, "kind", None)
            if answer.accepted and kind == RequestKind.ENABLE:
                if not self.enabled:
                    self.there_s = 0.0
                self.enabled = True
            if answer.accepted and kind == RequestKind.DISABLE:
                self.enabled = False
            if answer.code is AnswerCode.ACKNOWLEDGED:
                assert self.state is SupervisorState.FAULT
                self.enabled = False
                self.state = SupervisorState.FADING

    def numbers_are_finite(self, output: CycleOutput) -> None:
        total = output.time_s + output.since_s + output.elapsed_s + output.in_state_s
        for row in (
            output.correction_um,
            output.wanted_um,
            output.model_um,
            output.weight,
            output.trim_um,
            output.before_um,
            output.rate_um_per_s,
            *output.contribution_um,
        ):
            total += sum(row)
        assert math.isfinite(total)
        assert output.elapsed_s >= 0.0
        assert all(v is None or 1.0 <= v <= 60.0 for v in output.values)
        assert all(0.0 <= w <= 1.0 for w in output.weight)

    def limits_hold(self, before: list[float], output: CycleOutput) -> None:
        assert list(output.before_um) == before
        step_s = min(output.elapsed_s, 2.0 * self.compensation.cycle_s)
        for c, b, bounds in zip(
            output.correction_um, before, self.compensation.bounds, strict=True
        ):
            assert abs(c - b) <= bounds.largest_rate_um_per_s * step_s + 1e-9
            assert abs(c) <= bounds.total_um or (abs(c) <= abs(b) and c * b > 0.0)

    def goals_are_reached(
        self, before: list[float], state: CycleState, output: CycleOutput
    ) -> None:
        step_s = min(output.elapsed_s, 2.0 * self.compensation.cycle_s)
        for c, b, goal, bounds in zip(
            output.correction_um, before, state.goal_um, self.compensation.bounds, strict=True
        ):
            step = bounds.largest_rate_um_per_s * step_s
            if c == b == goal:
                continue  # it is kept, wherever it was found
            target = min(max(goal, -bounds.total_um), bounds.total_um)
            assert abs(c - target) <= max(0.0, abs(b - target) - step) + 1e-9
            assert min(b, target) <= c <= max(b, target)

    def states_do_what_they_say(
        self, before: list[float], reading: CycleReading, output: CycleOutput
    ) -> None:
        now, connected = output.state, reading.connected is True
        agrees = self.agrees(before, reading)
        if now in OFF_OR_KEPT or (not agrees and connected and now is not SupervisorState.FAULT):
            assert list(output.correction_um) == before
        step_s = min(output.elapsed_s, 2.0 * self.compensation.cycle_s)
        for c, b, wanted, bounds in zip(
            output.correction_um, before, output.wanted_um, self.compensation.bounds, strict=True
        ):
            step = bounds.largest_rate_um_per_s * step_s
            if now in {SupervisorState.FADING, SupervisorState.FAULT}:
                assert abs(c) <= abs(b)
                assert c * b >= 0.0
                if agrees or not connected or reading.read_back_um is None:
                    free = now is SupervisorState.FAULT or agrees or not connected
                    assert not free or abs(c) <= max(0.0, abs(b) - step) + 1e-9
            usable = agrees and output.quality is not Quality.BAD
            if now is SupervisorState.ACTIVE and usable and not bounds.deadband_um:
                assert abs(c - wanted) <= max(0.0, abs(b - wanted) - step) + 1e-9
        reasons = output.reasons
        assert (now is SupervisorState.ACTIVE) == (not reasons)

    def agrees(self, before: list[float], reading: CycleReading) -> bool:
        read, found = reading.read_back_um or (), list(reading.found_um or ())
        if len(read) != len(before):
            read = (None,) * len(before)
        found += [None] * len(before)
        for r, f, b in zip(read, found, before, strict=False):
            said = _number(r)
            if _number(f) is None and (said is None or abs(said - b) > 0.5):
                return False
        return True

    def transitions_are_allowed(self, reading: CycleReading, output: CycleOutput) -> None:
        rules, now = self.compensation.supervisor, output.state
        wanted = len(self.compensation.interlocks)
        met = len(reading.interlocks) >= wanted and all(
            one == 1 for one in reading.interlocks[:wanted]
        )
        there = (
            None not in output.values
            and met
            and reading.connected is True
            and reading.other_compensation is False
            and not MODEL_BREAKS & set(output.outcomes)
        )
        step_s = output.elapsed_s or self.compensation.cycle_s
        self.there_s = self.there_s + step_s if there else 0.0
        runs = not MODEL_BREAKS & set(output.outcomes)
        self.running_s = self.running_s + step_s if runs else 0.0
        if now is SupervisorState.ACTIVE:
            assert self.enabled
            assert self.running_s >= rules.settle_s - 1e-9
            assert reading.connected is True
            assert reading.other_compensation is not True
            assert False not in reading.interlocks[:wanted]
            if self.state is not SupervisorState.ACTIVE:
                assert self.there_s >= rules.recovery_delay_s - 1e-9
                assert there or rules.input_timeout_s > 0.0 or rules.recovery_delay_s == 0.0
        if self.state is SupervisorState.FAULT:
            assert now is SupervisorState.FAULT
        if self.state is SupervisorState.OFF and not self.enabled:
            assert now is SupervisorState.OFF
        if now is SupervisorState.OFF:
            assert not self.enabled
        if now is SupervisorState.HOLDING:
            self.away_s += step_s if self.state is SupervisorState.HOLDING else 0.0
            longest_s = max(
                rules.hold_input_s,
                rules.hold_connection_s,
                rules.hold_interlock_s,
                rules.hold_operator_s,
            )
            most_s = longest_s + rules.settle_s + rules.recovery_delay_s + rules.input_timeout_s
            assert self.away_s <= most_s + 1e-6
        else:
            self.away_s = 0.0
        if reading.other_compensation is True and now is not SupervisorState.OFF:
            assert now is SupervisorState.FAULT


def same(one: Any, other: Any) -> bool:
    """Return whether two values are equal to the last bit; zeros have no sign, NaN equals NaN."""
    if type(one) is float and type(other) is float:
        return one == other or (math.isnan(one) and math.isnan(other))
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return type(one) is type(other) and (one is other or one == other)
