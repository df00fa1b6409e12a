"""The phases of the test sequence: through everything that a block says, in few rows.

A phase yields rows: how long, in calls (a whole number) or seconds, and what differs from the usual
inputs. Temperatures jump while a person gives reset, which lets a sensor be believed anew, and the
control reports its offset in steps, so that a row stands for many calls.
"""

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any, TypeAlias

from thermaxis.plc.vectors._simulated_plant import SimulatedPlant

Rows: TypeAlias = Iterator[tuple[int | float, dict[str, Any]]]
Phase: TypeAlias = Callable[[SimulatedPlant], Rows]

ODD = (float("nan"), float("inf"), float("-inf"), 1e20, -1e20, 1e7, 0.0, -40.0)
"""What is no temperature, or none that is plausible. [degC]"""
LONG_ROW_CALLS = 1000
"""Calls of the row in which nothing changes any more. [1]"""
_BEYOND = 1.05


def phases_of(plant: SimulatedPlant) -> tuple[tuple[str, Phase], ...]:
    """Return the phases, each with its name."""
    limits = [
        (f"{side} limit of output {k + 1}", _limit(k, sign))
        for k in range(len(plant.bounds))
        for side, sign in (("lower", 1.0), ("upper", -1.0))
    ]
    return (
        ("start", _start),
        ("far temperatures", _far),
        ("levels at the start", _levels_at_the_start),
        ("workpieces", _workpieces),
        ("requests", _requests),
        ("other compensation", _other_compensation),
        ("read-back", _read_back),
        ("cycle times and gaps", _cycle_times),
        ("offset at the start", _found),
        ("odd temperatures", _odd_values),
        *([("touches", _touches)] if plant.touched else []),
        ("warm-up", _warm_up),
        ("losses", _losses),
        *limits,
        ("stand-still", _still),
    )


def _jump(plant: SimulatedPlant) -> Rows:
    """Let every temperature be at its goal at once, and let a person say that it is right."""
    yield 1, {}
    plant.now_c = list(plant.goal_c)
    yield 1, {"reset": True}


def _enabled(plant: SimulatedPlant) -> Rows:
    plant.usual["enable"] = False
    yield 1, {}
    yield 1, {"reset": True}
    plant.usual["enable"] = True
    yield plant.ready_s(), {}


def _active(plant: SimulatedPlant, share: float = 0.1) -> Rows:
    """Bring a new instance to Active, with temperatures a little away from the usual."""
    plant.again()
    plant.some(share)
    yield from _jump(plant)
    yield from _enabled(plant)


def _start(plant: SimulatedPlant) -> Rows:
    """Start with a wrong cycle time and with channels that are not there yet; off."""
    plant.again()
    channels = len(plant.base_c)
    yield 1, {"cycle_time_s": 5.0 * plant.cycle_s}
    yield 1, plant.told("ok", [False] * channels)
    yield 1, plant.told("ok", [*[True] * (channels - 1), False])
    yield 1, {"hold": True}
    yield 4, {}


def _far(plant: SimulatedPlant) -> Rows:
    """Be far outside what the model was made from, where it says so, in both directions."""
    for sign in (1.0, -1.0):
        plant.again()
        for k in range(len(plant.bounds)):
            plant.towards(k, sign)
            yield from _jump(plant)
            yield 2, {}


def _levels_at_the_start(plant: SimulatedPlant) -> Rows:
    """Start with every level TRUE, a trim, and an offset that cannot be read yet."""
    plant.again(plant.share_um(0.25))
    levels = {"enable": True, "reset": True, **plant.trims(0.5)}
    yield 4, {**levels, "hold": True, "read_ok": False}
    yield 3, levels
    yield 3, {}
    plant.usual["enable"] = True
    yield plant.ready_s(), {}
    yield 20, {}


def _workpieces(plant: SimulatedPlant) -> Rows:
    """State diameters: within the table of gains, outside, refused, and none."""
    plant.again()
    plant.apart()
    yield from _jump(plant)
    yield from _enabled(plant)
    edges = sorted({p.diameter_mm for x in plant.model.layout.parts for p in x.gain_by_diameter})
    between = [0.5 * (a + b) for a, b in pairwise(edges)]
    outside = [0.5 * edges[0], edges[-1] + 10.0] if edges else []
    for diameter_mm in (0.0, *edges, *between, *outside, 123.0, 1e5, 1e5 + 1.0, -1.0, *ODD[:2]):
        yield 2, {"diameter_known": True, "diameter_mm": diameter_mm}
    yield 2, {}


