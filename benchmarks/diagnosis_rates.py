"""How often the diagnosis names a planted fault first, and how often a healthy axis is accused.

Every run is measured on a virtual axis: 16 targets every 20 mm with a random part of 4 mm
(equation (1) of the paper), 300 mm/min, 2 s of dwell and 2 s of recording, noise of 0.4 µm. The
healthy axis has a straight-line error of 1 µm/m, smooth waves with an amplitude of 0.3 µm at
most, a periodic error of 0.1 µm and a reversal value of -0.5 µm that varies by 0.1 µm. It warms
up: a structure by 3 to 8 µm and the screw by 10 to 30 µm/m, with time constants between 15
minutes and 3 hours; the hall swings. In the lines `paper` two structures warm up against each
other, as in the paper's figure 7: there the drift turns back, which is a finding of its own.

first   planted fault named first
named   planted fault named at all
none    nothing named (what the healthy axis shall be)
period  period named right, or among those that the targets cannot tell from it
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from thermaxis.messages import sentence_of
from thermaxis.positioning import PositioningTest, diagnose, evaluate_drift
from thermaxis.positioning.diagnosis import COMMON_PITCHES_MM
from thermaxis.virtual import (
    AxisGeometry,
    AxisThermal,
    LocalSpread,
    ReadingScatter,
    RunPlan,
    VirtualAxis,
    WarmUp,
    generate_positioning_run,
)

NOISE_UM = 0.4


def warming(random: np.random.Generator, *, turns_back: bool) -> AxisThermal:
    """Return a drift: in one direction everywhere, or with two structures against each other."""
    sign = float(random.choice([-1.0, 1.0]))
    fast_s, slow_s = 3600.0 * random.uniform(0.25, 0.8), 3600.0 * random.uniform(0.8, 3.0)
    first, second = sign * random.uniform(3.0, 8.0, 2)
    structure = (WarmUp(first, fast_s), WarmUp(-1.5 * second, slow_s))
    return AxisThermal(
        structure=structure if turns_back else (WarmUp(abs(first), fast_s),),
        screw_expansion_um_per_m=random.uniform(10.0, 30.0),
        screw_time_constant_s=3600.0 * random.uniform(0.3, 3.0),
        fixed_bearing=-40.0,
        hall_swing_k=0.2,
        hall_sensitivity=0.4,
    )


def healthy_axis(seed: int, cycles: int, *, turns_back: bool = False) -> VirtualAxis:
    """Return an axis without fault."""
    random = np.random.default_rng([7, seed])
    return VirtualAxis(
        plan=RunPlan(random_part=4.0, cycles=cycles, recording_s=2.0),
        geometry=AxisGeometry(
            straight_line_um_per_m=1.0,
            pitch_error=0.3,
            periodic_error=0.1,
            reversal=-0.5,
            reversal_variation=0.05,
        ),
        thermal=warming(random, turns_back=turns_back),
        scatter=ReadingScatter(noise=NOISE_UM),
    )


def measured(axis: VirtualAxis, seed: int) -> PositioningTest:
    """Return the run of an axis."""
    return generate_positioning_run(axis, seed=seed).test


def planted_period_mm(seed: int) -> float:
    """Return the pitch of the screw that is planted with a seed."""
    return COMMON_PITCHES_MM[seed % len(COMMON_PITCHES_MM)]


def _healthy(axis: VirtualAxis, seed: int) -> PositioningTest:
    return measured(axis, seed)


def _scale(axis: VirtualAxis, seed: int) -> PositioningTest:
    sign = 1.0 if seed % 2 else -1.0
    geometry = replace(axis.geometry, straight_line_um_per_m=20.0 * sign)
    return measured(replace(axis, geometry=geometry), seed)


def _periodic(axis: VirtualAxis, seed: int) -> PositioningTest:
    geometry = replace(axis.geometry, periodic_error=2.0, period=planted_period_mm(seed))
    return measured(replace(axis, geometry=geometry), seed)


def _step(axis: VirtualAxis, seed: int) -> PositioningTest:
    """Add 3 µm to the backlash from a target on, in the backward approach alone."""
    test = measured(axis, seed)
    deviation = test.deviation.copy()
    deviation[2 + seed % 13 :, :, 1] += 3.0
    return replace(test, deviation=deviation)


def _spread(axis: VirtualAxis, seed: int) -> PositioningTest:
    """Double the standard deviation of one target."""
    local = (LocalSpread(1 + seed % 16, float(np.sqrt(3.0)) * NOISE_UM),)
    return measured(replace(axis, scatter=replace(axis.scatter, local=local)), seed)


PLANTED: dict[str, tuple[str, Callable[[VirtualAxis, int], PositioningTest]]] = {
    "healthy": ("", _healthy),
    "20 µm/m": ("scale_error", _scale),
    "periodic 2 µm": ("periodic_error", _periodic),
    "backlash step 3 µm": ("backlash_step", _step),
    "doubled spread": ("spread", _spread),
}


def rates(
    name: str, cycles: int, seeds: range, *, turns_back: bool = False, without_drift: bool = False
) -> tuple[float, float, float, float, float]:
    """Return the percentages first, named, none, period and the seconds per diagnosis."""
    key, plant = PLANTED[name]
    first = named = none = period = 0
    seconds = 0.0
    for seed in seeds:
        test = plant(healthy_axis(seed, cycles, turns_back=turns_back), seed)
        drift = None if without_drift else evaluate_drift(test)
        since = time.perf_counter()
        found = diagnose(test, drift)
        seconds += time.perf_counter() - since
        keys = [finding.finding for finding in found]
        first += keys[:1] == [key]
        named += key in keys
        none += not keys
        text = " ".join(
            sentence_of(one.message) for one in found if one.finding == "periodic_error"
        )
        period += f" {planted_period_mm(seed):g} mm" in text
    share = 100.0 / len(seeds)
    return first * share, named * share, none * share, period * share, seconds / len(seeds)


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--cycles", type=int, nargs="+", default=[5, 10, 20, 30])
    parser.add_argument("--without-drift", action="store_true", help="diagnose the plain means")
    arguments = parser.parse_args()
    seeds = range(arguments.seeds)
    print(f"seeds 0 to {arguments.seeds - 1}")
    print(
        f"{'planted':20}{'drift':>7}{'cycles':>8}{'first':>7}{'named':>7}{'none':>7}{'period':>8}"
        f"{'ms':>7}"
    )
    for turns_back in (False, True):
        for name in PLANTED:
            for cycles in arguments.cycles:
                first, named, none, period, seconds = rates(
                    name,
                    cycles,
                    seeds,
                    turns_back=turns_back,
                    without_drift=arguments.without_drift,
                )
                numbers = f"{first:7.0f}{named:7.0f}{none:7.0f}{period:8.0f}{1000 * seconds:7.1f}"
                drift = "paper" if turns_back else "warm"
                print(f"{name:20}{drift:>7}{cycles:8d}{numbers}", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
