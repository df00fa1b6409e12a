"""The self-test: whether the machine is as the configuration says, found by looking at it."""

import math
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Final, Protocol, final

from thermaxis.codes import Message
from thermaxis.runtime._findings import Finding, Level, error, ok, warning
from thermaxis.runtime._ports import Sink
from thermaxis.runtime.checks._nodes import (
    judge_diameter,
    judge_heartbeat,
    judge_input,
    judge_interlock,
    judge_other_compensation,
    judge_output,
    judge_probe,
    judge_read_back,
    judge_redundant,
)
from thermaxis.runtime.config import MachineConfiguration

if TYPE_CHECKING:
    from thermaxis.runtime.opcua import NodeDescription, OpcUaSession

DEADLINE_S: Final = 2.0
"""Longest time for one question to a server. [s]"""
CLOCK_WARNING_S: Final = 2.0
"""A server's clock that differs by more is said; ages are judged by the server's clock. [s]"""


_NO_ANSWER: Final = Message("error-machine_silent")


class MachineParts(Protocol):
    """The parts that the self-test looks through."""

    @property
    def sessions(self) -> "Mapping[str, OpcUaSession]":
        """Connections by name."""
        ...

    @property
    def sink(self) -> Sink:
        """Where corrections go."""
        ...

    @property
    def probes(self) -> "OpcUaSession | None":
        """The connection of the probes; looked at only where the configuration has some."""
        ...


def reasons_against(findings: Sequence[Finding]) -> tuple[Message, ...]:
    """Return what forbids a correction."""
    return tuple(finding.message for finding in findings if finding.level is Level.ERROR)


async def self_test(
    parts: MachineParts,
    configuration: MachineConfiguration,
    *,
    write: bool = False,
    deadline_s: float = DEADLINE_S,
) -> tuple[Finding, ...]:
    """Look at the machine, and say how it differs from the configuration.

    Not protected: a node that is the wrong one but looks right, such as a neighbouring sensor; the
    sign of an offset, which commissioning proves; a unit whose values look plausible. With
    `write`, every offset that is found is written back, which moves nothing and proves that it can
    be written; whoever changes it between the question and the answer is overwritten once, and the
    loop must not be writing at the same time.
    """
    test = _SelfTest(parts, configuration, deadline_s, write=write)
    await test.run()
    return tuple(test.findings)


class _NoAnswerError(Exception):
    """The server does not answer any more."""


