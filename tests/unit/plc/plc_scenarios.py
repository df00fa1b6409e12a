"""Random compensations for a PLC, a plant with moods, and `cycle` driven as the block is."""

import math
import random
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from thermaxis.compensation import (
    Compensation,
    CompensationModel,
    CycleOutput,
    GainPoint,
    Limits,
    Outcome,
    Output,
    Part,
    Reason,
    Section,
    SensorRules,
    SupervisorRules,
    SupervisorState,
    TouchRules,
)
from thermaxis.files import read_model
from thermaxis.plc import CycleBlock, PlcSettings, PlcStep, export_settings
from thermaxis.plc.vectors import ODD

STATES = list(SupervisorState)
REASONS = list(Reason)
OUTCOMES = list(Outcome)
MODELS = Path(__file__).parents[3] / "examples" / "models"

DURATIONS = (
    "settle_s", "recovery_delay_s", "input_timeout_s", "hold_input_s", "hold_connection_s",
    "hold_interlock_s", "hold_operator_s", "at_limit_s", "read_back_s", "longest_trim_s",
)  # fmt: skip
QUICK = SupervisorRules(
    settle_s=6.0,
    recovery_delay_s=2.0,
    input_timeout_s=1.5,
    hold_input_s=9.0,
    hold_connection_s=8.0,
    hold_interlock_s=3.0,
    hold_operator_s=15.0,
    at_limit_s=12.0,
    read_back_s=4.0,
    longest_trim_s=20.0,
)


def random_settings(
    seed: int, *, cycle_s: float = 1.0, double: bool = True, quick: bool = True
) -> PlcSettings:
    """1 to 8 sections, 1 to 4 channels, 1 or 2 outputs; gains, delays, filter, both references."""
    rng = random.Random(seed)  # noqa: S311 - a test that can be repeated
    channels = [f"T_{k}_C" for k in range(rng.randint(1, 4))]
    sections_left = rng.randint(1, 8)
    outputs: list[Output] = []
    for name in ("Z_um", "X_um")[: rng.randint(1, 2)]:
        parts: list[Part] = []
        for k in range(rng.randint(1, 3)):
            number = rng.randint(0, sections_left)
            if not outputs and not parts:
                number = max(number, 1)
            sections_left -= number
            plus, *others = rng.sample(channels, len(channels))
            low, high = sorted((rng.uniform(-12.0, -3.0), rng.uniform(3.0, 14.0)))
            ranged = rng.random() < 0.3
            points = (GainPoint(20.0, 0.4), GainPoint(100.0, 0.9), GainPoint(333.0, 1.7))
            parts.append(
                Part(
                    f"part {k}",
                    plus,
                    others[0] if others and rng.random() < 0.5 else "",
                    rng.choice((0.0, rng.uniform(-4.0, 4.0))) if number else rng.uniform(1.0, 4.0),
                    tuple(
                        Section(rng.uniform(-6.0, 6.0), 10 ** rng.uniform(0.5, 4.5))
                        for _ in range(number)
                    ),
                    delay_s=rng.choice((0.0, 0.0, 1.0, 7.0)) * cycle_s,
                    gain_by_diameter=points[: rng.randint(1, 3)] if rng.random() < 0.4 else (),
                    tool_gain=rng.uniform(0.5, 1.5),
                    lowest_k=low if ranged else None,
                    highest_k=high if ranged else None,
                )
            )
        outputs.append(Output(name, tuple(parts), rng.choice((0.0, rng.uniform(-2.0, 2.0)))))
    used = {c for o in outputs for p in o.parts for c in (p.plus, p.minus) if c}
    stated = rng.random() < 0.5
    model = CompensationModel(
        outputs=tuple(outputs),
        reference="stated" if stated else "start",
        reference_c={c: rng.uniform(18.0, 24.0) for c in sorted(used)} if stated else {},
        input_filter_s=rng.choice((0.0, 0.0, 20.0)),
        longest_hold_s=rng.choice((3.0, 60.0)) if quick else 60.0,
    )
    sensors = {
        c: SensorRules(
            lowest_c=rng.uniform(1.0, 5.0),
            highest_c=rng.uniform(45.0, 70.0),
            largest_rate_k_per_s=rng.uniform(0.05, 0.3),
            step_k=rng.choice((0.0, 0.5, 1.0)),
            frozen_s=rng.choice((0.0, 90.0, 200.0)) if quick else 14_400.0,
        )
        for c in model.channels
    }
    limits = {
        o.name: Limits(
            largest,
            rng.uniform(0.2, 3.0),
            largest * rng.choice((1.0, 1.2)),
            deadband_um=rng.choice((0.0, 0.3)),
        )
        for o in outputs
        for largest in [rng.uniform(8.0, 60.0)]
    }
    compensation = Compensation(
        model=model,
        sensors=sensors,
        limits=limits,
        supervisor=QUICK if quick else SupervisorRules(),
        interlocks=("plc",),
        validity_margin_k=rng.choice((2.0, 5.0)),
        lowest_weight=rng.choice((0.0, 0.25)),
    )
    return export_settings(compensation, cycle_s=cycle_s, name=f"random {seed}", double=double)


