"""The sink, and what is known of the offsets behind it."""

import math
from typing import TYPE_CHECKING, final

from thermaxis.compensation import Compensation, CycleOutput, SupervisorState
from thermaxis.runtime._offsets import (
    Found,
    Look,
    OffsetsState,
    OutputOffset,
    is_stale,
    look_step,
    offset_rules,
    rest_step,
    write_step,
)
from thermaxis.runtime._ports import Applied
from thermaxis.runtime.loop._journal import Journal
from thermaxis.runtime.loop._settings import Ports
from thermaxis.runtime.status import AgedOffset, OutputOffsets, alarms_of_found

if TYPE_CHECKING:
    from collections.abc import Mapping


@final
class Machine:
    """Looks where the offsets stand, writes them, and reads them back."""

    def __init__(self, ports: Ports, journal: Journal, compensation: Compensation) -> None:
        self._sink, self._clock, self._journal = ports.sink, ports.clock, journal
        self.rules = offset_rules(compensation)
        self.offsets = OffsetsState((OutputOffset(),) * len(self.rules.names))
        self.applied: Mapping[str, Applied] = {}
        self._applied_s = 0.0
        self._acting: dict[str, tuple[float, float]] = {}  # [µm] and when it was read [s]
        self.interlocked_s = -math.inf
        """When an interlock was last seen open. [s]"""
        self._rests = False
        self._commanded: dict[str, tuple[float, float]] = {}  # [µm] and when [s]

    def left_at(self, correction_um: tuple[float, ...]) -> None:
        """Take an offset as written, so that it is told where it does not stand there."""
        at = (self._clock.monotonic_s(), self._clock.utc())
        self.offsets = write_step(self.rules, self.offsets, correction_um, at)

    async def look(self, number: int, wait_s: float) -> Found:
        """Read the offsets that stand in the machine, and tell what is not as it was left."""
        time_s, utc = self._clock.monotonic_s(), self._clock.utc()
        news = await self._sink.found(wait_s)
        self.applied = {}
        if self._sink.connected:
            await self._read_back(wait_s)
        late_s = self.rules.read_back_s + self.rules.silence_s  # drives take a while to come back
        interlocked = time_s - self.interlocked_s <= late_s
        look = Look(number, time_s, utc, self._sink.connected, news, self.applied, interlocked)
        self.offsets, found = look_step(self.rules, self.offsets, look)
        self._rests = found.rests
        if found.unusable:
            self._journal.event("alarm", "event-offset_unusable")
        for alarm in alarms_of_found(found.told, utc):
            self._journal.alarm(alarm)
        return found

    async def write(self, output: CycleOutput, wait_s: float, *, ready: bool) -> None:
        """Write what was computed if the machine was looked at just now; read it back."""
        at = self._clock.monotonic_s(), self._clock.utc()
        off = output.state is SupervisorState.OFF
        if off or not ready or is_stale(self.rules, self.offsets, *at):
            self.offsets = rest_step(self.offsets, off=off)
            return
        if self._rests:
            return
        correction_um = dict(zip(self.rules.names, output.correction_um, strict=True))
        self._commanded = {name: (um, at[0]) for name, um in correction_um.items()}
        await self._sink.write(correction_um, wait_s)
        self.offsets = write_step(self.rules, self.offsets, output.correction_um, at)
        await self._read_back(wait_s)

    async def _read_back(self, wait_s: float) -> None:
        self.applied = await self._sink.read_back(wait_s)
        self._applied_s = self._clock.monotonic_s()
        for name, said in self.applied.items():
            um = said.effective_um
            if um is None and name not in self._sink.tells_effective:
                um = said.accepted_um
            if um is not None:
                self._acting[name] = um, self._applied_s

    def aged(self) -> dict[str, OutputOffsets]:
        """Return what is known of each offset, with the time since it was learned."""
        now_s, aged = self._clock.monotonic_s(), dict[str, OutputOffsets]()
        for name in self.rules.names:
            said = self.applied.get(name, Applied(None, None))
            commanded_um, at_s = self._commanded.get(name, (None, now_s))
            seen_s = self._applied_s
            rows = (
                (commanded_um, at_s),
                (said.accepted_um, seen_s),
                (said.effective_um, seen_s),
                self._acting.get(name, (None, now_s)),
            )
            aged[name] = OutputOffsets(
                *(AgedOffset() if um is None else AgedOffset(um, now_s - s) for um, s in rows),
                tells_effective=name in self._sink.tells_effective,
            )
        return aged