@final
class _SelfTest:
    """One run of the self-test."""

    def __init__(
        self,
        parts: MachineParts,
        configuration: MachineConfiguration,
        deadline_s: float,
        *,
        write: bool,
    ) -> None:
        self.parts = parts
        self.configuration = configuration
        self.deadline_s = deadline_s
        self.write = write
        self.findings: list[Finding] = []

    async def run(self) -> None:
        """Look at everything that is configured."""
        source, sink = self.configuration.source, self.configuration.sink
        for name, session in self.parts.sessions.items():
            self.findings.append(judge_connection(f"connection.{name}", session))
        if source.kind == "opcua":
            await self._look(source.connection, self._look_at_values)
            if self.configuration.probes and self.parts.sessions[source.connection].connected:
                await self._look_at_probes(self.parts.probes)
        if sink.kind == "opcua":
            await self._look(sink.connection, self._look_at_offsets)
        elif sink.kind == "linuxcnc":
            self.findings.append(judge_linuxcnc(self.parts.sink))

    async def _look(
        self, connection: str, look: "Callable[[OpcUaSession], Awaitable[None]]"
    ) -> None:
        session = self.parts.sessions[connection]
        if not session.connected:
            return
        try:
            await look(session)
        except _NoAnswerError:
            why = session.failure or _NO_ANSWER
            self.findings.append(error("no_more_answers", f"connection.{connection}", why=why))

    async def _node(self, session: "OpcUaSession", node: str) -> "NodeDescription":
        described = await session.describe(node, self.deadline_s)
        if described is None:
            raise _NoAnswerError
        return described

    # ---- what is read ---------------------------------------------------------------------------

    async def _look_at_values(self, session: "OpcUaSession") -> None:
        configuration, findings = self.configuration, self.findings
        for name, entry in configuration.inputs.items():
            key, rules = f"input.{name}", configuration.rules.sensors[name]
            first = await self._node(session, entry.node)
            found = tuple(judge_input(key, first, entry, rules))
            if entry.redundant_node:
                second = await self._node(session, entry.redundant_node)
                found += tuple(judge_input(f"{key}.redundant_node", second, entry, rules))
                if not reasons_against(found):
                    found += tuple(judge_redundant(key, first, second, entry, rules))
            findings.extend(found)
        for name, flag in configuration.interlocks.items():
            node = await self._node(session, flag.node)
            findings.append(judge_interlock(f"interlock.{name}", node, flag))
        other, diameter = configuration.other_compensation, configuration.diameter
        if other is not None:
            node = await self._node(session, other.node)
            findings.append(judge_other_compensation("other_compensation", node, other))
        if diameter is not None:
            node = await self._node(session, diameter.node)
            model = configuration.model.model
            findings.append(judge_diameter("diameter", node, diameter, model))

    async def _look_at_probes(self, session: "OpcUaSession | None") -> None:
        """Look at the probes, by their own connection: what it lacks forbids nothing."""
        for name, settings in self.configuration.probes.items():
            key = f"probe.{name}"
            node = None
            if session is not None and session.connected:
                node = await session.describe(settings.node, self.deadline_s)
            if node is None:
                why = None if session is None else session.failure
                self.findings.append(warning("probe_not_asked", key, why=why or _NO_ANSWER))
                return
            self.findings.append(judge_probe(key, node, settings))

    # ---- what is written ------------------------------------------------------------------------

    async def _look_at_offsets(self, session: "OpcUaSession") -> None:
        heartbeat = self.configuration.sink.heartbeat_node
        if heartbeat:
            node = await self._node(session, heartbeat)
            self.findings.append(judge_heartbeat("sink.heartbeat_node", node))
        for name in self.configuration.outputs:
            await self._look_at_output(session, name)

    async def _look_at_output(self, session: "OpcUaSession", name: str) -> None:
        settings, rules = self.configuration.outputs[name], self.configuration.rules
        table = f"output.{name}"
        written = await self._node(session, settings.node)
        found = tuple(judge_output(table, written, settings, rules.limits[name]))
        self.findings.extend(found)
        for key in ("read_back_node", "effective_node"):
            node: str = getattr(settings, key)
            if node and node != settings.node:
                reported = await self._node(session, node)
                tolerance_um = rules.supervisor.read_back_tolerance_um
                self.findings.append(
                    judge_read_back(f"{table}.{key}", reported, written, settings, tolerance_um)
                )
        if self.write and written.value is not None and not reasons_against(found):
            self.findings.append(await self._write_back(session, table, settings.node))

    async def _write_back(self, session: "OpcUaSession", key: str, node: str) -> Finding:
        """Write the offset that stands in the machine once more: nothing moves."""
        found = await self._node(session, node)
        if found.value is None or not math.isfinite(found.value):
            return error("offset_gone", key, status=found.status)
        answer = await session.write([(node, float(found.value))], self.deadline_s)
        if answer != ["Good"]:
            return error("offset_not_written_back", key, status=answer[0] if answer else "-")
        return ok("offset_written_back", key)


def judge_connection(key: str, session: "OpcUaSession") -> Finding:
    """Judge a connection and the clock behind it."""
    if not session.connected:
        return error("not_connected", key, why=session.failure or _NO_ANSWER)
    difference_s = session.clock_difference_s
    if difference_s is None:
        return warning("server_without_time", key)
    if difference_s > CLOCK_WARNING_S:
        return warning("clock_ahead", key, difference_s=difference_s)
    if difference_s < -CLOCK_WARNING_S:
        return warning("clock_behind", key, difference_s=-difference_s)
    return ok("connected", key, difference_s=abs(difference_s))


def judge_linuxcnc(sink: Sink) -> Finding:
    """Judge whether LinuxCNC runs with the arrangement that the offset needs.

    The sink compares LinuxCNC with the configuration by itself.
    """
    if sink.connected:
        return ok("linuxcnc", "sink")
    return error("linuxcnc_unusable", "sink", why=sink.failure or _NO_ANSWER)