def with_witness(settings: PlcSettings, seed: int) -> PlcSettings:
    """Let a sensor move with another one: before it, behind it, or beside the model; or none."""
    compensation = settings.compensation
    first, *_, last = (*compensation.model.channels, compensation.model.channels[-1])
    moved, other = ((first, "air"), (first, last), (last, first), ("", ""))[seed % 4]
    if moved == other:
        return settings
    sensors = dict(compensation.sensors)
    own = sensors[moved]
    frozen_s = own.frozen_s or 6.0 * settings.cycle_s
    sensors[moved] = replace(own, moves_with=other, rests_k=0.02 * (1 + seed), frozen_s=frozen_s)
    beside = sensors.get(other, own)
    sensors[other] = replace(beside, frozen_s=beside.frozen_s or 20.0 * settings.cycle_s)
    return replace(settings, compensation=replace(compensation, sensors=sensors))


def with_touches(settings: PlcSettings, seed: int) -> PlcSettings:
    """Let the first output be touched, or every one, by a quick or a slow filter."""
    rng = random.Random(seed)  # noqa: S311 - a test that can be repeated
    compensation = settings.compensation
    outputs = compensation.model.outputs
    cycle_s = settings.cycle_s
    touches = {
        output.name: TouchRules(
            limits=Limits(
                min(rng.uniform(2.0, 8.0), compensation.limits[output.name].total_um),
                rng.uniform(0.05, 2.0) / cycle_s,
            ),
            noise_um=rng.choice((0.3, 1.0)),
            drift_um_per_root_h=rng.choice((2.0, 30.0)),
            discrepancy_um=rng.choice((0.0, 0.7)),
            start_um=rng.choice((5.0, 20.0)),
            gate=rng.choice((2.0, 3.0)),
            ramp_um_per_h=rng.choice((0.0, 10.0)),
            confirm_s=rng.choice((4.0, 30.0)) * cycle_s,
            acts=seed % 4 != 0,
        )
        for output in outputs[: rng.choice((1, len(outputs)))]
    }
    return replace(settings, compensation=replace(compensation, touches=touches))


def touched_stems(settings: PlcSettings) -> list[str]:
    """Return the names of the outputs that are touched."""
    rows = zip(settings.names.outputs, settings.compensation.probed, strict=True)
    return [stem for stem, own in rows if own is not None]


def paper_model(name: str) -> CompensationModel:
    return read_model(MODELS / f"{name}.json")


def wide(model: CompensationModel, *, double: bool) -> PlcSettings:
    """Limits that the course never meets, so that the correction is minus the model."""
    compensation = Compensation(
        model=model,
        sensors={c: SensorRules(lowest_c=1.0, highest_c=80.0) for c in model.channels},
        limits={o.name: Limits(5000.0, 500.0) for o in model.outputs},
        interlocks=("plc",),
    )
    return export_settings(compensation, cycle_s=1.0, name="axis", double=double)


def corrections_of(settings: PlcSettings, said: Mapping[str, Any]) -> tuple[float, ...]:
    """Return the corrections of a call by output. [µm]"""
    return tuple(said[f"correction_{stem}"] for stem in settings.names.outputs)


