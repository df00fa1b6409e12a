"""The fixed course of the test vectors: through everything that a block says, in few rows.

Every phase begins with a new instance in a world that stands still, and gets a share of the rows
and calls; what it does not need is left to those behind it. Temperatures jump while a person
gives reset, which lets a sensor be believed anew, and the control reports its offset in steps, so
that a row stands for many calls. The rest is as in `_world`.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import final

from thermaxis.compensation import STATED
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.vectors._instance import BlockInstance, PlcInputs, PlcOutputs
from thermaxis.plc.vectors._simulated_plant import (
    ODD,
    PlcStep,
    SequenceBlock,
    SimulatedPlant,
    changed_in_off,
    odd_start,
    odd_values,
    other_offsets,
    second_compensation,
    trims_and_hold,
    wrong_cycle_times,
)

MOST_ROWS = 2000
"""Most rows of the course. Default: what a person still looks through. [1]"""
MOST_CALLS = 45_000
"""Most calls of the course: a shift of 8 h at 1 s, in which a trim ends, and what else there is.
At a cycle of 0.1 s no row may stand for as many as would take minutes to compute. [1]"""
LONG_ROW_CALLS = 1000
"""Calls of the row in which nothing changes any more. [1]"""
NEAR_SHARE = 0.8
"""Share of the read-back's tolerance by which the reported offset may be away. [1]"""
_SHARES = (0.95, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.08, 0.05, 0.03)
_BEYOND = 1.05
_HALVINGS = 12
_ALIVE_K = 0.03

_Phase = Callable[["SequencePlant"], Iterator[PlcStep]]
_GRID_UM = 1024.0


