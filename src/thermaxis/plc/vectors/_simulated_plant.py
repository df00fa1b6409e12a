"""The world around an exported block in a scenario: machine, sensors and people.

The world is closed: what the machine reports as its offset is what the block has
written in the call before, rounded as a control displays it. Seeded, and made of sums, products
and a small generator of its own alone: the same settings give the same inputs on every computer.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple, Protocol, TypeVar, final

from thermaxis.compensation import SupervisorState
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.vectors._instance import BlockInstance, PlcInputs, PlcOutputs

ODD = (float("nan"), float("inf"), float("-inf"), 1e300, -1e300, 1e7, 0.0, -40.0)
"""What is no temperature, or none that is plausible. [degC]"""
_STEP_C = 0.01
_NEAR_UM = 0.25
_OFF = list(SupervisorState).index(SupervisorState.OFF)
_MASK = 2**64 - 1
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


class SequenceBlock(Protocol):
    """What a course is led through: an instance, or what answers in its place."""

    def step(self, inputs: PlcInputs) -> PlcOutputs:
        """Do what one call of the block does."""
        ...


class SimulatedPlant:
    """Machine, sensors and people around the block."""

    def __init__(
        self, settings: PlcSettings, seed: int, block: SequenceBlock | None = None
    ) -> None:
        compensation = settings.compensation
        self.rules, self.model = compensation.supervisor, compensation.model
        self.bounds, self.sensors = compensation.bounds, compensation.rules
        self.cycle_s = settings.cycle_s
        self.chance = _Chance(seed)
        self.block: SequenceBlock = block or BlockInstance(settings)
        self.base_c = [self._base_c(k) for k in range(len(self.model.channels))]
        self.goal_c = list(self.base_c)
        self.now_c = list(self.base_c)
        self.noise_c = 0.0
        self.restart = False
        self.offset_um = [0.0] * len(self.bounds)
        self.usual: PlcInputs = PlcInputs(
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
        self.warm()
        inputs = self.usual._replace(
            temperatures_c=tuple([self._seen(t) for t in self.now_c]),
            read_um=self.reported_um(),
            restart=self.restart,
        )
        self.restart = False
        inputs = inputs._replace(**different)  # pyright: ignore[reportArgumentType] - by name
        outputs = self.block.step(inputs)
        if outputs.linked and outputs.state != _OFF:
            self.offset_um = list(outputs.correction_um)
        return PlcStep(inputs, outputs)

    def reported_um(self) -> tuple[float, ...]:
        """Return what the machine reports as its offset, by output. [µm]"""
        return tuple([round(c / _NEAR_UM) * _NEAR_UM for c in self.offset_um])

    def stand(self, offset_um: Sequence[float]) -> None:
        """Let another offset stand in the control, as somebody sets it."""
        self.offset_um = list(offset_um)

    def _seen(self, true_c: float) -> float:
        noise_c = self.chance.uniform(-self.noise_c, self.noise_c) if self.noise_c else 0.0
        return round((true_c + noise_c) / _STEP_C) * _STEP_C

    def warm(self) -> None:
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
        return self.beyond(max(rules.settle_s, rules.recovery_delay_s, rules.input_timeout_s))

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


# ---- what both courses live through -------------------------------------------------------------


def odd_start(world: SimulatedPlant) -> Iterator[PlcStep]:
    """Start with a wrong cycle time and with channels that are not there yet; off."""
    channels = len(world.base_c)
    yield world.step(cycle_time_s=5.0 * world.cycle_s)
    yield world.step(ok=(False,) * channels)
    yield world.step(ok=(*(True,) * (channels - 1), False))
    yield world.step(hold=True)
    yield from world.stay(4 * world.cycle_s)


def changed_in_off(world: SimulatedPlant) -> Iterator[PlcStep]:
    """Let somebody change the offset while it is Off, and enable it unread, then read."""
    yield world.step()
    for share in (0.25, -0.125):
        world.stand([share * bounds.total_um for bounds in world.bounds])
        yield world.step()
    world.stand([0.5 * bounds.total_um for bounds in world.bounds])
    yield from world.stay(2 * world.cycle_s, read_ok=False)
    yield from world.stay(3 * world.cycle_s, read_ok=False, enable=True)
    yield from world.stay(world.ready_s(), enable=True)
    yield from world.stay(5 * world.cycle_s, enable=True)
    yield from world.stay(2 * world.cycle_s, enable=False)


def trims_and_hold(world: SimulatedPlant) -> Iterator[PlcStep]:
    """Trim every output, trim by what is refused, hold, enable while held, and give reset."""
    outputs = len(world.bounds)
    for k, bounds in enumerate(world.bounds):
        for trim_um in (0.5 * bounds.largest_trim_um, 2.0 * bounds.largest_trim_um, ODD[0]):
            trims = tuple([trim_um if i == k else 0.0 for i in range(outputs)])
            yield from world.stay(3 * world.cycle_s, trims_um=trims)
        yield world.step()
    for trim_um in (ODD[1], -0.25 * world.bounds[0].largest_trim_um, 0.0):
        yield from world.stay(3 * world.cycle_s, trims_um=(trim_um,) * outputs)
    yield from world.stay(4 * world.cycle_s, hold=True)
    yield from world.stay(4 * world.cycle_s)
    yield from world.stay(2 * world.cycle_s, hold=True, enable=False)
    yield from world.stay(world.ready_s(), hold=True)
    yield from world.stay(2 * world.cycle_s)
    yield world.step(reset=True)


def odd_values(world: SimulatedPlant) -> Iterator[PlcStep]:
    """Read what is no temperature, what is not plausible, and what jumps."""
    for k, rules in enumerate(world.sensors):
        for odd in (*ODD, rules.lowest_c - 0.5, rules.highest_c + 0.5):
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
        yield world.step(reset=True)
    yield from world.stay(world.ready_s())


def wrong_cycle_times(world: SimulatedPlant) -> Iterator[PlcStep]:
    """Be called too late, too early, at the borders, and with no number."""
    for factor in (2.0, 0.5, 1.09, 0.91, 1.11, 0.89, 0.0, -1.0, *ODD[:4]):
        yield world.step(cycle_time_s=factor * world.cycle_s)
        yield world.step()
    wrong = 1.5 * world.cycle_s
    yield from world.stay(world.beyond(world.rules.input_timeout_s), cycle_time_s=wrong)
    yield from world.stay(world.ready_s())


def other_offsets(world: SimulatedPlant) -> Iterator[PlcStep]:
    """Report another offset than was written, for shorter and longer than is believed; none."""
    rules, outputs = world.rules, len(world.bounds)
    stuck = tuple([c + 4.0 * rules.read_back_tolerance_um for c in world.offset_um])
    yield from world.stay(2 * world.cycle_s, read_um=stuck)
    yield from world.stay(4 * world.cycle_s)
    yield from world.stay(world.beyond(rules.read_back_s), read_um=stuck)
    yield from world.stay(4 * world.cycle_s, read_um=stuck, reset=True)
    half = tuple([0.5 * c for c in stuck])
    yield from world.stay(4 * world.cycle_s, read_um=half)
    yield from world.stay(3 * world.cycle_s, read_um=(ODD[0],) * outputs)
    yield from world.stay(world.beyond(rules.read_back_s), read_ok=False)


def second_compensation(world: SimulatedPlant) -> Iterator[PlcStep]:
    """Let another compensation be active; try to enable and to acknowledge meanwhile."""
    other = {"other_compensation": True}
    yield from world.stay(2 * world.cycle_s, **other)
    yield world.step(reset=True, **other)
    yield world.step(enable=False, **other)
    yield world.step(hold=True, **other)
    yield world.step()
    trims = tuple([0.5 * bounds.largest_trim_um for bounds in world.bounds])
    yield world.step(trims_um=trims, enable=False)
    yield world.step(enable=False)
    yield world.step(reset=True, enable=False)
    yield world.step(enable=True, **other)