class MoodPlant:
    """A seeded plant that keeps its moods for some calls, so that every state is visited."""

    def __init__(self, settings: PlcSettings, seed: int) -> None:
        self.rng = random.Random(seed)  # noqa: S311 - a seeded plant
        self.settings = settings
        channels, outputs = settings.names.channels, settings.names.outputs
        self.temperature = [20.0 + self.rng.random() for _ in channels]
        self.drift = [0.0] * len(channels)
        # What stands in the control before the first call, now and then beyond the limits.
        self.sent = [self.rng.choice((0.0, 0.0, 1.5, -3.0, 40.0)) for _ in outputs]
        self.moods: dict[str, bool] = {}
        self.level = {"enable": False, "hold": False}
        self.trims = [0.0] * len(outputs)
        self.diameter: tuple[float, bool] = (0.0, False)
        self.wrong_um = 0.0
        self.probed = dict.fromkeys(touched_stems(settings), (0.0, 0, 0.0))
        self.offset_um = self.rng.uniform(-6.0, 6.0) if self.probed else 0.0
        self.said: Mapping[str, Any] = {}

    def mood(self, name: str, begin: float, end: float) -> bool:
        now = self.moods.get(name, False)
        self.moods[name] = self.rng.random() >= end if now else self.rng.random() < begin
        return self.moods[name]

    def write(self, said: Mapping[str, Any]) -> None:
        """Take what the block says; in Off or out of reach somebody else may set an offset."""
        if said["linked"] and said["state"] != 0:
            self.sent = list(corrections_of(self.settings, said))
        elif self.rng.random() < 0.1:
            self.sent = [self.rng.choice((0.0, 1.5, -3.0, 4.0, 40.0)) for _ in self.sent]

    def inputs(self) -> dict[str, Any]:
        """Return what the block is told in a call; `sent` holds what stands in the control."""
        rng, settings = self.rng, self.settings
        calm = self.mood("calm", 0.01, 0.01)
        told: dict[str, Any] = {"cycle_time_s": settings.cycle_s * rng.uniform(0.92, 1.08)}
        if self.mood("late", 0.01, 0.5) and not calm:
            told["cycle_time_s"] = settings.cycle_s * rng.choice(
                (0.89, 1.11, 37.5, 0.0, math.nan, 1e30, 1e4)
            )
        for name, begin, end in (("enable", 0.15, 0.01), ("hold", 0.02, 0.15)):
            if rng.random() < (end if self.level[name] else begin) and not (
                calm and name == "hold"
            ):
                self.level[name] = not self.level[name]
            told[name] = self.level[name]
        told["reset"] = rng.random() < 0.06
        if rng.random() < 0.05:
            value = rng.choice((*ODD, 5.0, 100.0, 500.0, 899.0, 1e5, 1e6, -1.0))
            self.diameter = (value, rng.random() < 0.7)
        told["diameter_mm"], told["diameter_known"] = self.diameter
        self._temperatures(told, calm)
        for k, stem in enumerate(settings.names.outputs):
            if rng.random() < 0.03:
                self.trims[k] = rng.choice((0.0, 1.0, -2.5, 3.0, 3.1, math.nan, math.inf, 1e300))
            told[f"trim_{stem}"] = self.trims[k]
        told["interlocks_met"] = calm or not self.mood("open", 0.02, 0.2)
        told["connected"] = calm or not self.mood("lost", 0.02, 0.2)
        told["other_compensation"] = self.mood("other", 0.005, 0.4) and not calm
        self._read_back(told, calm)
        self._touch(told)
        return told

    def _touch(self, told: dict[str, Any]) -> None:
        """Touch now and then: right, wild, twice the same, late, no number, with a wrong sign."""
        wrong = bool(self.probed) and self.mood("wrong touches", 0.01, 0.02)
        if self.probed:
            told["touches_act"] = not self.mood("only shown", 0.02, 0.1)
            told["datum"] = self.rng.random() < 0.01
        for stem in self.probed:
            if self.said and self.rng.random() < (0.4 if wrong else 0.15):
                self.probed[stem] = self._probed(stem, -1.0 if wrong else 1.0)
            names = (f"touch_{stem}", f"count_{stem}", f"age_{stem}")
            told |= dict(zip(names, self.probed[stem], strict=True))

    def _probed(self, stem: str, sign: float) -> tuple[float, int, float]:
        rng, cycle_s = self.rng, self.settings.cycle_s
        names = (f"correction_{stem}", f"weight_{stem}", f"model_{stem}")
        correction_um, weight, model_um = (self.said[name] for name in names)
        wild = rng.choice((0.0, 0.0, 0.0, 0.0, 0.0, 40.0, 40.3, -300.0))
        value_um = sign * (correction_um + weight * model_um + self.offset_um) + wild
        value_um = rng.choice(ODD) if rng.random() < 0.03 else value_um + rng.gauss(0.0, 0.5)
        ages = (0.0, 0.5, 1.0, 1.5, 2.0, 5.0, 40.5)
        odd = (64.0, 65.0, 63.5, -1.0, 1e30, math.nan, math.inf)
        age_s = cycle_s * rng.choice(odd if rng.random() < 0.05 else ages)
        count = self.probed[stem][1]
        return value_um, rng.choice((count, count + 1, count + 1, count + 1, -32_768)), age_s

    def _temperatures(self, told: dict[str, Any], calm: bool) -> None:
        rng = self.rng
        fast = self.mood("fast", 0.02, 0.1)
        for k, stem in enumerate(self.settings.names.channels):
            if rng.random() < 0.03:
                self.drift[k] = rng.choice((-0.12, -0.02, 0.0, 0.02, 0.12)) * (3 if fast else 1)
            frozen = self.mood(f"frozen {k}", 0.01, 0.04) and not calm
            if not frozen:
                self.temperature[k] += self.drift[k] + rng.gauss(0.0, 0.01)
                if not 15.0 < self.temperature[k] < 30.0:
                    self.drift[k] = math.copysign(0.05, 20.0 - self.temperature[k])
            value = self.temperature[k]
            if not calm and self.mood(f"odd {k}", 0.01, 0.3):
                value = rng.choice(ODD)
            if not calm and self.mood(f"jump {k}", 0.005, 0.1):
                value += 6.0
            told[f"t_{stem}"] = value
            told[f"ok_{stem}"] = calm or not self.mood(f"status {k}", 0.01, 0.25)

    def _read_back(self, told: dict[str, Any], calm: bool) -> None:
        rng = self.rng
        if self.mood("differs", 0.01, 0.15) and not calm:
            if self.wrong_um == 0.0:
                self.wrong_um = rng.choice((0.4, -3.0, 5.0, 50.0))
        else:
            self.wrong_um = 0.0
        for k, stem in enumerate(self.settings.names.outputs):
            value = self.sent[k] + self.wrong_um
            if self.mood("unreadable", 0.005, 0.3) and not calm:
                value = rng.choice((math.nan, math.inf, 2e6, -2e6))
            told[f"read_{stem}"] = value
        told["read_ok"] = calm or not self.mood("unread", 0.01, 0.3)

    def steps(self, block: CycleBlock, calls: int) -> Iterator[PlcStep]:
        """Yield calls of a block; the PLC is switched off and on now and then."""
        for call in range(calls):
            init = call > 0 and self.rng.random() < 0.004
            told = self.inputs() | {"init": init}
            said = self.said = block.step(told)
            self.write(said)
            yield PlcStep(told, said)


