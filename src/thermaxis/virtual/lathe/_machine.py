"""The virtual vertical lathe: a machine in a program, stepped through time.

Not protected: it is a simulation. Its numbers are plausible, they are those of no machine, and
what holds on it is proven on it alone.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Final, TypeAlias, final
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from thermaxis.errors import ConfigurationError, require_known, require_range
from thermaxis.virtual.lathe._axis import OffsetAxis, OffsetRules
from thermaxis.virtual.lathe._faults import OF_NETWORK, Fault, FaultKind
from thermaxis.virtual.lathe._hall import HELD_S, Hall, HallSettings
from thermaxis.virtual.lathe._physics import Boundary, LatheDuty, LathePhysics, Node
from thermaxis.virtual.lathe._scenarios import Scenario, Stage, scenario_named, seen_at
from thermaxis.virtual.lathe._signals import (
    FAULTY,
    FLAGS,
    GOOD,
    HALL,
    NOT_SEEN,
    PROBES,
    SENSORS,
    SETTABLE,
    SIGNALS,
    TRUE,
    UNCORRECTED,
    LatheReading,
    SensorNoise,
    counted,
)

if TYPE_CHECKING:
    from thermaxis.virtual.lathe._network import ThermalNetwork

FloatArray: TypeAlias = NDArray[np.float64]

DEFAULT_SCENARIO: Final = "day"
"""Scenario of a machine for which none is named."""
_MOST_NETWORKS = 256
_SAME_S = 1e-9
_OF_CHANNELS = frozenset(FaultKind) - OF_NETWORK - {FaultKind.SET}
_ARITHMETIC: Final[Mapping[FaultKind, Callable[[float, float, float], float]]] = {
    FaultKind.JUMP: lambda value, by, _hours: value + by,
    FaultKind.DRIFT: lambda value, by, hours: value + by * hours,
    FaultKind.SCALE: lambda value, by, _hours: value * by,
}
_TOUCH: Final = "touch_um"
_BAD_STATUS = {
    FaultKind.BAD: ("BadSensorFailure", 0.0),
    FaultKind.MISSING: ("BadNoCommunication", None),
}


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LatheSettings:
    """What a virtual lathe is made of. Every default is an assumption of plausible size."""

    physics: LathePhysics = field(default_factory=LathePhysics)
    hall: HallSettings = field(default_factory=HallSettings)
    """How the hall's temperature moves."""
    offset: OffsetRules = field(default_factory=OffsetRules)
    """Rules of the machine for its offset."""
    temperature_noise_k: float = 0.02
    """Noise of the temperature sensors before rounding, standard deviation. [K]"""
    temperature_count_k: float = 0.1
    """Step of the temperature sensors, as in the paper. [K]"""
    displacement_noise_um: float = 0.3
    """Noise of the displacement probes, standard deviation. [µm]"""
    displacement_count_um: float = 0.1
    """Step of the displacement probes. [µm]"""
    touch_every_s: float | None = None
    """The machine's own probe touches so often, as soon as the table stands and the axis may move;
    None: only when it is asked. A touch takes no time. [s]"""
    touch_noise_um: float = 1.0
    """Noise of a touch, standard deviation. [µm]"""
    touch_count_um: float = 0.1
    """Step of what a touch shows. [µm]"""


