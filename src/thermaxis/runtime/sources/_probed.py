"""A source with probes beside it, which can neither delay nor spoil what it reads."""

import asyncio
from collections.abc import Mapping, Sequence
from typing import NamedTuple, final

from thermaxis.codes import Message
from thermaxis.runtime._ports import NOT_READ, Clock, Source, SourceSample


class _Answer(NamedTuple):
    """What the probes said."""

    samples: Mapping[str, SourceSample]
    """Samples by name, with their ages at that time."""
    at_s: float
    """Monotonic time at which it came. [s]"""


@final
class ProbedSource(Source):
    """Reads what another source reads, and adds what probes said last.

    What probes measure is shown and recorded, and what they touch is told of its own time: no cycle
    needs them. They are therefore asked beside the inputs, by a source of their own, and never
    waited for: a sample is the answer to the question
    of this cycle where it is there already, and else that of the cycle before, with its true age.
    A question that is not answered from one cycle to the next, and one that fails in any way,
    leaves the samples without a value. While the inputs are lost, probes are lost as well.

    Not protected: a server that does one thing after the other answers the inputs late if a probe
    keeps it busy. Whether probe and correction have one sign is not looked at. The probes' source
    must share no connection with the other one.
    """

    def __init__(self, source: Source, probes: Source, names: Sequence[str], clock: Clock) -> None:
        self.source, self.probes = source, probes
        self._clock = clock
        self._none: Mapping[str, SourceSample] = dict.fromkeys(names, NOT_READ)
        self._asking: asyncio.Task[_Answer] | None = None
        self._told = _Answer(self._none, 0.0)

    async def open(self) -> None:
        """Begin with both."""
        await self.source.open()
        await self.probes.open()

    @property
    def connected(self) -> bool:
        """Whether the last read of the inputs reached their machine."""
        return self.source.connected

    @property
    def failure(self) -> Message | None:
        """Why the machine of the inputs is not reached."""
        return self.source.failure

    @property
    def ended(self) -> bool:
        """Whether no more inputs will come."""
        return self.source.ended

    async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:
        """Read everything else, and add what probes have said by then."""
        self._take()
        if self._asking is None:
            self._asking = asyncio.create_task(self._ask(deadline_s), name="probes")
        else:
            self._told = _Answer(self._none, 0.0)  # not answered within a whole cycle
        samples = await self.source.read(deadline_s)
        self._take()
        told = self._aged() if self.source.connected else self._none
        return {**samples, **{name: told.get(name, NOT_READ) for name in self._none}}

    async def close(self) -> None:
        """End both; nothing is asked any more."""
        asking, self._asking = self._asking, None
        if asking is not None:
            asking.cancel()
            await asyncio.wait((asking,))
            if not asking.cancelled():
                asking.exception()  # it was looked at: nobody else will
        try:
            await self.probes.close()
        finally:
            await self.source.close()

    async def _ask(self, deadline_s: float) -> "_Answer":
        samples = await self.probes.read(deadline_s)
        return _Answer(samples, self._clock.monotonic_s())

    def _take(self) -> None:
        """Take the answer, if it is there."""
        asking = self._asking
        if asking is None or not asking.done():
            return
        self._asking = None
        failed = asking.cancelled() or asking.exception() is not None
        self._told = _Answer(self._none, 0.0) if failed else asking.result()

    def _aged(self) -> Mapping[str, SourceSample]:
        """Return the last answer, by so much older as has passed since."""
        passed_s = max(0.0, self._clock.monotonic_s() - self._told.at_s)
        return {
            name: sample if sample.age_s is None else sample._replace(age_s=sample.age_s + passed_s)
            for name, sample in self._told.samples.items()
        }
