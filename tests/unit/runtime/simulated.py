"""Source, sink and historian in memory, for tests of the loop in virtual time."""

from collections.abc import Mapping

from thermaxis.runtime import (
    NOT_READ,
    Applied,
    CycleRecord,
    EventRecord,
    Historian,
    HistorianStatus,
    Sink,
    Source,
    SourceSample,
)


class SimulatedMachine:
    """A machine with values by name and one offset per output."""

    def __init__(self, values: Mapping[str, float], outputs: tuple[str, ...]) -> None:
        self.values = dict(values)
        self.offset_um = dict.fromkeys(outputs, 0.0)
        self.there = True
        self.generation = 1
        self.obeys = True
        self.written: list[dict[str, float]] = []

    def lose(self) -> None:
        self.there = False

    def come_back(self, *, offset_um: float | None = None) -> None:
        self.there = True
        self.generation += 1
        if offset_um is not None:
            self.offset_um = dict.fromkeys(self.offset_um, offset_um)


class SimulatedSource(Source):
    def __init__(self, machine: SimulatedMachine) -> None:
        self.machine = machine

    async def open(self) -> None: ...

    @property
    def connected(self) -> bool:
        return self.machine.there

    async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:
        if not self.machine.there:
            return dict.fromkeys(self.machine.values, NOT_READ)
        return {n: SourceSample(v, good=True) for n, v in self.machine.values.items()}

    async def close(self) -> None: ...


class SimulatedSink(Sink):
    def __init__(self, machine: SimulatedMachine) -> None:
        self.machine = machine
        self._told = 0

    async def open(self) -> None: ...

    @property
    def connected(self) -> bool:
        return self.machine.there

    async def found(self, deadline_s: float) -> Mapping[str, float | None] | None:
        if not self.machine.there or self._told == self.machine.generation:
            return None
        self._told = self.machine.generation
        return dict(self.machine.offset_um)

    async def write(self, correction_um: Mapping[str, float], deadline_s: float) -> bool:
        assert self._told == self.machine.generation, "written before it was read"
        self.machine.written.append(dict(correction_um))
        if self.machine.obeys:
            self.machine.offset_um.update(correction_um)
        return True

    async def read_back(self, deadline_s: float) -> Mapping[str, Applied]:
        last = self.machine.written[-1] if self.machine.written else {}
        return {n: Applied(last.get(n), c) for n, c in self.machine.offset_um.items()}

    async def close(self) -> None: ...


class SimulatedHistorian(Historian):
    def __init__(self) -> None:
        self.records: list[CycleRecord] = []
        self.events: list[EventRecord] = []
        self.closed = False

    async def open(self, outputs: object, channels: object) -> None: ...

    def record(self, record: CycleRecord) -> None:
        self.records.append(record)

    def event(self, event: EventRecord) -> None:
        self.events.append(event)

    @property
    def status(self) -> HistorianStatus:
        return HistorianStatus()

    async def close(self, deadline_s: float) -> None:
        self.closed = True