@final
class VirtualLathe:
    """A vertical lathe with a thermal network of its own.

    Parameters
    ----------
    scenario : str or Scenario
        What it does. Default: the working day.
    seed : int
        Seed of the hall and of all noise: the same scenario and seed give the same run, however
        its time is stepped; another scenario has another day. [1]
    settings : LatheSettings, optional
        What it is made of.
    faults : sequence of Fault
        What goes wrong, and when.

    Raises
    ------
    ConfigurationError
        If there is no such scenario, the seed is negative, or a fault acts on what is not there.
    """

    def __init__(
        self,
        scenario: str | Scenario = DEFAULT_SCENARIO,
        seed: int = 1,
        settings: LatheSettings | None = None,
        faults: Sequence[Fault] = (),
    ) -> None:
        if seed < 0:
            raise ConfigurationError("negative", value=seed, key="seed")
        self.faults = _checked(faults)
        self.scenario = scenario_named(scenario) if isinstance(scenario, str) else scenario
        self.seed = seed
        self.settings = settings or LatheSettings()
        self.axis = OffsetAxis(self.settings.offset)
        physics = self.settings.physics
        seeds = (seed, crc32(self.scenario.name.encode()))
        self._hall = Hall(self.settings.hall, seeds, self.scenario.start_s)
        self._noise = SensorNoise(seeds, len(SENSORS) + len(PROBES))
        self._seeds = seeds
        self._touches = 0
        self._touched = LatheReading(0.0, GOOD, 0.0)
        self._touch_asked = False
        self._touch_due_s = math.inf if self.settings.touch_every_s is None else 0.0
        self._shape = physics.shape()
        self._temperature_c = self._hall.rest(physics)
        self._zero_um = self._shape @ self._temperature_c
        self._networks: dict[LatheDuty, ThermalNetwork] = {}
        self._time_s = 0.0
        self._segment_end_s = 0.0
        self._stage_number = -1
        self._stage: Stage = self.scenario.stages[0]
        self._cooler = False
        self._referenced = True
        self._diameter_mm = 0.0
        self._set: dict[str, float] = {}
        self._held: dict[Fault, Mapping[str, LatheReading]] = {}
        self._begin_segment()

    # ---- time ----

    @property
    def time_s(self) -> float:
        """Time since the begin of the scenario. [s]"""
        return self._time_s

    def step(self, seconds: float) -> None:
        """Let time go by; the result does not depend on how a time is divided into steps. [s]

        A negative or infinite time is refused.
        """
        require_range("step", seconds, 0, 1e9)
        target_s = self._time_s + seconds
        while True:
            stop_s = min(target_s, self._segment_end_s)
            self._advance(stop_s - self._time_s)
            self._time_s = stop_s
            if stop_s >= self._segment_end_s - _SAME_S:
                self._begin_segment()
            if stop_s >= target_s:
                return

    def step_to(self, time_s: float) -> None:
        """Let time go by until a time; nothing happens if it has passed. [s]"""
        if time_s > self._time_s:
            self.step(time_s - self._time_s)

    def _advance(self, seconds: float) -> None:
        if seconds <= 0.0:
            return
        self._temperature_c = self._network.after(
            self._temperature_c, self._heat_w, self._boundary_c, seconds
        )
        own = 0.0
        if self.flag("own_compensation"):
            rise_k = self._temperature_c[Node.SPINDLE_BEARING] - self._temperature_c[Node.COLUMNS]
            own = -self.settings.offset.own_um_per_k * float(rise_k)
        self.axis.step(
            seconds,
            moves=self._runs,
            permitted=self._moves_freely,
            own_goal_um=own,
        )

    def _begin_segment(self) -> None:
        """Find what the machine does from now on, and until when nothing changes."""
        now_s = self._time_s
        number, stage, end_s = self.scenario.stage_at(now_s + _SAME_S)
        if number != self._stage_number:
            self._enter(number, stage)
        self._note_faults()
        physics = self.settings.physics
        duty = self._duty()
        if duty not in self._networks:
            if len(self._networks) >= _MOST_NETWORKS:
                self._networks.clear()
            self._networks[duty] = physics.network(duty)
        self._network = self._networks[duty]
        self._heat_w = physics.heat_w(duty)
        grid_s = (math.floor((now_s + _SAME_S) / HELD_S) + 1.0) * HELD_S
        hall_c = self._hall.at(grid_s - 0.5 * HELD_S)
        self._boundary_c = np.array([hall_c, physics.foundation_c, physics.cooler_c])
        ends = [end_s, grid_s, *(f.next_change_s(now_s + _SAME_S) for f in self.faults)]
        if self._turning:
            ends.append(seen_at(now_s + _SAME_S)[1])
        due = self._touch_asked or now_s + _SAME_S >= self._touch_due_s
        if due and self._runs and self._moves_freely and self.table_seen:
            self._touch()
        if self._touch_due_s > now_s + _SAME_S:
            ends.append(self._touch_due_s)
        self._segment_end_s = min(ends)

    def _touch(self) -> None:
        """Touch, with the faults of now; the next touch of the plan is due after its interval."""
        settings, every_s = self.settings, self.settings.touch_every_s
        noise = float(np.random.default_rng([*self._seeds, 3, self._touches]).standard_normal())
        shown_um = float(self.true_um[0]) + settings.touch_noise_um * noise
        value = counted(shown_um, settings.touch_count_um)
        found = {**self.clean_readings(), _TOUCH: LatheReading(value, GOOD, self._time_s)}
        self._spoil_all(found, touches=True)
        self._touched, self._touches, self._touch_asked = found[_TOUCH], self._touches + 1, False
        if every_s is not None:
            self._touch_due_s = (math.floor((self._time_s + _SAME_S) / every_s) + 1.0) * every_s

    def _enter(self, number: int, stage: Stage) -> None:
        if self._stage.homing and not stage.homing:
            self._referenced = True
        if not stage.machine_on or stage.homing:
            self._referenced = False
        if self._stage_number < 0 or stage.diameter_mm != self._stage.diameter_mm:
            self._diameter_mm = stage.diameter_mm
        self._stage_number, self._stage = number, stage

    def _duty(self) -> LatheDuty:
        physics = self.settings.physics
        coolant_c = float(self._temperature_c[Node.COOLANT])
        if coolant_c >= physics.cooler_on_c:
            self._cooler = True
        elif coolant_c <= physics.cooler_off_c:
            self._cooler = False
        coolant = self.flag("coolant_on")
        return LatheDuty(
            spindle_rpm=self.spindle_rpm,
            gear=self._stage.gear_engaged,
            table_rpm=self.table_rpm,
            coolant=coolant,
            cooler=coolant and self._cooler,
        )

    # ---- what it does ----

    @property
    def _runs(self) -> bool:
        return self.flag("machine_on") and not self.flag("emergency_stop")

    @property
    def _moves_freely(self) -> bool:
        return self.flag("referenced") and not self.flag("homing")

    @property
    def _turning(self) -> bool:
        """Whether the table is asked to turn, short stops included."""
        return self._runs and self._stage.table_rpm != 0.0

    @property
    def spindle_rpm(self) -> float:
        """Speed of the spindle. [rpm]"""
        return self._stage.spindle_rpm if self._runs else 0.0

    @property
    def table_rpm(self) -> float:
        """Speed of the table; it is stopped now and then to be measured. [rpm]"""
        if not self._turning or seen_at(self._time_s + _SAME_S)[0]:
            return 0.0
        return self._stage.table_rpm

    @property
    def table_seen(self) -> bool:
        """Whether the table stands in the measuring location."""
        return self.table_rpm == 0.0

    @property
    def diameter_mm(self) -> float:
        """Diameter at which the workpiece is turned. [mm]"""
        return self._value_set("diameter_mm", self._diameter_mm)

    def flag(self, name: str) -> bool:
        """Return whether a flag of the machine is set: one of `FLAGS`, or ``coolant_on``."""
        own = {
            "machine_on": self._stage.machine_on,
            "referenced": self._referenced,
            "homing": self._stage.homing,
            "coolant_on": self._stage.coolant,
        }
        return bool(self._value_set(name, own.get(name, False)))

    def _value_set(self, name: str, own: float) -> float:
        for fault in self.faults:
            if fault.kind is FaultKind.SET and fault.channels[0] == name and self._acts(fault):
                return float(fault.amount or 0.0)
        return self._set.get(name, own)

    def _acts(self, fault: Fault) -> bool:
        return fault.begin_s(self._time_s + _SAME_S) is not None

    # ---- what is written ----

    def write_offset(self, offset_mm: float) -> bool:
        """Write the offset of the Z axis; positive moves the tool away from the workpiece. [mm]

        Returns whether it is a finite number; another one is not taken.
        """
        return self.axis.write_offset(offset_mm)

    def write_heartbeat(self, heartbeat: int) -> None:
        """Write the heartbeat; only a changed one counts. [1]"""
        self.axis.write_heartbeat(heartbeat)

    def write_diameter(self, diameter_mm: float) -> bool:
        """Write the workpiece's diameter, which stays until the scenario changes it. [mm]

        Returns whether it is a finite number from zero up; another one is not taken.
        """
        if not (math.isfinite(diameter_mm) and diameter_mm >= 0.0):
            return False
        self._diameter_mm = diameter_mm
        return True

    def ask_touch(self) -> None:
        """Let the machine touch as soon as it can."""
        self._touch_asked = True
        self._begin_segment()

    def set_flag(self, name: str, *, value: bool | None) -> None:
        """Set one of `FLAGS`, or ``coolant_on``, against the scenario; None gives it back.

        A name that is no flag is refused.
        """
        require_known("flag", [name], (*FLAGS, "coolant_on"))
        if value is None:
            self._set.pop(name, None)
        else:
            self._set[name] = float(value)
        self._begin_segment()

    def set_faults(self, faults: Sequence[Fault]) -> None:
        """Let this go wrong from now on, each at its times, in place of the faults before.

        A fault that acts on what is not there is refused.
        """
        self.faults = _checked(faults)
        self._held = {fault: held for fault, held in self._held.items() if fault in self.faults}
        self._begin_segment()

    # ---- what it shows ----

    @property
    def temperature_c(self) -> FloatArray:
        """True temperatures, (n,), in the order of `Node`. [°C]"""
        return self._temperature_c.copy()

    @property
    def hall_c(self) -> float:
        """True temperature of the hall's air. [°C]"""
        return float(self._boundary_c[Boundary.HALL])

    @property
    def uncorrected_um(self) -> FloatArray:
        """True displacement by position as it were without any offset, (4,). [µm]"""
        return self._shape @ self._temperature_c - self._zero_um

    @property
    def true_um(self) -> FloatArray:
        """True displacement by position with the offset that acts, (4,). [µm]

        It is the tool point relative to the workpiece, positive away from it.
        """
        return self.uncorrected_um + self.axis.effective_um + self.axis.own_um

    @property
    def reachable(self) -> bool:
        """Whether its server answers."""
        return self.network_fault is None

    @property
    def network_fault(self) -> FaultKind | None:
        """Fault of the way to the machine that acts now; a restart goes before a pause."""
        acting = [f.kind for f in self.faults if f.kind in OF_NETWORK and self._acts(f)]
        return min(acting, key=lambda kind: kind is FaultKind.PAUSE, default=None)

    def clean_readings(self) -> Mapping[str, LatheReading]:
        """Return every value as its sensor gives it, by the names in `SIGNALS`, without faults."""
        settings, now_s = self.settings, self._time_s
        noise = self._noise.at(now_s).tolist()
        values: dict[str, float | bool | None] = {}
        for k, (name, node) in enumerate(SENSORS.items()):
            true_c = self.hall_c if node == HALL else float(self._temperature_c[node])
            noisy = true_c + settings.temperature_noise_k * noise[k]
            values[name] = counted(noisy, settings.temperature_count_k)
        true_um, uncorrected_um = self.true_um.tolist(), self.uncorrected_um.tolist()
        seen = self.table_seen
        for k, name in enumerate(PROBES):
            noisy = true_um[k] + settings.displacement_noise_um * noise[len(SENSORS) + k]
            values[name] = counted(noisy, settings.displacement_count_um) if seen else None
        values |= zip(TRUE, true_um, strict=True)
        values |= zip(UNCORRECTED, uncorrected_um, strict=True)
        axis = self.axis
        values |= {
            _TOUCH: self._touched.value,
            "touch_count": float(self._touches),
            "touch_asked": self._touch_asked,
            "n_spindle_rpm": self.spindle_rpm,
            "n_table_rpm": self.table_rpm,
            "gear": float(self._stage.gear_engaged),
            "coolant_on": self.flag("coolant_on"),
            "table_seen": seen,
            "diameter_mm": self.diameter_mm,
            **{name: self.flag(name) for name in FLAGS},
            "offset_mm": axis.written_mm,
            "offset_accepted_mm": 1e-3 * axis.accepted_um,
            "offset_effective_mm": 1e-3 * axis.effective_um,
            "heartbeat": float(axis.heartbeat),
            "watchdog_alive": axis.alive,
            "time_s": now_s,
        }
        shown = {
            name: LatheReading(value, NOT_SEEN if value is None else GOOD, now_s)
            for name, value in values.items()
        }
        stamp_s = self._touched.stamp_s
        count = shown["touch_count"]._replace(stamp_s=stamp_s)
        return {**shown, _TOUCH: self._touched, "touch_count": count}

    def readings(self) -> Mapping[str, LatheReading]:
        """Return every value as the machine shows it, with the faults that act on channels.

        What acts on ``touch_um`` acts on a touch when it is taken, which then stays.
        """
        found = dict(self.clean_readings())
        self._spoil_all(found, touches=False)
        return MappingProxyType(found)

    def _spoil_all(self, found: dict[str, LatheReading], *, touches: bool) -> None:
        for fault in self.faults:
            of_channel = fault.kind in _OF_CHANNELS and (_TOUCH in fault.channels) is touches
            if of_channel and self._acts(fault):
                self._spoil(found, fault)

    def _note_faults(self) -> None:
        """Keep what the channels showed when a fault began that holds them."""
        for fault in self.faults:
            if fault.kind not in {FaultKind.STUCK, FaultKind.STALE}:
                continue
            if not self._acts(fault):
                self._held.pop(fault, None)
            elif fault not in self._held:
                self._held[fault] = self.clean_readings()

    def _spoil(self, found: dict[str, LatheReading], fault: Fault) -> None:
        name = fault.channels[0]
        shown = found[name]
        if fault.kind is FaultKind.SWAP:
            other = fault.channels[1]
            found[name], found[other] = found[other], found[name]
        elif fault.kind is FaultKind.STUCK:
            found[name] = self._held[fault][name]._replace(stamp_s=self._time_s)
        elif fault.kind is FaultKind.STALE:
            found[name] = self._held[fault][name]
        elif fault.kind in _ARITHMETIC and shown.value is not None:
            amount, begin_s = fault.amount or 0.0, fault.begin_s(self._time_s + _SAME_S)
            hours = (self._time_s - (begin_s or 0.0)) / 3600.0
            value = _ARITHMETIC[fault.kind](shown.value, amount, max(0.0, hours))
            found[name] = shown._replace(value=round(value, 9))
        elif fault.kind is FaultKind.NAN:
            found[name] = shown._replace(value=math.nan, status=GOOD)
        elif fault.kind is FaultKind.UNCERTAIN:
            found[name] = shown._replace(status="UncertainSensorNotAccurate")
        elif fault.kind in _BAD_STATUS:
            status, value = _BAD_STATUS[fault.kind]
            found[name] = shown._replace(value=value, status=status)


def _checked(faults: Sequence[Fault]) -> tuple[Fault, ...]:
    for fault in faults:
        _check_fault(fault)
    return tuple(faults)


def _check_fault(fault: Fault) -> None:
    allowed = SETTABLE if fault.kind is FaultKind.SET else FAULTY
    require_known(f"fault {fault.kind}", fault.channels, allowed)
    for name in fault.channels:
        if fault.kind is not FaultKind.SET and SIGNALS[name].unit == "bool":
            raise ConfigurationError("fault_of_flag", name=name, key=f"fault {fault.kind}")
