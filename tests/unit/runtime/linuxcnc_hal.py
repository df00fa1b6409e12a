"""A HAL in the memory of the test, made from the text that is written for the real one.

It knows `limit3`, `offset`, `watchdog` and `threadtest` from their manual pages, runs its thread in
periods of virtual time, and answers as ``halcmd`` does. Acceleration is left out.
"""

import asyncio
import math
from collections.abc import Callable, Sequence

from tests.unit.runtime.simulated import freeze
from thermaxis.runtime._halcmd import HalLostError

PERIOD_S = 0.005
"""Five times that of a machine, so that a minute of it takes no time. [s]"""
MOTION = ("motion-command-handler", "motion-controller")


class MemoryHal:
    """One HAL; every `attach` is one ``halcmd`` beside it."""

    def __init__(self, text: str, joints: Sequence[int] = (0, 2)) -> None:
        self.functions: list[str] = list(MOTION)
        self.values: dict[str, float] = {}
        self.kinds: dict[str, str] = {}
        self.signal_of: dict[str, str] = {}
        self.source_of: dict[str, str] = {}
        self.behaviour: dict[str, Callable[[], None]] = {}
        self.sets: list[tuple[float, str, float]] = []
        self.hidden: set[str] = set()
        self.running = self.thread_runs = self.answers = True
        self.before_answer: Callable[[str], None] = lambda _command: None
        self.freezes: dict[str, float] = {}
        self._now_s: float | None = None
        for joint in joints:
            self._pins(f"joint.{joint}", {"motor-pos-cmd": 0.0, "motor-pos-fb": 0.0, "pos": 0.0})
            self._pins(f"joint.{joint}", {"homed": 1.0}, "bit")
        for line in text.splitlines():
            if line and not line.startswith("#"):
                self._load(line.split())
        for joint in joints:
            shift = f"thermaxis-shift-{joint}"
            if f"{shift}.out" in self.values:
                self._load(["net", f"motor-{joint}", f"{shift}.out", "=>", f"{shift}.fb-in"])

    # ---- reading the text -----------------------------------------------------------------------

    def _pins(self, component: str, values: dict[str, float], kind: str = "float") -> None:
        for name, value in values.items():
            self.values[f"{component}.{name}"] = value
            self.kinds[f"{component}.{name}"] = kind

    def _load(self, words: list[str]) -> None:
        verb, name, *rest = words
        if verb == "loadrt":
            for instance in rest[0].removeprefix("names=").split(","):
                self._make(name, instance)
        elif verb == "addf":
            assert rest[0] == "servo-thread"
            assert name in self.behaviour, f"there is no function {name}"
            place = int(rest[1]) if len(rest) > 1 else -1
            place = len(self.functions) + 1 + place if place < 0 else place - 1
            self.functions.insert(place, name)
        elif verb == "setp":
            assert name in self.values, f"there is no pin {name}"
            assert name not in self.signal_of
            self.values[name] = float(rest[0])
        elif verb == "net":
            self._net(name, rest)
        else:
            raise AssertionError(f"no command of HAL: {words}")

    def _net(self, signal: str, words: list[str]) -> None:
        pins = [word for word in words if word != "=>"]
        source = words[0] if words[0] != "=>" else ""
        self.kinds.setdefault(signal, self.kinds[pins[0]])
        self.values.setdefault(signal, 0.0)
        for pin in pins:
            assert pin in self.values, f"there is no pin {pin}"
            assert pin not in self.signal_of, f"{pin} is connected already"
            assert self.kinds[pin] == self.kinds[signal]
            self.signal_of[pin] = signal
        if source:
            assert signal not in self.source_of
            self.source_of[signal] = source

    def _make(self, component: str, name: str) -> None:
        behaviour = self.behaviour
        if component == "watchdog":
            self._pins("watchdog", {"input-0": 0.0, "enable-in": 0.0, "ok-out": 0.0}, "bit")
            self._pins("watchdog", {"timeout-0": 0.0})
            behaviour["watchdog.process"] = Watchdog(self).step
            behaviour["watchdog.set-timeouts"] = lambda: None
        elif component == "threadtest":
            self._pins(name, {"count": 0.0}, "u32")
            behaviour[f"{name}.increment"] = lambda: self._count(name)
        elif component == "limit3":
            unlimited = {"in": 0.0, "out": 0.0, "max": 1e20, "min": -1e20, "maxv": 1e20}
            self._pins(name, {**unlimited, "maxa": 1e20})
            self._pins(name, {"enable": 1.0, "load": 0.0}, "bit")
            behaviour[name] = lambda: self._limit(name)
        elif component == "offset":
            self._pins(name, dict.fromkeys(("in", "out", "fb-in", "fb-out", "offset"), 0.0))
            behaviour[f"{name}.update-output"] = lambda: self._shift(name, "in", "out", 1.0)
            behaviour[f"{name}.update-feedback"] = lambda: self._shift(
                name, "fb-in", "fb-out", -1.0
            )
        else:
            raise AssertionError(f"no such component: {component}")

    # ---- the thread -----------------------------------------------------------------------------

    def pin(self, name: str) -> float:
        return self.values[self.signal_of.get(name, name)]

    def put(self, name: str, value: float) -> None:
        self.values[self.signal_of.get(name, name)] = value

    def _count(self, name: str) -> None:
        self.put(f"{name}.count", (self.pin(f"{name}.count") + 1.0) % 2.0**32)

    def _limit(self, name: str) -> None:
        goal = self.pin(f"{name}.in") if self.pin(f"{name}.enable") else 0.0
        goal = min(max(goal, self.pin(f"{name}.min")), self.pin(f"{name}.max"))
        step = self.pin(f"{name}.maxv") * PERIOD_S
        out = self.pin(f"{name}.out")
        self.put(f"{name}.out", out + min(max(goal - out, -step), step))

    def _shift(self, name: str, source: str, target: str, sign: float) -> None:
        value = self.pin(f"{name}.{source}") + sign * self.pin(f"{name}.offset")
        self.put(f"{name}.{target}", value)

    def run_until(self, now_s: float) -> None:
        if self._now_s is None:
            self._now_s = now_s
        periods = round((now_s - self._now_s) / PERIOD_S)
        self._now_s += periods * PERIOD_S
        for _ in range(periods if self.thread_runs else 0):
            for function in self.functions:
                self.behaviour.get(function, lambda: None)()

    # ---- halcmd ---------------------------------------------------------------------------------

    async def attach(self, _program: str = "") -> "MemoryHalcmd":
        if not self.running:
            raise HalLostError("linuxcnc_not_running")
        return MemoryHalcmd(self)

    def answer(self, command: str) -> tuple[str, ...]:
        verb, *rest = command.split()
        if verb == "show":
            return self._thread() if rest == ["thread"] else self._shown(rest[1])
        name = rest[0]
        if name not in self.values or name in self.hidden:
            return (f"<stdin>:1: {'signal' if verb[3:] == 's' else 'pin'} '{name}' not found",)
        if verb == "ptype":
            return (self.kinds[name],)
        if verb in {"getp", "gets"}:
            return (self._text(name, self.pin(name)),)
        assert verb == "sets", command
        if name in self.source_of:
            return (f"<stdin>:1: signal '{name}' already has writer(s)",)
        value = {"TRUE": 1.0, "FALSE": 0.0}.get(rest[1])
        self.values[name] = float(rest[1]) if value is None else value
        self.sets.append((asyncio.get_running_loop().time(), name, self.values[name]))
        return ()

    def _text(self, name: str, value: float) -> str:
        if self.kinds[name] == "bit":
            return "TRUE" if value else "FALSE"
        return f"{value:.0f}" if self.kinds[name] == "u32" else f"{value:.7g}"

    def _thread(self) -> tuple[str, ...]:
        rows = [f"                 {i:2d} {name}" for i, name in enumerate(self.functions, start=1)]
        head = "     Period  FP     Name               (     Time, Max-Time )"
        thread = "    1000000  YES          servo-thread (      736,    29122 )"
        return ("Realtime Threads:", head, thread, *rows, "")

    def _shown(self, prefix: str) -> tuple[str, ...]:
        rows = ["Component Pins:", "Owner   Type  Dir         Value  Name"]
        for name in self.values:
            if name.startswith(prefix) and "." in name:
                signal = self.signal_of.get(name, "")
                out = self.source_of.get(signal) == name
                value = self._text(name, self.pin(name))
                arrow = f" {'==>' if out else '<=='} {signal}" if signal else ""
                rows.append(
                    f"    11  bit   {'OUT' if out else 'IN ':<4} {value:>12}  {name}{arrow}"
                )
        return (*rows, "")


