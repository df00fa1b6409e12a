"""Source and sink of the virtual lathe in the same program: hours of the loop in virtual time.

They behave as their twins behind OPC UA do: while the server restarts or the network pauses,
nothing is read and nothing is written, and on return the offset that stands in the machine is
news.
"""

from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from typing import Final, final

from thermaxis.errors import require_known
from thermaxis.runtime import (
    DIAMETER,
    NOT_READ,
    OTHER_COMPENSATION,
    Applied,
    Clock,
    Sink,
    Source,
    SourceSample,
    counter_name,
    interlock_name,
    probe_name,
    redundant_name,
)
from thermaxis.virtual.lathe._machine import VirtualLathe
from thermaxis.virtual.lathe._signals import SENSORS, SIGNALS, LatheReading

INTERLOCKS: Final[Mapping[str, tuple[str, bool]]] = {
    "referenced": ("referenced", True),
    "machine on": ("machine_on", True),
    "not homing": ("homing", False),
    "no emergency stop": ("emergency_stop", False),
}
"""Signal and its value by the name of the interlock that it meets."""


def lathe_names(*, touched: bool = False) -> Mapping[str, str]:
    """Return the lathe's signal for every name that a loop may ask for.

    With `touched` the probe is the machine's own, in place of one that always measures.
    """
    names = {name: name for name in SENSORS if "_2_" not in name}
    for name in SENSORS:
        if "_2_" in name:
            names[redundant_name(name.replace("_2_", "_"))] = name
    names[OTHER_COMPENSATION] = "own_compensation"
    names[DIAMETER] = "diameter_mm"
    names[probe_name("Z_um")] = "touch_um" if touched else "Z_um"
    if touched:
        names[counter_name("Z_um")] = "touch_count"
    return names


class _Time:
    """Keeps the lathe at the time of a clock; without one, the lathe is stepped by its owner."""

    def __init__(self, lathe: VirtualLathe, clock: Clock | None) -> None:
        self.lathe = lathe
        self.clock = clock
        self.begin_s = 0.0 if clock is None else clock.monotonic_s() - lathe.time_s

    def catch_up(self) -> None:
        if self.clock is not None:
            self.lathe.step_to(self.clock.monotonic_s() - self.begin_s)


@final
class LatheSource(Source):
    """Reads a virtual lathe.

    Parameters
    ----------
    lathe : VirtualLathe
        The machine.
    clock : Clock, optional
        The lathe is brought to this clock's time before it is read. Default: its owner steps it.
    names : mapping, optional
        Signals by the names under which they are read. Default: those of `lathe_names`.
    interlocks : sequence of str
        Interlocks that are read, keys of `INTERLOCKS`. Default: all.

    Raises
    ------
    ConfigurationError
        If a signal or an interlock is not known.
    """

    def __init__(
        self,
        lathe: VirtualLathe,
        clock: Clock | None = None,
        *,
        names: Mapping[str, str] | None = None,
        interlocks: Sequence[str] = tuple(INTERLOCKS),
    ) -> None:
        self._names = dict(lathe_names() if names is None else names)
        require_known("names", self._names.values(), SIGNALS)
        require_known("interlocks", interlocks, INTERLOCKS)
        self._interlocks = tuple(interlocks)
        self._time = _Time(lathe, clock)
        self._connected = False

    async def open(self) -> None:
        """Begin."""

    @property
    def connected(self) -> bool:
        """Whether the last read reached the lathe."""
        return self._connected

    async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:  # noqa: ARG002 - the port's
        """Read everything; an interlock is 1 when it is met."""
        self._time.catch_up()
        lathe = self._time.lathe
        self._connected = lathe.reachable
        if not self._connected:
            names = [*self._names, *(interlock_name(i) for i in self._interlocks)]
            return dict.fromkeys(names, NOT_READ)
        readings = lathe.readings()
        clock = self._time.clock
        now = None if clock is None else clock.utc()
        samples = {
            name: self._sample(readings[signal], now) for name, signal in self._names.items()
        }
        for interlock in self._interlocks:
            signal, met = INTERLOCKS[interlock]
            sample = self._sample(readings[signal], now)
            if sample.value is not None:
                sample = sample._replace(value=float(bool(sample.value) == met))
            samples[interlock_name(interlock)] = sample
        return samples

    def _sample(self, reading: LatheReading, now: datetime | None) -> SourceSample:
        age_s = self._time.lathe.time_s - reading.stamp_s
        stamp = now if now is None or age_s == 0.0 else now - timedelta(seconds=age_s)
        value = None if reading.value is None else float(reading.value)
        return SourceSample(value, reading.good, reading.status, age_s, stamp)

    async def close(self) -> None:
        """End."""


@final
class LatheSink(Sink):
    """Writes the offset of a virtual lathe, and moves its heartbeat.

    A positive offset of the lathe moves the tool away from the workpiece, as a correction does.

    Not protected: it writes what it is told; the lathe clamps it, limits its rate and takes it
    back when the heartbeat stands still.

    Parameters
    ----------
    lathe : VirtualLathe
        The machine.
    clock : Clock, optional
        The lathe is brought to this clock's time before it is written to. Default: its owner
        steps it.
    output : str
        Output whose correction is written. Default: the displacement of the lathe's logs.
    """

    def __init__(
        self, lathe: VirtualLathe, clock: Clock | None = None, *, output: str = "Z_um"
    ) -> None:
        self._time = _Time(lathe, clock)
        self._output = output
        self._told = False
        self.tells_effective = frozenset({output})
        self._requested_um: float | None = None

    async def open(self) -> None:
        """Begin."""

    def _reached(self) -> bool:
        self._time.catch_up()
        if not self._time.lathe.reachable:
            self._told = False
            return False
        return True

    @property
    def connected(self) -> bool:
        """Whether the lathe can be written to."""
        return self._reached()

    async def found(self, deadline_s: float) -> Mapping[str, float | None] | None:  # noqa: ARG002 - the port's
        """Return the offset that stands in the lathe, when it is news."""
        if not self._reached() or self._told:
            return None
        self._told = True
        return {self._output: 1e3 * self._time.lathe.axis.written_mm}

    async def write(self, correction_um: Mapping[str, float], deadline_s: float) -> bool:  # noqa: ARG002 - the port's
        """Write the correction and a moved heartbeat; nothing before `found` was read."""
        if not self._reached() or not self._told or self._output not in correction_um:
            return False
        lathe = self._time.lathe
        if not lathe.write_offset(1e-3 * correction_um[self._output]):
            return False
        self._requested_um = correction_um[self._output]
        lathe.write_heartbeat(lathe.axis.heartbeat + 1)
        return True

    async def read_back(self, deadline_s: float) -> Mapping[str, Applied]:  # noqa: ARG002 - the port's
        """Return what the lathe says about the offset."""
        if not self._reached():
            return {self._output: Applied(self._requested_um, None, None)}
        axis = self._time.lathe.axis
        return {self._output: Applied(self._requested_um, axis.accepted_um, axis.effective_um)}

    async def close(self) -> None:
        """End. The lathe's watchdog takes the offset back."""