def _requests(plant: SimulatedPlant) -> Rows:
    """Trim every output, trim by what is refused, hold, enable while held, and give reset."""
    yield from _active(plant)
    for k in range(len(plant.bounds)):
        for share in (0.5, 2.0, ODD[0]):
            yield 3, plant.trims(share, k)
        yield 1, {}
    for share in (ODD[1], -0.25, 0.0):
        yield 3, plant.trims(share)
    yield 4, {"hold": True}
    yield 4, {}
    yield 2, {"hold": True, "enable": False}
    yield plant.ready_s(), {"hold": True}
    yield 2, {}
    yield 1, {"reset": True}
    yield 30, {"enable": False}


def _other_compensation(plant: SimulatedPlant) -> Rows:
    """Let another compensation be active; try to enable and to acknowledge meanwhile."""
    yield from _active(plant)
    other = {"other_compensation": True}
    yield 2, other
    yield 1, {**other, "reset": True}
    yield 1, {**other, "enable": False}
    yield 1, {**other, "hold": True}
    yield 1, {}
    yield 1, {"enable": False, **plant.trims(0.5)}
    yield 1, {"enable": False}
    yield 1, {"reset": True}
    yield 1, {"enable": False}
    yield 1, {**other, "enable": True}
    yield 30, {"enable": False}
    yield from _enabled(plant)


def _read_back(plant: SimulatedPlant) -> Rows:
    """Report another offset than was written, for shorter and longer than is believed; none."""
    yield from _active(plant, 0.2)
    yield 20, {}
    rules = plant.rules
    stuck_um = [c + 4.0 * rules.read_back_tolerance_um for c in plant.offset_um]
    stuck = plant.told("read", stuck_um)
    yield 2, stuck
    yield 4, {}
    yield plant.beyond(rules.read_back_s), stuck
    yield 4, {**stuck, "reset": True}
    yield 4, plant.told("read", [0.5 * um for um in stuck_um])
    yield 3, plant.told("read", [ODD[0]] * len(stuck_um))
    yield plant.beyond(rules.read_back_s), {"read_ok": False}
    yield from _enabled(plant)


def _cycle_times(plant: SimulatedPlant) -> Rows:
    """Be called too late, too early, at the borders, with no number, and after a gap."""
    yield from _active(plant)
    for factor in (1.99, 0.5, 1.09, 0.91, 1.11, 0.89, 0.0, -1.0, ODD[0], ODD[2]):
        yield 1, {"cycle_time_s": factor * plant.cycle_s}
        yield 1, {}
    yield plant.beyond(plant.rules.input_timeout_s), {"cycle_time_s": 1.5 * plant.cycle_s}
    yield plant.ready_s(), {}
    gap_s = plant.model.longest_gap_s
    for seconds, ok in ((gap_s, True), (1.5 * gap_s, True), (ODD[1], False)):
        plant.now_c = [c - 0.25 for c in plant.now_c]
        oks = plant.told("ok", [*[True] * (len(plant.base_c) - 1), ok])
        yield 1, {"cycle_time_s": seconds, **oks}
        yield plant.ready_s(), {}
        yield 1, {"enable": False}
        yield 2, {}
    yield 4, {"enable": False, "cycle_time_s": 1.5 * plant.cycle_s}


def _found(plant: SimulatedPlant) -> Rows:
    """Find an offset that is too large, none that can be read, and another in every call of Off."""
    plant.again(plant.share_um(2.0))
    large = plant.told("read", plant.offset_um)
    zero = plant.told("read", [0.0] * len(plant.bounds))
    yield 1, {}
    yield 2, {"enable": True, **large}
    yield 2, large
    yield 1, {**large, "reset": True}
    yield 1, {**zero, "read_ok": False}
    yield 1, {**zero, "read_ok": False, "reset": True}
    yield 2, zero
    plant.again()
    yield 1, {}
    for share in (0.25, -0.125):
        plant.stand(plant.share_um(share))
        yield 1, {}
    plant.stand(plant.share_um(0.5))
    yield 2, {"read_ok": False}
    yield 3, {"read_ok": False, "enable": True}
    yield plant.ready_s(), {"enable": True}
    yield 5, {"enable": True}
    yield 2, {}
    plant.again()
    yield 2, plant.told("read", [ODD[0]] * len(plant.bounds))
    yield 2, {"read_ok": False}
    yield 2, {"read_ok": False, "enable": True}
    yield 3, {**large, "enable": True}
    yield 1, {**large, "enable": True, "reset": True}
    plant.again(plant.share_um(-0.125))
    yield 1, {}
    yield from _enabled(plant)


