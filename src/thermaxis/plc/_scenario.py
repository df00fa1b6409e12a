"""What a PLC may live through in a shift: inputs of the block, with every fault that is known.

The world is closed: what the machine reports as its offset is what the block, here its twin, has
written in the call before, rounded as a control displays it. Seeded, and made of sums, products
and a small generator of its own alone: the same settings give the same inputs on every computer.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple, TypeVar, final

from thermaxis.plc._settings import PlcSettings
from thermaxis.plc._twin import PlcInputs, PlcOutputs, Twin

_STEP_C = 0.01
_NEAR_UM = 0.25
_MASK = 2**64 - 1
_ODD = (float("nan"), float("inf"), float("-inf"), 1e300, -1e300, 1e7, 0.0, -40.0)
_MARGIN_CALLS = 3
_T = TypeVar("_T")


class PlcStep(NamedTuple):
    """One call: what goes in, and what must come out."""

    inputs: PlcInputs
    """Inputs of the block."""
    outputs: PlcOutputs
    """Outputs after the call."""


@final
class _Chance:
    """A small generator of random numbers; the same on every computer.

    References
    ----------
    Steele, Lea and Flood 2014, Fast splittable pseudorandom number generators (SplitMix64).
    """

    def __init__(self, seed: int) -> None:
        self._state = seed & _MASK

    def uniform(self, lowest: float = 0.0, highest: float = 1.0) -> float:
        """Return a number from the lowest to below the highest."""
        self._state = (self._state + 0x9E3779B97F4A7C15) & _MASK
        z = self._state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _MASK
        z ^= z >> 31
        return lowest + (highest - lowest) * ((z >> 11) * 2.0**-53)

    def one_of(self, choices: tuple[_T, ...]) -> _T:
        """Return one of some values."""
        return choices[int(self.uniform() * len(choices))]


def scenario_steps(
    settings: PlcSettings, *, hours: float, seed: int, faults: bool = True
) -> Iterator[PlcStep]:
    """Return a scenario call by call, with what the twin says in each.

    With faults it begins with a fixed course that leads through states, reasons and refusals as
    far as the model and the hours allow: warm-up with noise, both limits, holds, trims, every
    loss for shorter and longer than it may be held, a restart, a long constant stretch. After that
    faults come by chance. Without faults it is a day of warm-up, a wave and noise.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.
    hours : float
        Length. [h]
    seed : int
        Seed of what is left to chance.
    faults : bool
        Whether anything fails.

    Yields
    ------
    PlcStep
        One call.
    """
    world = _World(settings, seed)
    calls = round(hours * 3600.0 / settings.cycle_s)
    course = _with_faults(world) if faults else _quiet(world)
    for _, step in zip(range(calls), course, strict=False):
        yield step


def scenario(
    settings: PlcSettings, hours: float, seed: int, *, faults: bool = True
) -> Iterator[PlcInputs]:
    """Return the inputs of `scenario_steps` alone.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.
    hours : float
        Length. [h]
    seed : int
        Seed of what is left to chance.
    faults : bool
        Whether anything fails.

    Yields
    ------
    PlcInputs
        Inputs of one call.
    """
    for step in scenario_steps(settings, hours=hours, seed=seed, faults=faults):
        yield step.inputs


def course_steps(settings: PlcSettings, *, seed: int) -> Iterator[PlcStep]:
    """Return the fixed course alone, whole: as long as the rules of the settings make it.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.
    seed : int
        Seed of the noise.

    Yields
    ------
    PlcStep
        One call.
    """
    yield from _course(_World(settings, seed))


@final
class _World:
    """Machine, sensors and people around the block."""

    def __init__(self, settings: PlcSettings, seed: int) -> None:
        compensation = settings.compensation
        self.rules, self.model = compensation.supervisor, compensation.model
        self.bounds, self.sensors = compensation.bounds, compensation.rules
        self.cycle_s = settings.cycle_s
        self.chance = _Chance(seed)
        self.twin = Twin(settings)
        self.base_c = [self._base_c(k) for k in range(len(self.model.channels))]
        self.goal_c = list(self.base_c)
        self.now_c = list(self.base_c)
        self.noise_c = 0.0
        self.restart = False
        self.offset_um = [0.0] * len(self.bounds)
        self.usual = PlcInputs(
            cycle_time_s=settings.cycle_s,
            enable=False,
            hold=False,
            reset=False,
            diameter_mm=0.0,
            diameter_known=False,
            temperatures_c=tuple(self.base_c),
            ok=(True,) * len(self.base_c),
            trims_um=(0.0,) * len(self.bounds),
            interlocks_met=True,
            connected=True,
            other_compensation=False,
            read_um=(0.0,) * len(self.bounds),
            read_ok=True,
        )

    def _base_c(self, k: int) -> float:
        """Return a usual temperature of a channel: its reference, or somewhere in its range."""
        rules = self.sensors[k]
        middle_c = 0.5 * (rules.lowest_c + rules.highest_c)
        base_c = self.model.reference_c.get(self.model.channels[k], min(20.0, middle_c))
        return base_c if rules.lowest_c < base_c < rules.highest_c else middle_c

    def step(self, **different: object) -> PlcStep:
        """Let a call go by in which some inputs differ from the usual."""
        self._warm()
        inputs = self.usual._replace(
            temperatures_c=tuple([self._seen(t) for t in self.now_c]),
            read_um=tuple([round(c / _NEAR_UM) * _NEAR_UM for c in self.offset_um]),
            restart=self.restart,
        )
        self.restart = False
        inputs = inputs._replace(**different)  # pyright: ignore[reportArgumentType] - by name
        outputs = self.twin.step(inputs)
        if inputs.connected:
            self.offset_um = list(outputs.correction_um)
        return PlcStep(inputs, outputs)

    def _seen(self, true_c: float) -> float:
        noise_c = self.chance.uniform(-self.noise_c, self.noise_c) if self.noise_c else 0.0
        return round((true_c + noise_c) / _STEP_C) * _STEP_C

    def _warm(self) -> None:
        """Move every temperature towards its goal, no faster than is believed."""
        for k, (goal_c, rules) in enumerate(zip(self.goal_c, self.sensors, strict=True)):
            most_k = 0.4 * rules.step_k + 0.8 * rules.largest_rate_k_per_s * self.cycle_s
            away_k = goal_c - self.now_c[k]
            self.now_c[k] += min(max(away_k, -most_k), most_k)

    def stay(self, seconds: float, **different: object) -> Iterator[PlcStep]:
        """Let some time go by in the same circumstances; at least one call."""
        for _ in range(max(1, round(seconds / self.cycle_s))):
            yield self.step(**different)

    def beyond(self, seconds: float) -> float:
        """Return a time that is longer by some calls. [s]"""
        return seconds + _MARGIN_CALLS * self.cycle_s

    def fade_s(self) -> float:
        """Return the time in which every correction reaches zero, and a little more. [s]"""
        slowest_s = max(b.total_um / b.largest_rate_um_per_s for b in self.bounds)
        return self.beyond(min(slowest_s, 1800.0))

    def ready_s(self) -> float:
        """Return the time after which everything is there again. [s]"""
        rules = self.rules
        return self.beyond(max(rules.settle_s, rules.heal_s, rules.grace_s))

    def towards(self, output: int, sign: float, share: float = 0.95) -> None:
        """Heat and cool so that the model of an output goes up or down as far as is plausible."""
        gains = [0.0] * len(self.base_c)
        names = self.model.channels
        for part in self.model.outputs[output].parts:
            gain = part.dc_gain_um_per_k * (part.tool_gain if part.gain_by_diameter else 1.0)
            gains[names.index(part.plus)] += gain
            if part.minus:
                gains[names.index(part.minus)] -= gain
        for k, (gain, rules) in enumerate(zip(gains, self.sensors, strict=True)):
            end_c = rules.highest_c if gain * sign > 0.0 else rules.lowest_c
            self.goal_c[k] = self.base_c[k] + (share * (end_c - self.base_c[k]) if gain else 0.0)

    def back(self) -> None:
        """Let every temperature go back to the usual."""
        self.goal_c = list(self.base_c)


# ---- without faults -----------------------------------------------------------------------------


def _quiet(world: _World) -> Iterator[PlcStep]:
    """Warm up for three hours, then cool and warm in a wave, with noise; enabled throughout."""
    world.noise_c = 0.05
    world.usual = world.usual._replace(enable=True)
    seconds = 0.0
    while True:
        for k, base_c in enumerate(world.base_c):
            rise_k = (6.0 + 1.5 * k) * min(seconds / 10_800.0, 1.0)
            world.goal_c[k] = base_c + rise_k + 1.5 * _wave(seconds / (5400.0 + 900.0 * k))
        yield world.step()
        seconds += world.cycle_s


def _wave(turns: float) -> float:
    """Return a wave like a sine, of parabolas: the same on every computer."""
    x = 2.0 * (turns % 1.0)
    return 4.0 * x * (1.0 - x) if x < 1.0 else -4.0 * (x - 1.0) * (2.0 - x)


# ---- the fixed course ---------------------------------------------------------------------------


def _course(world: _World) -> Iterator[PlcStep]:
    for phase in (
        _start,
        _warm_up,
        _requests,
        _lost_inputs,
        _odd_values,
        _cycle_times,
        _losses,
        _limits,
        _read_back,
        _other_faults,
        _workpieces,
        _restart,
        _long,
    ):
        yield from phase(world)


def _enabled(world: _World) -> Iterator[PlcStep]:
    """Bring the block to Active from wherever it is."""
    world.usual = world.usual._replace(enable=False)
    yield from world.stay(2 * world.cycle_s)
    yield from world.stay(world.cycle_s, reset=True)
    world.usual = world.usual._replace(enable=True)
    yield from world.stay(world.ready_s())


def _start(world: _World) -> Iterator[PlcStep]:
    """Start with a wrong cycle time and with channels that are not there yet; off."""
    channels = len(world.base_c)
    yield world.step(cycle_time_s=5.0 * world.cycle_s)
    yield world.step(ok=(False,) * channels)
    yield world.step(ok=(*(True,) * (channels - 1), False))
    yield world.step(hold=True)
    yield from world.stay(4 * world.cycle_s)


def _warm_up(world: _World) -> Iterator[PlcStep]:
    """Enable and warm up with noise and a wave."""
    world.usual = world.usual._replace(enable=True)
    yield from world.stay(world.ready_s())
    world.noise_c = 0.02
    for turn in range(12):
        for k, base_c in enumerate(world.base_c):
            world.goal_c[k] = base_c + 0.25 * turn + (0.5 + 0.25 * k) * _wave(turn / 6.0)
        yield from world.stay(10 * world.cycle_s)
    world.noise_c = 0.0


def _requests(world: _World) -> Iterator[PlcStep]:
    """Trim, hold, and ask for what is refused."""
    outputs = len(world.bounds)
    for k, bounds in enumerate(world.bounds):
        for trim_um in (0.5 * bounds.largest_trim_um, 2.0 * bounds.largest_trim_um, _ODD[0]):
            trims = tuple([trim_um if i == k else 0.0 for i in range(outputs)])
            yield from world.stay(3 * world.cycle_s, trims_um=trims)
        yield world.step()
    for trim_um in (_ODD[1], -0.25 * world.bounds[0].largest_trim_um, 0.0):
        yield from world.stay(3 * world.cycle_s, trims_um=(trim_um,) * outputs)
    yield from world.stay(4 * world.cycle_s, hold=True)
    yield from world.stay(4 * world.cycle_s)
    yield from world.stay(world.cycle_s, reset=True)


def _lost_inputs(world: _World) -> Iterator[PlcStep]:
    """Lose an input for a moment, for as long as it is held, and for longer."""
    rules, channels = world.rules, len(world.base_c)
    for k in range(channels):
        lost = tuple([i != k for i in range(channels)])
        yield from world.stay(world.cycle_s, ok=lost)
        yield from world.stay(2 * world.cycle_s)
    lost = (False, *(True,) * (channels - 1))
    held_s = max(world.beyond(rules.grace_s), world.beyond(min(world.model.longest_hold_s, 900.0)))
    yield from world.stay(held_s, ok=lost)
    yield from world.stay(world.ready_s())
    yield from world.stay(world.beyond(rules.grace_s + rules.hold_input_s), ok=lost)
    yield from world.stay(world.fade_s(), ok=lost)
    yield from world.stay(world.ready_s())


def _odd_values(world: _World) -> Iterator[PlcStep]:
    """Read what is no temperature, what is not plausible, and what jumps."""
    for k, rules in enumerate(world.sensors):
        for odd in (*_ODD, rules.lowest_c - 0.5, rules.highest_c + 0.5):
            seen = list(world.now_c)
            seen[k] = odd
            yield world.step(temperatures_c=tuple(seen))
        yield from world.stay(2 * world.cycle_s)
        jump_k = 2.5 * rules.step_k + 2.0 * rules.largest_rate_k_per_s * world.cycle_s + 1.0
        up = world.now_c[k] + jump_k < rules.highest_c
        jumped = list(world.now_c)
        jumped[k] += jump_k if up else -jump_k
        yield from world.stay(4 * world.cycle_s, temperatures_c=tuple(jumped))
        yield world.step(temperatures_c=tuple(jumped), reset=True)
        yield from world.stay(2 * world.cycle_s)
        yield from world.stay(world.cycle_s, reset=True)
    yield from world.stay(world.ready_s())


def _cycle_times(world: _World) -> Iterator[PlcStep]:
    """Be called too late, too early, at the borders, and with no number."""
    for factor in (2.0, 0.5, 1.09, 0.91, 1.11, 0.89, 0.0, -1.0, *_ODD[:4]):
        yield world.step(cycle_time_s=factor * world.cycle_s)
        yield world.step()
    wrong = 1.5 * world.cycle_s
    yield from world.stay(world.beyond(world.rules.grace_s), cycle_time_s=wrong)
    yield from world.stay(world.ready_s())


def _losses(world: _World) -> Iterator[PlcStep]:
    """Lose the connection and the interlocks, shorter and longer than is held."""
    rules = world.rules
    for longest_s, lost in (
        (rules.hold_connection_s, {"connected": False, "read_ok": False}),
        (rules.hold_interlock_s, {"interlocks_met": False}),
    ):
        yield from world.stay(2 * world.cycle_s, **lost)
        yield from world.stay(world.ready_s())
        yield from world.stay(world.beyond(longest_s), **lost)
        yield from world.stay(world.fade_s(), **lost)
        yield from world.stay(world.ready_s())
    world.usual = world.usual._replace(enable=False)
    yield from world.stay(world.fade_s())


def _limits(world: _World) -> Iterator[PlcStep]:
    """Ask for more than is allowed, in both directions, until that is a fault; come back."""
    for k in range(len(world.bounds)):
        for sign in (1.0, -1.0):
            yield from _enabled(world)
            world.towards(k, sign)
            yield from world.stay(world.fade_s())
            trim_um = -sign * world.bounds[k].largest_trim_um
            trims = tuple([trim_um if i == k else 0.0 for i in range(len(world.bounds))])
            yield from world.stay(world.beyond(world.rules.at_limit_s), trims_um=trims)
            yield world.step(trims_um=tuple([0.5 * trim for trim in trims]))
            world.back()
            yield from world.stay(world.fade_s())
    yield from _enabled(world)


def _read_back(world: _World) -> Iterator[PlcStep]:
    """Report another offset than was written, for shorter and longer than is believed."""
    rules, outputs = world.rules, len(world.bounds)
    world.towards(0, 1.0, share=0.2)
    yield from world.stay(world.fade_s())
    stuck = tuple([c + 4.0 * rules.read_back_tolerance_um for c in world.offset_um])
    yield from world.stay(2 * world.cycle_s, read_um=stuck)
    yield from world.stay(4 * world.cycle_s)
    yield from world.stay(world.beyond(rules.read_back_s), read_um=stuck)
    yield from world.stay(4 * world.cycle_s, read_um=stuck, reset=True)
    half = tuple([0.5 * c for c in stuck])
    yield from world.stay(4 * world.cycle_s, read_um=half)
    yield from world.stay(3 * world.cycle_s, read_um=(_ODD[0],) * outputs)
    yield from world.stay(world.beyond(rules.read_back_s), read_ok=False)
    yield from world.stay(world.fade_s())
    yield from _enabled(world)
    world.back()


def _other_faults(world: _World) -> Iterator[PlcStep]:
    """Let another compensation be active; try to enable and to acknowledge meanwhile."""
    other = {"other_compensation": True}
    yield from world.stay(2 * world.cycle_s, **other)
    yield from world.stay(world.cycle_s, reset=True, **other)
    yield from world.stay(world.cycle_s, enable=False, **other)
    yield from world.stay(world.cycle_s, hold=True, **other)
    yield from world.stay(world.cycle_s)
    yield from world.stay(world.cycle_s, reset=True, enable=False)
    yield from world.stay(world.cycle_s, enable=True, **other)
    yield from world.stay(world.fade_s(), enable=False)
    yield from _enabled(world)


def _workpieces(world: _World) -> Iterator[PlcStep]:
    """State diameters: within the table of gains, outside, refused, and none."""
    yield from world.stay(3 * world.cycle_s, diameter_known=True, diameter_mm=0.0)
    edges = sorted({p.diameter_mm for x in world.model.layout.parts for p in x.gain_by_diameter})
    between = [0.5 * (a + b) for a, b in pairwise(edges)]
    for diameter_mm in (*edges, *between, 123.0, 1e5, 1e5 + 1.0, -1.0, *_ODD[:2]):
        yield from world.stay(3 * world.cycle_s, diameter_known=True, diameter_mm=diameter_mm)
    yield from world.stay(3 * world.cycle_s)


def _restart(world: _World) -> Iterator[PlcStep]:
    """Switch off and on: with the offset still there, with one too large, with none read."""
    for found in (None, 2.0, _ODD[0]):
        world.restart = True
        large = tuple([found * b.total_um for b in world.bounds]) if found is not None else None
        offsets = {} if large is None else {"read_um": large}
        yield world.step(enable=False, **offsets)
        if found == 2.0:
            yield from world.stay(2 * world.cycle_s, enable=True, read_um=large)
            yield from world.stay(world.cycle_s, enable=False, read_um=large)
            yield from _brought_back(world, large)
        yield from world.stay(world.ready_s())
    world.usual = world.usual._replace(enable=True)
    yield from world.stay(world.ready_s())


def _brought_back(world: _World, large: tuple[float, ...] | None) -> Iterator[PlcStep]:
    """Bring back an offset that was too large: in vain, then with reset."""
    zero = {"enable": False, "read_um": (0.0,) * len(world.bounds)}
    yield world.step(enable=False, read_um=large, reset=True)
    yield world.step(**zero, read_ok=False)
    yield world.step(**zero, read_ok=False, reset=True)
    yield from world.stay(2 * world.cycle_s, **zero)
    yield from world.stay(2 * world.cycle_s, **zero, reset=True)


def _long(world: _World) -> Iterator[PlcStep]:
    """Hold for longer than is allowed, let a trim expire, and let everything stand still."""
    yield from _enabled(world)
    rules = world.rules
    yield from world.stay(world.beyond(rules.hold_operator_s), hold=True)
    yield from world.stay(world.fade_s(), hold=True)
    yield from world.stay(world.ready_s())
    trims = tuple([0.5 * b.largest_trim_um for b in world.bounds])
    frozen_s = max(sensor.frozen_s for sensor in world.sensors)
    yield from world.stay(world.beyond(max(rules.longest_trim_s, frozen_s)), trims_um=trims)
    world.goal_c = [base_c + 0.5 for base_c in world.base_c]
    yield from world.stay(world.ready_s())


# ---- by chance ----------------------------------------------------------------------------------


def _with_faults(world: _World) -> Iterator[PlcStep]:
    yield from _course(world)
    world.usual = world.usual._replace(enable=True)
    while True:
        yield from _by_chance(world)


def _by_chance(world: _World) -> Iterator[PlcStep]:
    """Let time go by until something happens, and let that last for some time."""
    chance, rules, cycle_s = world.chance, world.rules, world.cycle_s
    channels, outputs = len(world.base_c), len(world.bounds)
    world.noise_c = chance.one_of((0.0, 0.02, 0.1))
    k = int(chance.uniform() * channels)
    world.goal_c[k] = world.base_c[k] + chance.uniform(-6.0, 12.0)
    for _ in range(int(chance.uniform(5.0, 120.0))):
        bad = tuple([chance.uniform() >= 0.02 for _ in range(channels)])
        yield world.step(ok=bad)
    lasts_s = chance.one_of((1.0, 1.0, 5.0, 20.0, 60.0)) * cycle_s
    trim_um = chance.uniform(-1.2, 1.2) * world.bounds[0].largest_trim_um
    seen = list(world.now_c)
    seen[k] = chance.one_of((*_ODD, world.now_c[k] + 8.0))
    events: tuple[dict[str, object], ...] = (
        {"connected": False, "read_ok": False},
        {"connected": False},
        {"interlocks_met": False},
        {"other_compensation": True},
        {"read_ok": False},
        {"read_um": (chance.uniform(-30.0, 30.0),) * outputs},
        {"cycle_time_s": chance.uniform(0.0, 3.0) * cycle_s},
        {"hold": True},
        {"enable": False},
        {"reset": True},
        {"trims_um": (trim_um,) * outputs},
        {"diameter_known": True, "diameter_mm": chance.uniform(-10.0, 800.0)},
        {"temperatures_c": tuple(seen)},
        {"ok": tuple([i != k for i in range(channels)])},
    )
    yield from world.stay(lasts_s, **chance.one_of(events))
    if chance.uniform() < 0.03:
        world.restart = True
    if chance.uniform() < 0.5:
        yield from world.stay(cycle_s, reset=True)
        yield from world.stay(cycle_s, enable=False)
    yield from world.stay(min(world.ready_s(), rules.settle_s + 20.0 * cycle_s))