class Watchdog:
    """The component with one input: a timeout latches, and an edge of enable starts it again."""

    def __init__(self, hal: MemoryHal) -> None:
        self.hal = hal
        self.heartbeat = self.enabled = 0.0
        self.left = 0

    def step(self) -> None:
        hal = self.hal
        enable, heartbeat = hal.pin("watchdog.enable-in"), hal.pin("watchdog.input-0")
        full = round(hal.pin("watchdog.timeout-0") / PERIOD_S)
        ok = hal.pin("watchdog.ok-out")
        if enable and not self.enabled:
            ok, self.left = 1.0, full
        self.left = full if heartbeat != self.heartbeat else self.left - 1
        self.heartbeat, self.enabled = heartbeat, enable
        hal.put("watchdog.ok-out", 1.0 if ok and enable and self.left > 0 else 0.0)


class MemoryHalcmd:
    """One ``halcmd`` beside that HAL."""

    def __init__(self, hal: MemoryHal) -> None:
        self.hal = hal
        self.closed = False

    async def ask(self, commands: Sequence[str], deadline_s: float) -> list[tuple[str, ...]]:
        assert not self.closed
        assert deadline_s > 0.0
        assert math.isfinite(deadline_s)
        await asyncio.sleep(0)
        if not self.hal.answers:
            await asyncio.sleep(deadline_s)
            raise HalLostError("halcmd_silent", deadline_s=1.0)
        answers: list[tuple[str, ...]] = []
        for command in commands:
            self.hal.before_answer(command)
            if not self.hal.running:
                raise HalLostError("halcmd_ended", said="")
            self.hal.run_until(asyncio.get_running_loop().time())
            answers.append(self.hal.answer(command))
            freeze(self.hal.freezes.pop(command, 0.0))
        return answers

    def there(self) -> bool:
        return self.hal.running

    async def close(self) -> None:
        self.closed = True