def _odd_values(plant: SimulatedPlant) -> Rows:
    """Read what is no temperature, what is not plausible, and what jumps."""
    yield from _active(plant)

    def seen(k: int, value_c: float) -> dict[str, Any]:
        return plant.told("t", [*plant.now_c[:k], value_c, *plant.now_c[k + 1 :]])

    for k, rules in enumerate(plant.sensors):
        for odd in (*ODD, rules.lowest_c - 0.5, rules.highest_c + 0.5):
            yield 1, seen(k, odd)
        yield 2, {}
        jump_k = 2.5 * rules.step_k + 2.0 * rules.largest_rate_k_per_s * plant.cycle_s + 1.0
        up = plant.now_c[k] + jump_k < rules.highest_c
        jumped = seen(k, plant.now_c[k] + (jump_k if up else -jump_k))
        yield 4, jumped
        yield 1, {**jumped, "reset": True}
        yield 2, {}
        yield 1, {"reset": True}
    yield plant.ready_s(), {}


def _touches(plant: SimulatedPlant) -> Rows:
    """Touch: one that is right, wild, confirmed, late, none; while the correction moves or stays.

    At last the machine shows the correction with the wrong sign, then too much, then what does not
    fit, each until that is acknowledged.
    """
    yield from _active(plant)
    plant.alive = True
    yield 20, {}
    yield 2, plant.touch(3.0, 0.5 * plant.cycle_s)
    yield 1, plant.touch(3.5, 1.5 * plant.cycle_s)
    yield 20, {}
    yield 2, plant.touch(60.0)
    yield 3, plant.touch(4.0)
    for limits in (-1.0, 1.4):
        yield 1, plant.touch(0.0, limits=limits)
        yield 20, plant.touch(0.5, limits=limits)
    for more_um in (-90.0, 200.0, -300.0):
        yield 2, plant.touch(more_um)
    yield 10, plant.touch(2.0, 2.5 * plant.cycle_s)
    for value_um, age_s in ((ODD[0], 0.0), (1.1e4, 0.0), (2.0, ODD[0]), (2.0, -1.0), (2.0, ODD[1])):
        yield 2, plant.touch(value_um, age_s)
    for calls in (2.5, 10.5, 63.5, 70.5):
        yield 2, plant.touch(2.0, calls * plant.cycle_s)
    yield 3, {"interlocks_met": False}
    yield 2, {**plant.touch(2.5), "interlocks_met": False}
    yield 5, {"touches_act": False}
    yield 1, {"datum": True, **plant.touch(2.5)}
    yield 5, plant.touch(2.5)
    yield plant.ready_s(), {}
    yield 2, {"other_compensation": True, **plant.touch(2.5)}
    yield from _enabled(plant)
    yield 1, {**plant.touch(2.5), "cycle_time_s": 1.5 * plant.cycle_s}
    yield 70, {}
    yield 2, plant.touch(2.5, 69.5 * plant.cycle_s)
    yield 2, plant.touch(2.5, 63.5 * plant.cycle_s)
    for turn in range(16):
        wrong = {**plant.trims((-1.0) ** turn), **plant.touch(0.0, sign=-1.0)}
        yield 20, {**wrong, "touches_act": False}
    yield 2, plant.touch(0.0)
    yield 1, {"reset": True}
    for _ in range(3):
        yield 2, plant.touch(1.0, limits=3.0)
    yield 1, {"reset": True}
    for turn in range(11):
        yield 2, plant.touch((-1.0) ** turn * (60.0 + 20.0 * turn))
    yield 1, {"reset": True}
    yield 2, plant.touch(1.0)
    yield 1, {**plant.touch(1.0), "cycle_time_s": 2.0 * plant.model.longest_gap_s}
    yield plant.ready_s(), {}