def quiet_inputs(
    settings: PlcSettings, values: list[float], sent: tuple[float, ...]
) -> dict[str, Any]:
    """Return what the block is told where everything is well and it is enabled."""
    told: dict[str, Any] = {
        "init": False,
        "cycle_time_s": settings.cycle_s,
        "enable": True,
        "hold": False,
        "reset": False,
        "diameter_mm": 0.0,
        "diameter_known": False,
        "interlocks_met": True,
        "connected": True,
        "other_compensation": False,
        "read_ok": True,
    }
    for stem, value in zip(settings.names.channels, values, strict=True):
        told |= {f"t_{stem}": value, f"ok_{stem}": True}
    for stem, value in zip(settings.names.outputs, sent, strict=True):
        told |= {f"trim_{stem}": 0.0, f"read_{stem}": value}
    for stem in touched_stems(settings):
        told |= {f"touch_{stem}": 0.0, f"count_{stem}": 0, f"age_{stem}": 0.0}
        told |= {"touches_act": True, "datum": False}
    return told


def scenario_steps(settings: PlcSettings, *, hours: float, seed: int) -> Iterator[PlcStep]:
    """Yield hours without a fault: a warm-up of three, then a wave and noise; enabled."""
    rng = random.Random(seed)  # noqa: S311 - a test that can be repeated
    block, sent = CycleBlock(settings), (0.0,) * len(settings.names.outputs)
    for call in range(round(hours * 3600.0 / settings.cycle_s)):
        seconds = call * settings.cycle_s
        values = [
            20.0
            + (6.0 + 1.5 * k) * min(seconds / 10_800.0, 1.0)
            + 1.5 * math.sin(math.tau * seconds / (5400.0 + 900.0 * k))
            + rng.uniform(-0.05, 0.05)
            for k in range(len(settings.names.channels))
        ]
        told = quiet_inputs(settings, [round(t, 2) for t in values], sent) | {"enable": call > 0}
        said = block.step(told)
        sent = corrections_of(settings, said)
        yield PlcStep(told, said)


class CycleDriver:
    """`cycle` called as the block is, with what it says itself."""

    def __init__(self, settings: PlcSettings) -> None:
        self.settings, self._block, self.calls = settings, CycleBlock(settings), 0

    def told(self, told: Mapping[str, Any]) -> CycleOutput:
        """Do a call whose inputs are stated by the names of the block."""
        self._said = self._block.step(told)
        self.calls += 1
        assert self._block.cycle_output is not None
        return self._block.cycle_output

    def by_name(self) -> dict[str, Any]:
        """Return what was said last by the names of the block."""
        return self._said
