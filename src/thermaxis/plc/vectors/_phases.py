"""The phases of the test sequence: through everything that a block says, in few rows.

Every phase begins with a new instance in a plant that stands still. Temperatures jump while a
person gives reset, which lets a sensor be believed anew, and the control reports its offset in
steps, so that a row stands for many calls.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import TypeAlias

from thermaxis.plc.vectors._simulated_plant import PlcStep, SimulatedPlant

Steps: TypeAlias = Iterator[PlcStep]
Phase: TypeAlias = Callable[[SimulatedPlant], Steps]

ODD = (float("nan"), float("inf"), float("-inf"), 1e20, -1e20, 1e7, 0.0, -40.0)
"""What is no temperature, or none that is plausible. [degC]"""
LONG_ROW_CALLS = 1000
"""Calls of the row in which nothing changes any more. [1]"""
_BEYOND = 1.05


def phases_of(plant: SimulatedPlant) -> tuple[tuple[str, Phase], ...]:
    """Return the phases, each with its name."""
    limits = [
        (f"{'lower' if sign > 0.0 else 'upper'} limit of output {k + 1}", _limit(k, sign))
        for k in range(len(plant.bounds))
        for sign in (1.0, -1.0)
    ]
    return (
        ("start", _start),
        ("far temperatures", _far),
        ("levels at the start", _levels_at_the_start),
        ("workpieces", _workpieces),
        ("requests", _requests),
        ("other compensation", _other_compensation),
        ("read-back", _read_back),
        ("cycle times", _cycle_times),
        ("gaps", _gaps),
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


def _active(plant: SimulatedPlant, share: float = 0.1) -> Steps:
    """Bring a new instance to Active, with temperatures a little away from the usual."""
    plant.again()
    plant.some(share)
    yield from plant.jump()
    yield from _enabled(plant)


def _enabled(plant: SimulatedPlant) -> Steps:
    plant.usual = plant.usual._replace(enable=False)
    yield plant.step()
    yield plant.step(reset=True)
    plant.usual = plant.usual._replace(enable=True)
    yield from plant.stay(plant.ready_s())


def _start(plant: SimulatedPlant) -> Steps:
    """Start with a wrong cycle time and with channels that are not there yet; off."""
    plant.again()
    channels = len(plant.base_c)
    yield plant.step(cycle_time_s=5.0 * plant.cycle_s)
    yield plant.step(ok=(False,) * channels)
    yield plant.step(ok=(*(True,) * (channels - 1), False))
    yield plant.step(hold=True)
    yield from plant.calls(4)


def _far(plant: SimulatedPlant) -> Steps:
    """Be far outside what the model was made from, where it says so, in both directions."""
    for sign in (1.0, -1.0):
        plant.again()
        for k in range(len(plant.bounds)):
            plant.towards(k, sign)
            yield from plant.jump()
            yield from plant.calls(2)


def _levels_at_the_start(plant: SimulatedPlant) -> Steps:
    """Start with every level TRUE, a trim, and an offset that cannot be read yet."""
    plant.again(tuple([0.25 * b.total_um for b in plant.bounds]))
    trims = tuple([0.5 * b.largest_trim_um for b in plant.bounds])
    levels: dict[str, object] = {"enable": True, "reset": True, "trims_um": trims}
    yield from plant.calls(4, **levels, hold=True, read_ok=False)
    yield from plant.calls(3, **levels)
    yield from plant.calls(3)
    plant.usual = plant.usual._replace(enable=True)
    yield from plant.stay(plant.ready_s())
    yield from plant.calls(20)


def _workpieces(plant: SimulatedPlant) -> Steps:
    """State diameters: within the table of gains, outside, refused, and none."""
    plant.again()
    plant.apart()
    yield from plant.jump()
    yield from _enabled(plant)
    edges = sorted({p.diameter_mm for x in plant.model.layout.parts for p in x.gain_by_diameter})
    between = [0.5 * (a + b) for a, b in pairwise(edges)]
    outside = [0.5 * edges[0], edges[-1] + 10.0] if edges else []
    for diameter_mm in (0.0, *edges, *between, *outside, 123.0, 1e5, 1e5 + 1.0, -1.0, *ODD[:2]):
        yield from plant.calls(2, diameter_known=True, diameter_mm=diameter_mm)
    yield from plant.calls(2)


def _requests(plant: SimulatedPlant) -> Steps:
    """Trim every output, trim by what is refused, hold, enable while held, and give reset."""
    yield from _active(plant)
    outputs = len(plant.bounds)
    for k, bounds in enumerate(plant.bounds):
        for trim_um in (0.5 * bounds.largest_trim_um, 2.0 * bounds.largest_trim_um, ODD[0]):
            trims = tuple([trim_um if i == k else 0.0 for i in range(outputs)])
            yield from plant.calls(3, trims_um=trims)
        yield plant.step()
    for trim_um in (ODD[1], -0.25 * plant.bounds[0].largest_trim_um, 0.0):
        yield from plant.calls(3, trims_um=(trim_um,) * outputs)
    yield from plant.calls(4, hold=True)
    yield from plant.calls(4)
    yield from plant.calls(2, hold=True, enable=False)
    yield from plant.stay(plant.ready_s(), hold=True)
    yield from plant.calls(2)
    yield plant.step(reset=True)
    yield from plant.calls(30, enable=False)


def _other_compensation(plant: SimulatedPlant) -> Steps:
    """Let another compensation be active; try to enable and to acknowledge meanwhile."""
    yield from _active(plant)
    other = {"other_compensation": True}
    yield from plant.calls(2, **other)
    yield plant.step(reset=True, **other)
    yield plant.step(enable=False, **other)
    yield plant.step(hold=True, **other)
    yield plant.step()
    trims = tuple([0.5 * bounds.largest_trim_um for bounds in plant.bounds])
    yield plant.step(trims_um=trims, enable=False)
    yield plant.step(enable=False)
    yield plant.step(reset=True, enable=False)
    yield plant.step(enable=True, **other)
    yield from plant.calls(30, enable=False)
    yield from _enabled(plant)


def _read_back(plant: SimulatedPlant) -> Steps:
    """Report another offset than was written, for shorter and longer than is believed; none."""
    yield from _active(plant, 0.2)
    yield from plant.calls(20)
    rules, outputs = plant.rules, len(plant.bounds)
    stuck = tuple([c + 4.0 * rules.read_back_tolerance_um for c in plant.offset_um])
    yield from plant.calls(2, read_um=stuck)
    yield from plant.calls(4)
    yield from plant.stay(plant.beyond(rules.read_back_s), read_um=stuck)
    yield from plant.calls(4, read_um=stuck, reset=True)
    yield from plant.calls(4, read_um=tuple([0.5 * c for c in stuck]))
    yield from plant.calls(3, read_um=(ODD[0],) * outputs)
    yield from plant.stay(plant.beyond(rules.read_back_s), read_ok=False)
    yield from _enabled(plant)


def _cycle_times(plant: SimulatedPlant) -> Steps:
    """Be called too late, too early, at the borders, and with no number."""
    yield from _active(plant)
    for factor in (1.99, 0.5, 1.09, 0.91, 1.11, 0.89, 0.0, -1.0, ODD[0], ODD[2]):
        yield plant.step(cycle_time_s=factor * plant.cycle_s)
        yield plant.step()
    wrong = 1.5 * plant.cycle_s
    yield from plant.stay(plant.beyond(plant.rules.input_timeout_s), cycle_time_s=wrong)
    yield from plant.stay(plant.ready_s())


def _gaps(plant: SimulatedPlant) -> Steps:
    """Be called after longer than the model bridges: cooled down, and with a channel lost."""
    yield from _active(plant)
    channels = len(plant.base_c)
    for seconds, ok in ((1.5 * plant.model.longest_gap_s, True), (ODD[1], False)):
        plant.now_c = [c - 0.25 for c in plant.now_c]
        yield plant.step(cycle_time_s=seconds, ok=(*(True,) * (channels - 1), ok))
        yield from plant.stay(plant.ready_s())
        yield plant.step(enable=False)
        yield from plant.calls(2)


def _found(plant: SimulatedPlant) -> Steps:
    """Find an offset that is too large, none that can be read, and another in every call of Off."""
    large = tuple([2.0 * b.total_um for b in plant.bounds])
    zero = (0.0,) * len(plant.bounds)
    plant.again(large)
    yield plant.step(read_um=large)
    yield from plant.calls(2, enable=True, read_um=large)
    yield plant.step(read_um=large)
    yield plant.step(read_um=large, reset=True)
    yield plant.step(read_um=zero, read_ok=False)
    yield plant.step(read_um=zero, read_ok=False, reset=True)
    yield from plant.calls(2, read_um=zero)
    plant.again()
    yield from _changed_in_off(plant)
    plant.again()
    yield from plant.calls(2, read_um=(ODD[0],) * len(plant.bounds))
    yield from plant.calls(2)
    plant.again()
    yield from plant.calls(2, read_ok=False)
    yield from plant.calls(2, read_ok=False, enable=True)
    yield from plant.calls(3, read_um=large, enable=True)
    yield plant.step(read_um=large, enable=True, reset=True)
    plant.again(tuple([-0.125 * b.total_um for b in plant.bounds]))
    yield plant.step()
    yield from _enabled(plant)


def _changed_in_off(plant: SimulatedPlant) -> Steps:
    """Let somebody change the offset while it is Off, and enable it unread, then read."""
    yield plant.step()
    for share in (0.25, -0.125):
        plant.stand([share * bounds.total_um for bounds in plant.bounds])
        yield plant.step()
    plant.stand([0.5 * bounds.total_um for bounds in plant.bounds])
    yield from plant.calls(2, read_ok=False)
    yield from plant.calls(3, read_ok=False, enable=True)
    yield from plant.stay(plant.ready_s(), enable=True)
    yield from plant.calls(5, enable=True)
    yield from plant.calls(2, enable=False)


def _odd_values(plant: SimulatedPlant) -> Steps:
    """Read what is no temperature, what is not plausible, and what jumps."""
    yield from _active(plant)
    for k, rules in enumerate(plant.sensors):
        for odd in (*ODD, rules.lowest_c - 0.5, rules.highest_c + 0.5):
            seen = list(plant.now_c)
            seen[k] = odd
            yield plant.step(temperatures_c=tuple(seen))
        yield from plant.calls(2)
        jump_k = 2.5 * rules.step_k + 2.0 * rules.largest_rate_k_per_s * plant.cycle_s + 1.0
        up = plant.now_c[k] + jump_k < rules.highest_c
        jumped = list(plant.now_c)
        jumped[k] += jump_k if up else -jump_k
        yield from plant.calls(4, temperatures_c=tuple(jumped))
        yield plant.step(temperatures_c=tuple(jumped), reset=True)
        yield from plant.calls(2)
        yield plant.step(reset=True)
    yield from plant.stay(plant.ready_s())


def _warm_up(plant: SimulatedPlant) -> Steps:
    """Warm up with noise and a wave, then let it fade for some time."""
    yield from _active(plant, 0.0)
    plant.noise_c = 0.02
    for turn in range(8):
        for k, base_c in enumerate(plant.base_c):
            plant.goal_c[k] = base_c + 0.4 * turn + (0.5, 0.8, -0.5, -0.8)[(turn + k) % 4]
        yield from plant.calls(10)
    plant.noise_c = 0.0
    plant.goal_c = list(plant.now_c)
    yield from plant.calls(20)


def _interlock(plant: SimulatedPlant) -> Steps:
    """Lose the interlocks, shorter and longer than is held."""
    yield from _lost(plant, plant.rules.hold_interlock_s, {"interlocks_met": False})


def _connection(plant: SimulatedPlant) -> Steps:
    """Lose the connection, shorter and longer than is held."""
    lost: dict[str, object] = {"connected": False, "read_ok": False}
    yield from _lost(plant, plant.rules.hold_connection_s, lost)


def _lost(plant: SimulatedPlant, held_s: float, lost: dict[str, object]) -> Steps:
    yield from _active(plant, 0.2)
    yield from plant.calls(20)
    yield from plant.calls(2, **lost)
    yield from plant.stay(plant.ready_s())
    yield from _for_longer(plant, held_s, lost)


def _for_longer(plant: SimulatedPlant, held_s: float, lost: dict[str, object]) -> Steps:
    """Let something last for longer than it is held, if there are calls left, and come back."""
    if plant.fits(held_s):
        yield from plant.stay(plant.beyond(held_s), **lost)
        yield from plant.calls(20, **lost)
        yield from plant.stay(plant.ready_s())


def _lost_inputs(plant: SimulatedPlant) -> Steps:
    """Lose an input for a moment, for as long as it is held, and for longer."""
    yield from _active(plant, 0.2)
    rules, channels = plant.rules, len(plant.base_c)
    for k in range(channels):
        yield plant.step(ok=tuple([i != k for i in range(channels)]))
        yield from plant.calls(2)
    lost: dict[str, object] = {"ok": (False, *(True,) * (channels - 1))}
    yield from plant.stay(plant.beyond(rules.input_timeout_s), **lost)
    yield from plant.stay(plant.ready_s())
    for held_s in (plant.model.longest_hold_s, rules.input_timeout_s + rules.hold_input_s):
        yield from _for_longer(plant, held_s, lost)


def _limit(output: int, sign: float) -> Phase:
    """Return the phase in which a correction stands at a limit until that is a fault."""

    def phase(plant: SimulatedPlant) -> Steps:
        bounds = plant.bounds[output]
        reached_um = plant.extreme_um(output, sign)
        goal_c, offsets_um = list(plant.goal_c), plant.near_um()
        plant.again(offsets_um)
        if reached_um < _BEYOND * bounds.largest_um:
            return
        plant.goal_c = goal_c
        limited = False
        for step in plant.jump():
            yield step
            limited = step.outputs.at_limit[output]
        plant.alive = True
        while not limited:
            step = plant.step()
            yield step
            limited = step.outputs.at_limit[output]
        trims = tuple(
            [(k == output) * -sign * b.largest_trim_um for k, b in enumerate(plant.bounds)]
        )
        plant.usual = plant.usual._replace(enable=True)
        yield from plant.stay(plant.ready_s())
        yield plant.step(trims_um=trims)
        yield from plant.stay(plant.beyond(plant.rules.at_limit_s))
        plant.back()
        yield from plant.jump()
        yield from plant.calls(5)
        yield from _enabled(plant)

    return phase


def _held(plant: SimulatedPlant) -> Steps:
    """Hold for longer than is allowed."""
    yield from _active(plant)
    yield from _for_longer(plant, plant.rules.hold_operator_s, {"hold": True})


def _still(plant: SimulatedPlant) -> Steps:
    """Let a trim expire, or at least stand still for long, while no temperature changes."""
    yield from _active(plant)
    trims = tuple([0.5 * b.largest_trim_um for b in plant.bounds])
    long_s = (LONG_ROW_CALLS + LONG_ROW_CALLS // 2) * plant.cycle_s
    frozen_s = max(sensor.frozen_s for sensor in plant.sensors)
    trim_s = plant.rules.longest_trim_s
    lasting = [s for s in (frozen_s, trim_s) if plant.fits(s + 2.0 * long_s)]
    yield from plant.stay(plant.beyond(max([0.0, *lasting])), trims_um=trims)
    yield from plant.stay(long_s, trims_um=trims)
    plant.goal_c = [now_c + 0.5 for now_c in plant.now_c]
    yield from plant.jump()
    yield from plant.stay(plant.ready_s())
