"""The axis behind the drive, as a HAL component: it has errors that the control does not know of.

LinuxCNC starts this file with the distribution's own Python, which has the module `hal`. The
realtime component `sampler` hands over every servo period, none is lost unseen. Each row of
``trace.bin`` is one servo period, as float64 in machine order: number of the period [1], what the
sampler has of joint 0, namely commanded position [mm], commanded velocity [mm/s], position of the
motor [mm] and ramped correction [mm], then processor clocks since the period before [1], the
correction of each joint [mm], the commanded position of joint 2 [mm], and last the true position of
the axis [mm].
"""

import json
import math
import signal
import struct
import time
from pathlib import Path

import hal

SAMPLED = "ffffu" + 7 * "f"
ROW = struct.Struct(f"={len(SAMPLED) + 2}d")
PAUSE_S = 0.02


class Axis:
    """Screw with bow, periodic error and play, on a machine that warms up."""

    def __init__(self, physics: dict[str, float], period_s: float) -> None:
        self.physics = physics
        self.period_s = period_s
        self.first_motion: float | None = None
        self.carriage_mm: float | None = None

    def position_mm(self, number: float, velocity: float, motor_mm: float) -> float:
        """Return where the carriage truly stands."""
        if self.first_motion is None and velocity != 0.0:
            self.first_motion = number
        since = 0.0 if self.first_motion is None else number - self.first_motion
        nut_mm = self.behind_the_play(motor_mm)
        return nut_mm + 1e-3 * (self.screw_um(nut_mm) + self.drift_um(nut_mm, since))

    def behind_the_play(self, motor_mm: float) -> float:
        half = 0.5e-3 * self.physics["reversal_um"]
        before = motor_mm if self.carriage_mm is None else self.carriage_mm
        self.carriage_mm = min(max(before, motor_mm - half), motor_mm + half)
        return self.carriage_mm

    def screw_um(self, at_mm: float) -> float:
        p = self.physics
        u = (at_mm - p["low_mm"]) / (p["high_mm"] - p["low_mm"])
        wave = math.sin(2.0 * math.pi * (at_mm - p["low_mm"]) / p["pitch_mm"])
        return 4.0 * p["bow_um"] * u * (1.0 - u) + p["periodic_um"] * wave

    def drift_um(self, at_mm: float, periods: float) -> float:
        p = self.physics
        time_s = p["thermal_time_s"] + (periods * self.period_s if p["warms_up"] else 0.0)
        common = p["drift_um"] * (1.0 - math.exp(-time_s / p["drift_time_constant_s"]))
        warm = 1.0 - math.exp(-time_s / p["expansion_time_constant_s"])
        share = (at_mm - p["low_mm"]) / (p["high_mm"] - p["low_mm"])
        return common + p["expansion_um"] * share * warm


def main() -> None:
    """Follow the motor until LinuxCNC ends."""
    ended: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: ended.append(number))
    job = json.loads(Path("job.json").read_text(encoding="ascii"))
    component = hal.component("virtual-axis")
    component.newpin("position", hal.HAL_FLOAT, hal.HAL_OUT)
    component.newpin("lost", hal.HAL_S32, hal.HAL_OUT)
    component.ready()
    samples = hal.stream(component, hal.sampler_base, SAMPLED)
    axis = Axis(job["physics"], job["period_s"])
    with Path("trace.bin").open("wb") as trace:
        while not ended:
            follow(samples, axis, component, trace)
            time.sleep(PAUSE_S)


def follow(samples: object, axis: Axis, component: object, trace: object) -> None:
    """Write every servo period since the last call, and show where the axis is now."""
    while samples.readable:
        values = samples.read()
        number = float(samples.sampleno)
        position = axis.position_mm(number, values[1], values[2])
        component["position"] = position
        trace.write(ROW.pack(number, *values, position))
    component["lost"] = samples.num_overruns
    trace.flush()


if __name__ == "__main__":
    main()
