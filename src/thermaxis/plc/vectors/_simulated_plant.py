"""The simulated plant around an exported block: machine, sensors and people.

It is closed: what the machine reports as its offset follows what the block has written in the call
before. It is made of sums and products alone: the same settings give the same inputs on every
computer.
"""

from collections.abc import Sequence
from itertools import product
from typing import Any, final

from thermaxis.compensation import STATED, Part, Reason, SupervisorState, TouchOutcome
from thermaxis.plc._interface import NEVER_TOUCHED
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.vectors._reference import CycleBlock, JudgedBlock, PlcStep

# Of the read-back's tolerance: least squares through positions may enlarge what a control rounds.
_NEAR_SHARE = 0.4
_STEP_C = 0.01
_OFF = list(SupervisorState).index(SupervisorState.OFF)
_MARGIN_CALLS = 3
_SHARES = (0.95, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12, 0.08, 0.05, 0.03)
_HALVINGS = 12
_ALIVE_K = 0.03
_GRID_UM = 1024.0


@final
class SimulatedPlant:
    """Machine, sensors and people around the block; little changes between calls."""

    def __init__(
        self,
        settings: PlcSettings,
        block: CycleBlock | JudgedBlock,
    ) -> None:
        compensation = settings.compensation
        self.rules, self.model = compensation.supervisor, compensation.model
        self.bounds, self.sensors = compensation.bounds, compensation.rules
        self.cycle_s = settings.cycle_s
        self._judged = compensation.judged
        self.base_c = [self._base_c(k) for k in range(len(compensation.judged))]
        bases = zip(compensation.judged, self.base_c, strict=True)
        stated = self.model.reference == STATED
        self._zero_c = [
            self.model.reference_c.get(name, base_c) if stated else base_c for name, base_c in bases
        ]
        self.goal_c = list(self.base_c)
        self.now_c = list(self.base_c)
        self.init = False
        self.calls_left = 0
        self._reached: set[tuple[str, bool]] = set()
        self._faults = 0
        self._states: set[int] = set()
        self._touched: set[tuple[str, int]] = set()
        self._unfit: list[str] = []
        self.alive = self._up = False
        self._stood = 0
        self._block = block
        self._margin_k = compensation.validity_margin_k
        self._lowest_weight = compensation.lowest_weight
        self._near_um = _NEAR_SHARE * compensation.supervisor.read_back_tolerance_um
        self.offset_um = [0.0] * len(self.bounds)
        self._reported_um = [0.0] * len(self.bounds)
        self._names, self.outputs = settings.names, settings.names.outputs
        self._usual: dict[str, Any] = {
            "enable": False,
            "hold": False,
            "reset": False,
            "cycle_time_s": settings.cycle_s,
            "diameter_mm": 0.0,
            "diameter_known": False,
            "interlocks_met": True,
            "connected": True,
            "other_compensation": False,
            "read_ok": True,
            **self.told("ok", [True] * len(self.base_c)),
            **self.trims(0.0),
        }
        rows = zip(self.outputs, compensation.probed, strict=True)
        self.touched = {stem: own.limits for stem, own in rows if own is not None}
        if self.touched:
            self._usual |= {"touches_act": True, "datum": False}
        for stem in self.touched:
            self._usual |= {f"touch_{stem}": 0.0, f"count_{stem}": 0, f"age_{stem}": 0.0}
        self.usual = dict(self._usual)
        self._new = True
        self.said: dict[str, Any] = {}
        """What the block has said in the last call."""

    def _base_c(self, k: int) -> float:
        """Return a usual temperature of a channel: its reference, or somewhere in its range."""
        rules = self.sensors[k]
        middle_c = 0.5 * (rules.lowest_c + rules.highest_c)
        base_c = self.model.reference_c.get(self._judged[k], min(20.0, middle_c))
        return base_c if rules.lowest_c < base_c < rules.highest_c else middle_c

    # ---- calls ----------------------------------------------------------------------------------

    def step(self, **different: object) -> PlcStep:
        """Let a call go by in which some inputs differ from the usual."""
        self._stay_alive()
        inputs = {
            **self.usual,
            **self.told("t", [round(t / _STEP_C) * _STEP_C for t in self.now_c]),
            **self.told("read", self._reported()),
            "init": self.init,
            **different,
        }
        self.init = False
        self.said = self._block.step(inputs)
        stems = self.outputs
        if self.said["linked"] and self.said["state"] != _OFF:
            self.offset_um = [self.said[f"correction_{stem}"] for stem in stems]
        self._faults |= self.said["fault_word"]
        self._states.add(self.said["state"])
        wanted_um = [(stem, self.said[f"wanted_{stem}"]) for stem in stems if self.limited(stem)]
        self._touched |= {(stem, self.said[f"touched_{stem}"]) for stem in self.touched}
        self._reached |= {(stem, um > 0.0) for stem, um in wanted_um}
        return PlcStep(inputs, self.said)

    def told(self, prefix: str, values: Sequence[object]) -> dict[str, Any]:
        """Return inputs of every channel, or every output, by their names."""
        stems = self._names.channels if prefix in {"t", "ok"} else self.outputs
        return {f"{prefix}_{stem}": value for stem, value in zip(stems, values, strict=True)}

    def limited(self, stem: str) -> bool:
        """Return whether the block said last that an output asks for more than its limit."""
        return bool(self.said[f"limit_{stem}"])

    def again(self, offset_um: Sequence[float] = ()) -> None:
        """Begin with a new instance: nothing moves, and an offset stands in the control."""
        self.init, self._new = not self._new or self.init, False
        self.usual = dict(self._usual)
        self.alive, self._stood = False, 0
        self.back()
        self.now_c = list(self.base_c)
        self.stand(offset_um or [0.0] * len(self.bounds))

    # ---- machine and sensors --------------------------------------------------------------------

    def stand(self, offset_um: Sequence[float]) -> None:
        """Let another offset stand in the control, and be reported as it is."""
        self.offset_um = list(offset_um)
        self._reported_um = list(offset_um)

    def _reported(self) -> tuple[float, ...]:
        """Return what the machine reports: it stays until it is too far from its offset. [µm]"""
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

    def _stay_alive(self) -> None:
        """Move temperatures where that is asked for, so little and late that no sensor freezes."""
        frozen_s = [s.frozen_s for s in self.sensors if s.frozen_s > 0.0]
        self._stood += self.alive
        if self.alive and frozen_s and self._stood * self.cycle_s > 0.5 * min(frozen_s):
            self._stood, self._up = 0, not self._up
            self.now_c = [c + (_ALIVE_K if self._up else -_ALIVE_K) for c in self.now_c]

    # ---- times ----------------------------------------------------------------------------------

    def beyond(self, seconds: float) -> float:
        """Return a time that is longer by some calls. [s]"""
        return seconds + _MARGIN_CALLS * self.cycle_s

    def ready_s(self) -> float:
        """Return the time after which everything is there again. [s]"""
        rules = self.rules
        return self.beyond(max(rules.settle_s, rules.recovery_delay_s, rules.input_timeout_s))

    def fits(self, seconds: float, what: str) -> bool:
        """Return whether a time fits into what is left of the phase's calls; note what does not."""
        fits = round(seconds / self.cycle_s) < self.calls_left
        self._unfit += [] if fits else [what]
        return fits

    def missing(self) -> list[str]:
        """Return what did not occur until now, of what can be said, and what did not fit."""
        limits = product(self.outputs, (("upper", True), ("lower", False)))
        ends = [(k, end) for k, end in enumerate(TouchOutcome, 1) if end not in NEVER_TOUCHED]
        touches = [(k, f"touched_{s} {k} {end}", s) for s in self.touched for k, end in ends]
        faults = [2**k for k in range(len(Reason))]
        return [
            *(f"state {k} {s}" for k, s in enumerate(SupervisorState) if k not in self._states),
            *(f"fault_word {bit}" for bit in faults if not self._faults & bit),
            *(f"{w} limit of {s}" for s, (w, up) in limits if (s, up) not in self._reached),
            *(text for k, text, stem in touches if (stem, k) not in self._touched),
            *dict.fromkeys(self._unfit),
        ]

    # ---- requests and offsets -------------------------------------------------------------------

    def trims(self, share: float, output: int = -1) -> dict[str, Any]:
        """Return a share of the largest trim for one output, or all, as inputs. [µm]"""
        most_um = enumerate(bounds.largest_trim_um for bounds in self.bounds)
        return self.told("trim", [share * um if output in {k, -1} else 0.0 for k, um in most_um])

    def touch(
        self, more_um: float, age_s: float = 0.0, sign: float = 1.0, limits: float = 0.0
    ) -> dict[str, Any]:
        """Return a new touch of every touched output: what the machine shows, and so much more.

        And so many limits of its offset.
        """
        told: dict[str, Any] = {}
        for stem, own in self.touched.items():
            said = (self.said[f"{name}_{stem}"] for name in ("correction", "weight", "model"))
            correction_um, weight, model_um = said
            self.usual[f"count_{stem}"] += 1
            shown_um = sign * (correction_um + weight * model_um)
            told[f"touch_{stem}"] = shown_um + more_um + limits * own.largest_um
            told |= {f"age_{stem}": age_s, f"count_{stem}": self.usual[f"count_{stem}"]}
        return told

    def share_um(self, share: float) -> tuple[float, ...]:
        """Return a share of the total of every correction. [µm]"""
        return tuple([share * bounds.total_um for bounds in self.bounds])

    # ---- goals of the temperatures --------------------------------------------------------------

    def back(self) -> None:
        """Let every temperature go back to the usual."""
        self.goal_c = list(self.base_c)

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
            if all(
                abs(self._at_rest_um(k)) < 0.3 * b.largest_um for k, b in enumerate(self.bounds)
            ):
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

    def _rise_k(self, part: Part) -> float:
        """Return the input of a part at the goals. [K]"""
        names = self.model.channels
        plus, minus = (names.index(name) if name else -1 for name in (part.plus, part.minus))
        rise_k = [now_c - zero_c for now_c, zero_c in zip(self.goal_c, self._zero_c, strict=True)]
        return rise_k[plus] - (rise_k[minus] if part.minus else 0.0)

    def _at_rest_um(self, output: int) -> float:
        """Return an output's model at the goals, weighted, when nothing moves any more."""
        of = self.model.outputs[output]
        total_um, outside_k = of.offset_um, 0.0
        for part in of.parts:
            u = self._rise_k(part)
            gain = part.tool_gain if part.gain_by_diameter else 1.0
            total_um += part.dc_gain_um_per_k * gain * u
            if part.lowest_k is not None and part.highest_k is not None:
                outside_k = max(outside_k, part.lowest_k - u, u - part.highest_k)
        weight = max(self._lowest_weight, 1.0 - outside_k / self._margin_k)
        return weight * total_um
