"""What a PLC may live through in a shift: inputs of the block, with every fault that is known.

The same settings give the same inputs on every computer. Every call has inputs of its own where
something warms; the course of the test vectors (`_course`) is shorter, and made of long rows.
"""

from collections.abc import Iterator
from itertools import pairwise

from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.vectors._call_sequence import course_steps
from thermaxis.plc.vectors._instance import PlcInputs
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

__all__ = ["PlcStep", "course_steps", "scenario", "scenario_steps"]


def scenario_steps(
    settings: PlcSettings,
    *,
    hours: float,
    seed: int,
    faults: bool = True,
    block: SequenceBlock | None = None,
) -> Iterator[PlcStep]:
    """Return a scenario call by call, with what the block says in each.

    With faults it begins with a fixed shift that leads through states, reasons and refusals as
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
    block : SequenceBlock, optional
        Who is called. Default: a new instance.

    Yields
    ------
    PlcStep
        One call.
    """
    world = SimulatedPlant(settings, seed, block)
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


# ---- without faults -----------------------------------------------------------------------------


def _quiet(world: SimulatedPlant) -> Iterator[PlcStep]:
    """Warm up for three hours, then cool and warm in a wave, with noise; enabled throughout."""
    world.noise_c = 0.05
    yield world.step()
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


def _course(world: SimulatedPlant) -> Iterator[PlcStep]:
    for phase in (
        odd_start,
        _warm_up,
        trims_and_hold,
        _lost_inputs,
        odd_values,
        wrong_cycle_times,
        _losses,
        _limits,
        _read_back,
        _other_faults,
        _workpieces,
        _restart,
        _long,
    ):
        yield from phase(world)


def _enabled(world: SimulatedPlant) -> Iterator[PlcStep]:
    """Bring the block to Active from wherever it is."""
    world.usual = world.usual._replace(enable=False)
    yield from world.stay(2 * world.cycle_s)
    yield from world.stay(world.cycle_s, reset=True)
    world.usual = world.usual._replace(enable=True)
    yield from world.stay(world.ready_s())


def _warm_up(world: SimulatedPlant) -> Iterator[PlcStep]:
    """Enable and warm up with noise and a wave."""
    world.usual = world.usual._replace(enable=True)
    yield from world.stay(world.ready_s())
    world.noise_c = 0.02
    for turn in range(12):
        for k, base_c in enumerate(world.base_c):
            world.goal_c[k] = base_c + 0.25 * turn + (0.5 + 0.25 * k) * _wave(turn / 6.0)
        yield from world.stay(10 * world.cycle_s)
    world.noise_c = 0.0


def _lost_inputs(world: SimulatedPlant) -> Iterator[PlcStep]:
    """Lose an input for a moment, for as long as it is held, and for longer."""
    rules, channels = world.rules, len(world.base_c)
    for k in range(channels):
        lost = tuple([i != k for i in range(channels)])
        yield from world.stay(world.cycle_s, ok=lost)
        yield from world.stay(2 * world.cycle_s)
    lost = (False, *(True,) * (channels - 1))
    held_s = max(
        world.beyond(rules.input_timeout_s), world.beyond(min(world.model.longest_hold_s, 900.0))
    )
    yield from world.stay(held_s, ok=lost)
    yield from world.stay(world.ready_s())
    yield from world.stay(world.beyond(rules.input_timeout_s + rules.hold_input_s), ok=lost)
    yield from world.stay(world.fade_s(), ok=lost)
    yield from world.stay(world.ready_s())


def _losses(world: SimulatedPlant) -> Iterator[PlcStep]:
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


def _limits(world: SimulatedPlant) -> Iterator[PlcStep]:
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


def _read_back(world: SimulatedPlant) -> Iterator[PlcStep]:
    """Report another offset than was written, for shorter and longer than is believed."""
    world.towards(0, 1.0, share=0.2)
    yield from world.stay(world.fade_s())
    yield from other_offsets(world)
    yield from world.stay(world.fade_s())
    yield from _enabled(world)
    world.back()


def _other_faults(world: SimulatedPlant) -> Iterator[PlcStep]:
    """Let another compensation be active; try to enable and to acknowledge meanwhile."""
    yield from second_compensation(world)
    yield from world.stay(world.fade_s(), enable=False)
    yield from _enabled(world)


def _workpieces(world: SimulatedPlant) -> Iterator[PlcStep]:
    """State diameters: within the table of gains, outside, refused, and none."""
    yield from world.stay(3 * world.cycle_s, diameter_known=True, diameter_mm=0.0)
    edges = sorted({p.diameter_mm for x in world.model.layout.parts for p in x.gain_by_diameter})
    between = [0.5 * (a + b) for a, b in pairwise(edges)]
    for diameter_mm in (*edges, *between, 123.0, 1e5, 1e5 + 1.0, -1.0, *ODD[:2]):
        yield from world.stay(3 * world.cycle_s, diameter_known=True, diameter_mm=diameter_mm)
    yield from world.stay(3 * world.cycle_s)


def _restart(world: SimulatedPlant) -> Iterator[PlcStep]:
    """Switch off and on: with the offset still there, with one too large, with none read."""
    for found in (None, 2.0, ODD[0]):
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


def _brought_back(world: SimulatedPlant, large: tuple[float, ...] | None) -> Iterator[PlcStep]:
    """Bring back an offset that was too large: in vain while nothing is read."""
    zero = {"enable": False, "read_um": (0.0,) * len(world.bounds)}
    yield world.step(enable=False, read_um=large, reset=True)
    yield world.step(**zero, read_ok=False)
    yield world.step(**zero, read_ok=False, reset=True)
    yield from world.stay(2 * world.cycle_s, **zero)
    world.offset_um = [0.0] * len(world.bounds)
    world.usual = world.usual._replace(enable=False)
    yield from changed_in_off(world)


def _long(world: SimulatedPlant) -> Iterator[PlcStep]:
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


def _with_faults(world: SimulatedPlant) -> Iterator[PlcStep]:
    yield from _course(world)
    world.usual = world.usual._replace(enable=True)
    while True:
        yield from _by_chance(world)


def _by_chance(world: SimulatedPlant) -> Iterator[PlcStep]:
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
    seen[k] = chance.one_of((*ODD, world.now_c[k] + 8.0))
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