@final
class CallSequence:
    """The fixed course of a block.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.
    seed : int
        Seed of the noise.
    most_rows : int
        Rows that its phases share: calls whose inputs or words differ from those before. Default:
        `MOST_ROWS`. [1]
    most_calls : int
        Calls that they share. Default: `MOST_CALLS`. [1]
    block : SequenceBlock, optional
        Who is called. Default: a new instance.
    near_share : float
        Share of the read-back's tolerance by which the reported offset may be away. Default:
        `NEAR_SHARE`. [1]
    """

    def __init__(
        self,
        settings: PlcSettings,
        *,
        seed: int,
        most_rows: int = MOST_ROWS,
        most_calls: int = MOST_CALLS,
        block: SequenceBlock | None = None,
        near_share: float = NEAR_SHARE,
    ) -> None:
        self._world = SequencePlant(settings, seed, block or BlockInstance(settings), near_share)
        self._rows_left, self._calls_left = most_rows, most_calls
        self.cuts: list[str] = []
        """Phases that were ended before their end, in words; complete after the last step."""

    def steps(self) -> Iterator[PlcStep]:
        """Return the calls one by one, once.

        Yields
        ------
        PlcStep
            One call.
        """
        phases = _phases(self._world)
        for number, (name, phase) in enumerate(phases):
            yield from self._share(name, phase, len(phases) - number)

    def _share(self, name: str, phase: _Phase, phases_left: int) -> Iterator[PlcStep]:
        """Return a phase as far as its share of the rows and calls goes."""
        world = self._world
        # What comes later is longer: an early phase may take twice its share of the calls.
        calls = min(self._calls_left, max(2 * self._calls_left // (phases_left + 1), 1))
        rows = self._rows_left // phases_left
        world.calls_left = calls
        last: PlcStep | None = None
        for step in phase(world):
            new = last is None or step.inputs != last.inputs or _changed(step, last)
            if world.calls_left <= 0 or (new and rows <= 0):
                what = "rows" if world.calls_left > 0 else "calls"
                self.cuts.append(
                    f"{name} after {calls - world.calls_left} calls for want of {what}"
                )
                break
            rows, self._rows_left = rows - new, self._rows_left - new
            world.calls_left -= 1
            last = step
            yield step
        self._calls_left -= calls - world.calls_left


def course_steps(settings: PlcSettings, *, seed: int) -> Iterator[PlcStep]:
    """Return the steps of the fixed course alone.

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
    yield from CallSequence(settings, seed=seed).steps()


def words_of(outputs: PlcOutputs) -> PlcOutputs:
    """Return outputs without the numbers that may change from call to call."""
    return outputs._replace(
        correction_um=(), model_um=(), wanted_um=(), weight=(), parts_um=(), heartbeat=0
    )


def _changed(step: PlcStep, last: PlcStep) -> bool:
    return words_of(step.outputs) != words_of(last.outputs)


@final
class SequencePlant(SimulatedPlant):
    """A world in which little changes from call to call."""

    def __init__(
        self, settings: PlcSettings, seed: int, block: SequenceBlock, near_share: float
    ) -> None:
        super().__init__(settings, seed, block)
        self.calls_left = 0
        self._margin_k = settings.compensation.validity_margin_k
        self._lowest_weight = settings.compensation.lowest_weight
        self._near_um = near_share * settings.compensation.supervisor.read_back_tolerance_um
        self._reported_um = [0.0] * len(self.bounds)
        self._first: PlcInputs = self.usual
        self._new = True
        self.alive = self._up = False
        self._stood = 0

    def reported_um(self) -> tuple[float, ...]:
        """Return what the machine reports: it stays until it is too far from its offset."""
        for k, (now_um, bounds) in enumerate(zip(self.offset_um, self.bounds, strict=True)):
            away_um = now_um - self._reported_um[k]
            if now_um == 0.0:
                self._reported_um[k] = 0.0
            elif abs(away_um) > self._near_um:
                ahead_um = now_um + (0.9 if away_um > 0.0 else -0.9) * self._near_um
                held_um = min(max(ahead_um, -bounds.total_um), bounds.total_um)
                near_um = round(held_um * _GRID_UM) / _GRID_UM
                fits = abs(near_um - now_um) <= self._near_um and abs(near_um) <= bounds.total_um
                self._reported_um[k] = near_um if fits else now_um
        return tuple(self._reported_um)

    def warm(self) -> None:
        """Move temperatures only while there is noise, or so little that no sensor is frozen."""
        if self.noise_c:
            super().warm()
        elif self.alive:
            self._stood += 1
            frozen_s = [s.frozen_s for s in self.sensors if s.frozen_s > 0.0]
            if frozen_s and self._stood * self.cycle_s > 0.5 * min(frozen_s):
                self._stood, self._up = 0, not self._up
                self.now_c = [c + (_ALIVE_K if self._up else -_ALIVE_K) for c in self.now_c]

    def again(self, offset_um: tuple[float, ...] | None = None) -> None:
        """Begin with a new instance: nothing moves, and an offset stands in the control."""
        self.restart, self._new = not self._new or self.restart, False
        self.usual = self._first
        self.noise_c = 0.0
        self.alive, self._stood = False, 0
        self.back()
        self.now_c = list(self.base_c)
        self.stand(offset_um if offset_um is not None else [0.0] * len(self.bounds))

    def jump(self, **different: object) -> Iterator[PlcStep]:
        """Let every temperature be at its goal at once, and let a person say that it is right."""
        yield self.step(**different)
        self.now_c = list(self.goal_c)
        yield self.step(**{**different, "reset": True})

    def stand(self, offset_um: Sequence[float]) -> None:
        """Let another offset stand in the control, and be reported as it is."""
        super().stand(offset_um)
        self._reported_um = list(offset_um)

    def fits(self, seconds: float) -> bool:
        """Return whether a time fits into what is left of the phase's calls."""
        return round(seconds / self.cycle_s) < self.calls_left

    def extreme_um(self, output: int, sign: float) -> float:
        """Set the goals at which an output's model is largest; return what it is then."""
        best_um, best_share = 0.0, _SHARES[0]
        for share in _SHARES:
            self.towards(output, sign, share)
            said_um = sign * self._at_rest_um(output)
            if said_um > best_um:
                best_um, best_share = said_um, share
        self.towards(output, sign, best_share)
        return best_um

    def some(self, share: float) -> None:
        """Set goals a share of the way to the extreme, at which no output comes near its limit."""
        self.extreme_um(0, 1.0)
        ends_c = list(self.goal_c)
        for _ in range(_HALVINGS):
            pairs = zip(self.base_c, ends_c, strict=True)
            self.goal_c = [base_c + share * (end_c - base_c) for base_c, end_c in pairs]
            if all(self._most_um(k) < 0.6 * b.largest_um for k, b in enumerate(self.bounds)):
                return
            share *= 0.5

    def apart(self) -> None:
        """Set goals that differ from their references, each by another amount."""
        pairs = zip(self.base_c, self.sensors, strict=True)
        self.goal_c = [
            base_c + min(0.5 * (k + 1), (0.9 - 0.01 * k) * (rules.highest_c - base_c))
            for k, (base_c, rules) in enumerate(pairs)
        ]

    def near_um(self) -> tuple[float, ...]:
        """Return corrections near to those at the goals, by output. [µm]"""
        said_um = [-self._at_rest_um(k) for k in range(len(self.bounds))]
        most_um = [b.largest_um - 0.1 * min(b.largest_um, 20.0) for b in self.bounds]
        return tuple([min(max(c, -m), m) for c, m in zip(said_um, most_um, strict=True)])

    def _rises_k(self) -> dict[str, float]:
        """Return how far the goals are from the references."""
        model, stated = self.model, self.model.reference == STATED
        return {
            name: goal_c - (model.reference_c[name] if stated else base_c)
            for name, goal_c, base_c in zip(model.channels, self.goal_c, self.base_c, strict=True)
        }

    def _most_um(self, output: int) -> float:
        """Return a bound of an output's model on the way to the goals, for any workpiece."""
        of, rise_k = self.model.outputs[output], self._rises_k()
        total_um = abs(of.offset_um)
        for part in of.parts:
            u = rise_k[part.plus] - (rise_k[part.minus] if part.minus else 0.0)
            size = abs(part.direct_gain_um_per_k) + sum(abs(s.gain_um_per_k) for s in part.sections)
            gains = [abs(p.gain) for p in part.gain_by_diameter]
            total_um += size * abs(u) * (max(abs(part.tool_gain), *gains) if gains else 1.0)
        return total_um

    def _at_rest_um(self, output: int) -> float:
        """Return an output's model at the goals, weighted, when nothing moves any more."""
        of, rise_k = self.model.outputs[output], self._rises_k()
        total_um, outside_k = of.offset_um, 0.0
        for part in of.parts:
            u = rise_k[part.plus] - (rise_k[part.minus] if part.minus else 0.0)
            gain = part.tool_gain if part.gain_by_diameter else 1.0
            total_um += part.dc_gain_um_per_k * gain * u
            if part.lowest_k is not None and part.highest_k is not None:
                outside_k = max(outside_k, part.lowest_k - u, u - part.highest_k)
        weight = max(self._lowest_weight, 1.0 - outside_k / self._margin_k)
        return weight * total_um


# ---- phases -------------------------------------------------------------------------------------


def _phases(world: SequencePlant) -> tuple[tuple[str, _Phase], ...]:
    limits = [
        (f"{'lower' if sign > 0.0 else 'upper'} limit of output {k + 1}", _limit(k, sign))
        for k in range(len(world.bounds))
        for sign in (1.0, -1.0)
    ]
    return (
        ("start", _start),
        ("far temperatures", _far),
        ("levels at the start", _levels_at_the_start),
        ("workpieces", _workpieces),
        ("requests", _requests),
        ("other compensation", _other_faults),
        ("read-back", _read_back),
        ("cycle times", _cycle_times),
        ("offset at the start", _found),
        ("odd temperatures", _odd_values),
        ("warm-up", _warm_up),
        ("interlock", _interlock),
        ("connection", _connection),
        ("lost temperatures", _lost_inputs),
        *limits,
        ("hold", _held),
        ("stand-still", _still),
    )


def _active(world: SequencePlant, share: float = 0.1) -> Iterator[PlcStep]:
    """Bring a new instance to Active, with temperatures a little away from the usual."""
    world.again()
    world.some(share)
    yield from world.jump()
    yield from _enabled(world)


def _enabled(world: SequencePlant) -> Iterator[PlcStep]:
    world.usual = world.usual._replace(enable=False)
    yield world.step()
    yield world.step(reset=True)
    world.usual = world.usual._replace(enable=True)
    yield from world.stay(world.ready_s())


def _start(world: SequencePlant) -> Iterator[PlcStep]:
    """Start with a wrong cycle time and with channels that are not there yet; off."""
    world.again()
    yield from odd_start(world)


def _levels_at_the_start(world: SequencePlant) -> Iterator[PlcStep]:
    """Start with every level TRUE, a trim, and an offset that cannot be read yet."""
    world.again(tuple([0.25 * b.total_um for b in world.bounds]))
    trims = tuple([0.5 * b.largest_trim_um for b in world.bounds])
    levels: dict[str, object] = {"enable": True, "reset": True, "trims_um": trims}
    yield world.step(**levels, hold=True, read_ok=False)
    yield from world.stay(3 * world.cycle_s, **levels, hold=True, read_ok=False)
    yield from world.stay(3 * world.cycle_s, **levels)
    yield from world.stay(3 * world.cycle_s)
    world.usual = world.usual._replace(enable=True)
    yield from world.stay(world.ready_s())
    yield from world.stay(20 * world.cycle_s)


def _workpieces(world: SequencePlant) -> Iterator[PlcStep]:
    """State diameters: within the table of gains, outside, refused, and none."""
    world.again()
    world.apart()
    yield from world.jump()
    yield from _enabled(world)
    edges = sorted({p.diameter_mm for x in world.model.layout.parts for p in x.gain_by_diameter})
    between = [0.5 * (a + b) for a, b in pairwise(edges)]
    outside = [0.5 * edges[0], edges[-1] + 10.0] if edges else []
    for diameter_mm in (0.0, *edges, *between, *outside, 123.0, 1e5, 1e5 + 1.0, -1.0, *ODD[:2]):
        yield from world.stay(2 * world.cycle_s, diameter_known=True, diameter_mm=diameter_mm)
    yield from world.stay(2 * world.cycle_s)


def _requests(world: SequencePlant) -> Iterator[PlcStep]:
    """Trim, hold, and ask for what is refused."""
    yield from _active(world)
    yield from trims_and_hold(world)
    yield from world.stay(30 * world.cycle_s, enable=False)


def _other_faults(world: SequencePlant) -> Iterator[PlcStep]:
    """Let another compensation be active; try to enable and to acknowledge meanwhile."""
    yield from _active(world)
    yield from second_compensation(world)
    yield from world.stay(30 * world.cycle_s, enable=False)
    yield from _enabled(world)


def _read_back(world: SequencePlant) -> Iterator[PlcStep]:
    """Report another offset than was written, for shorter and longer than is believed."""
    yield from _active(world, 0.2)
    yield from world.stay(20 * world.cycle_s)
    yield from other_offsets(world)
    yield from _enabled(world)


def _cycle_times(world: SequencePlant) -> Iterator[PlcStep]:
    """Be called too late, too early, at the borders, and with no number."""
    yield from _active(world)
    yield from wrong_cycle_times(world)


def _found(world: SequencePlant) -> Iterator[PlcStep]:
    """Find an offset that is too large, none that can be read, and another in every call of Off."""
    large = tuple([2.0 * b.total_um for b in world.bounds])
    zero = (0.0,) * len(world.bounds)
    world.again(large)
    yield world.step(read_um=large)
    yield from world.stay(2 * world.cycle_s, enable=True, read_um=large)
    yield world.step(read_um=large)
    yield world.step(read_um=large, reset=True)
    yield world.step(read_um=zero, read_ok=False)
    yield world.step(read_um=zero, read_ok=False, reset=True)
    yield from world.stay(2 * world.cycle_s, read_um=zero)
    world.again()
    yield from changed_in_off(world)
    world.again()
    yield from world.stay(2 * world.cycle_s, read_um=(ODD[0],) * len(world.bounds))
    yield from world.stay(2 * world.cycle_s)
    world.again()
    yield from world.stay(2 * world.cycle_s, read_ok=False)
    yield from world.stay(2 * world.cycle_s, read_ok=False, enable=True)
    yield from world.stay(3 * world.cycle_s, read_um=large, enable=True)
    yield world.step(read_um=large, enable=True, reset=True)
    world.again(tuple([-0.125 * b.total_um for b in world.bounds]))
    yield world.step()
    yield from _enabled(world)


def _odd_values(world: SequencePlant) -> Iterator[PlcStep]:
    """Read what is no temperature, what is not plausible, and what jumps."""
    yield from _active(world)
    yield from odd_values(world)


def _warm_up(world: SequencePlant) -> Iterator[PlcStep]:
    """Warm up with noise and a wave, then let it fade for some time."""
    yield from _active(world, 0.0)
    world.noise_c = 0.02
    for turn in range(8):
        for k, base_c in enumerate(world.base_c):
            world.goal_c[k] = base_c + 0.4 * turn + (0.5, 0.8, -0.5, -0.8)[(turn + k) % 4]
        yield from world.stay(10 * world.cycle_s)
    world.noise_c = 0.0
    world.goal_c = list(world.now_c)
    yield from world.stay(20 * world.cycle_s)


def _interlock(world: SequencePlant) -> Iterator[PlcStep]:
    """Lose the interlocks, shorter and longer than is held."""
    yield from _lost(world, world.rules.hold_interlock_s, {"interlocks_met": False})


def _connection(world: SequencePlant) -> Iterator[PlcStep]:
    """Lose the connection, shorter and longer than is held."""
    lost: dict[str, object] = {"connected": False, "read_ok": False}
    yield from _lost(world, world.rules.hold_connection_s, lost)


def _lost(world: SequencePlant, held_s: float, lost: dict[str, object]) -> Iterator[PlcStep]:
    yield from _active(world, 0.2)
    yield from world.stay(20 * world.cycle_s)
    yield from world.stay(2 * world.cycle_s, **lost)
    yield from world.stay(world.ready_s())
    if world.fits(held_s):
        yield from world.stay(world.beyond(held_s), **lost)
        yield from world.stay(20 * world.cycle_s, **lost)
        yield from world.stay(world.ready_s())


def _lost_inputs(world: SequencePlant) -> Iterator[PlcStep]:
    """Lose an input for a moment, for as long as it is held, and for longer."""
    yield from _active(world, 0.2)
    rules, channels = world.rules, len(world.base_c)
    for k in range(channels):
        yield world.step(ok=tuple([i != k for i in range(channels)]))
        yield from world.stay(2 * world.cycle_s)
    lost = (False, *(True,) * (channels - 1))
    yield from world.stay(world.beyond(rules.input_timeout_s), ok=lost)
    yield from world.stay(world.ready_s())
    for held_s in (world.model.longest_hold_s, rules.input_timeout_s + rules.hold_input_s):
        if world.fits(held_s):
            yield from world.stay(world.beyond(held_s), ok=lost)
            yield from world.stay(20 * world.cycle_s, ok=lost)
            yield from world.stay(world.ready_s())


def _limit(output: int, sign: float) -> _Phase:
    """Return the phase in which a correction stands at a limit until that is a fault."""

    def phase(world: SequencePlant) -> Iterator[PlcStep]:
        bounds = world.bounds[output]
        reached_um = world.extreme_um(output, sign)
        goal_c, offsets_um = list(world.goal_c), world.near_um()
        world.again(offsets_um)
        if reached_um < _BEYOND * bounds.largest_um:
            return
        world.goal_c = goal_c
        limited = False
        for step in world.jump():
            yield step
            limited = step.outputs.at_limit[output]
        world.alive = True
        while not limited:
            step = world.step()
            yield step
            limited = step.outputs.at_limit[output]
        trims = tuple(
            [(k == output) * -sign * b.largest_trim_um for k, b in enumerate(world.bounds)]
        )
        world.usual = world.usual._replace(enable=True)
        yield from world.stay(world.ready_s())
        yield from world.stay(world.cycle_s, trims_um=trims)
        yield from world.stay(world.beyond(world.rules.at_limit_s))
        world.back()
        yield from world.jump()
        yield from world.stay(5 * world.cycle_s)
        yield from _enabled(world)

    return phase


def _far(world: SequencePlant) -> Iterator[PlcStep]:
    """Be far outside what the model was made from, where it says so, in both directions."""
    for sign in (1.0, -1.0):
        world.again()
        for k in range(len(world.bounds)):
            world.towards(k, sign)
            yield from world.jump()
            yield from world.stay(2 * world.cycle_s)


def _held(world: SequencePlant) -> Iterator[PlcStep]:
    """Hold for longer than is allowed."""
    yield from _active(world)
    if world.fits(world.rules.hold_operator_s):
        yield from world.stay(world.beyond(world.rules.hold_operator_s), hold=True)
        yield from world.stay(20 * world.cycle_s, hold=True)
        yield from world.stay(world.ready_s())


def _still(world: SequencePlant) -> Iterator[PlcStep]:
    """Let a trim expire, or at least stand still for long, while no temperature changes."""
    yield from _active(world)
    trims = tuple([0.5 * b.largest_trim_um for b in world.bounds])
    long_s = (LONG_ROW_CALLS + LONG_ROW_CALLS // 2) * world.cycle_s
    frozen_s = max(sensor.frozen_s for sensor in world.sensors)
    trim_s = world.rules.longest_trim_s
    lasting = [s for s in (frozen_s, trim_s) if world.fits(s + 2.0 * long_s)]
    yield from world.stay(world.beyond(max([0.0, *lasting])), trims_um=trims)
    yield from world.stay(long_s, trims_um=trims)
    world.goal_c = [now_c + 0.5 for now_c in world.now_c]
    yield from world.jump()
    yield from world.stay(world.ready_s())
