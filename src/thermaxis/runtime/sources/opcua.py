"""Values of a machine that is an OPC UA server."""

from collections.abc import Mapping
from typing import final

from asyncua import ua

from thermaxis.codes import Message
from thermaxis.runtime._machine_values import bits_of
from thermaxis.runtime._ports import NOT_READ, Source, SourceSample
from thermaxis.runtime.opcua import WRONG_TYPE, OpcUaSession, plain_number, status_name
from thermaxis.runtime.sources._life import LifeCounter
from thermaxis.runtime.sources._nodes import NodeSettings


@final
class OpcUaSource(Source):
    """Reads all values with one request per cycle, each with its status and its age.

    Notes
    -----
    A value whose status is bad is not passed on: servers send 0.0 with it. An uncertain one is
    passed on, marked as not good. A text, an array and a truth value where a number is expected
    have no value and the status ``BadTypeMismatch``, and so has a number other than 0 and 1 where
    a truth value is expected.

    Where there is a life counter, everything counts as not read while it stands still, and the
    age of a value that is stamped when it changes is that of the counter's last change.

    Not protected: a server that stamps an old value as new is believed, unless there is a life
    counter.
    """

    def __init__(
        self,
        session: OpcUaSession,
        nodes: Mapping[str, NodeSettings],
        life: LifeCounter | None = None,
    ) -> None:
        self.session = session
        self._nodes = dict(nodes)
        self._life = life
        self._ids = tuple(settings.node for settings in self._nodes.values())
        self._ids += () if life is None else (life.node,)
        self._lost = dict.fromkeys(self._nodes, NOT_READ)
        self._reached = False

    async def open(self) -> None:
        """Begin to connect."""
        await self.session.open()

    async def read(self, deadline_s: float) -> Mapping[str, SourceSample]:
        """Read every value by its name."""
        found = await self.session.read(self._ids, deadline_s)
        self._reached = found is not None
        if found is None:
            return self._lost
        if self._life is not None:
            self._life.see(plain_number(found[-1]) if status_name(found[-1]) == "Good" else None)
            if self._life.failure is not None:
                return self._lost
        return {
            name: self._sample(settings, value)
            for (name, settings), value in zip(self._nodes.items(), found, strict=False)
        }

    @property
    def connected(self) -> bool:
        """Whether the last read reached the server, and a machine that is alive."""
        return self._reached and self.session.connected and self._stands is None

    @property
    def failure(self) -> Message | None:
        """Why the server is not reached, or the machine behind it is not alive."""
        reached = self._reached and self.session.connected
        return self._stands if reached else self.session.failure

    @property
    def _stands(self) -> Message | None:
        return None if self._life is None else self._life.failure

    async def close(self) -> None:
        """End the connection, unless a sink still uses it."""
        self._reached = False
        await self.session.close()

    def _sample(self, settings: NodeSettings, value: ua.DataValue) -> SourceSample:
        code = value.StatusCode
        status = "Good" if code is None or not code.value else code.name
        good = code is None or code.is_good()
        age_s = self.session.age_s(value)
        stamp = None if age_s is None else value.SourceTimestamp
        if settings.on_change and self._life is not None:
            age_s = self._life.age_s
        if code is not None and code.is_bad():
            return SourceSample(None, good=False, status=status, age_s=age_s, source_time=stamp)
        kind = "" if value.Value is None else value.Value.VariantType.name
        number, fits = settings.value_of(plain_number(value), bits_of(kind))
        if not fits:
            return SourceSample(None, good=False, status=WRONG_TYPE, age_s=age_s, source_time=stamp)
        return SourceSample(number, good=good, status=status, age_s=age_s, source_time=stamp)