def _warm_up(plant: SimulatedPlant) -> Rows:
    """Warm up in steps, as far as is believed, and to and fro; then let it fade for some time."""
    yield from _active(plant, 0.0)
    for turn in range(24):
        for k, rules in enumerate(plant.sensors):
            most_k = 0.4 * rules.step_k + 0.8 * rules.largest_rate_k_per_s * plant.cycle_s
            plant.now_c[k] += min(most_k, 0.3) * (1.0, 0.8, -0.5, 0.6)[(turn + k) % 4]
        yield 2, {}
    plant.goal_c = list(plant.now_c)
    yield 20, {}


def _losses(plant: SimulatedPlant) -> Rows:
    """Lose interlocks, connection, inputs, and hold: for a moment, as long as is held, longer."""
    rules, channels = plant.rules, len(plant.base_c)
    first_input = plant.told("ok", [k > 0 for k in range(channels)])
    yield from _active(plant, 0.2)
    for k in range(channels):
        yield 1, plant.told("ok", [i != k for i in range(channels)])
        yield 2, {}
    yield plant.beyond(rules.input_timeout_s), first_input
    yield plant.ready_s(), {}
    for what, held_s, lost in (
        ("an open interlock", rules.hold_interlock_s, {"interlocks_met": False}),
        ("a lost connection", rules.hold_connection_s, {"connected": False, "read_ok": False}),
        ("a temperature that the model holds", plant.model.longest_hold_s, first_input),
        ("a lost temperature", rules.input_timeout_s + rules.hold_input_s, first_input),
        ("the hold of an operator", rules.hold_operator_s, {"hold": True}),
    ):
        yield from _active(plant, 0.2)
        yield 20, {}
        yield 2, lost
        yield plant.ready_s(), {}
        if plant.fits(held_s, f"{what} for longer than {held_s:g} s"):
            yield plant.beyond(held_s), lost
            yield 20, lost
            yield plant.ready_s(), {}


def _limit(output: int, sign: float) -> Phase:
    """Return the phase in which a correction stands at a limit until that is a fault."""

    def phase(plant: SimulatedPlant) -> Rows:
        reached_um = plant.extreme_um(output, sign)
        goal_c, offsets_um = list(plant.goal_c), plant.near_um()
        plant.again(offsets_um)
        if reached_um < _BEYOND * plant.bounds[output].largest_um:
            return
        plant.goal_c = goal_c
        yield from _jump(plant)
        plant.alive = True
        while not plant.limited(plant.outputs[output]):
            yield 1, {}
        plant.usual["enable"] = True
        yield plant.ready_s(), {}
        yield 1, plant.trims(-sign, output)
        yield plant.beyond(plant.rules.at_limit_s), {}
        plant.back()
        yield from _jump(plant)
        yield 5, {}
        yield from _enabled(plant)

    return phase


def _still(plant: SimulatedPlant) -> Rows:
    """Let a value stand until it is frozen, a trim until it expires, and everything for long.

    All of the trim's time but its last calls passes in a gap, in which no value stands.
    """
    yield from _active(plant)
    frozen_s = max(sensor.frozen_s for sensor in plant.sensors)
    if plant.fits(frozen_s, "a frozen value"):
        yield plant.beyond(frozen_s), {}
    trims = plant.trims(0.5)
    left_s = plant.rules.longest_trim_s - 100.0 * plant.cycle_s
    yield 20, trims
    if left_s > plant.model.longest_gap_s:
        yield 1, {**trims, "cycle_time_s": left_s}
        yield 150, trims
    elif plant.fits(plant.rules.longest_trim_s, "a trim that expires"):
        yield plant.beyond(plant.rules.longest_trim_s), trims
    if plant.fits(LONG_ROW_CALLS * plant.cycle_s, f"{LONG_ROW_CALLS} calls without a change"):
        yield LONG_ROW_CALLS + LONG_ROW_CALLS // 2, trims
    plant.goal_c = [now_c + 0.5 for now_c in plant.now_c]
    yield from _jump(plant)
    yield plant.ready_s(), {}
