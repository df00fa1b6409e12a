"""The self-test: whether the machine is as the configuration says, found by looking at it."""

import math
from collections.abc import Awaitable, Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Final, Protocol, final

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
    from thermaxis.runtime.opcua import NodeDescription

DEADLINE_S: Final = 2.0
"""Longest time for one question to a server. [s]"""
CLOCK_WARNING_S: Final = 2.0
"""A server's clock that differs by more is said; ages are judged by the server's clock. [s]"""


class Session(Protocol):
    """What the self-test asks of a connection."""

    @property
    def connected(self) -> bool:
        """Whether the server can be asked."""
        ...

    @property
    def last_error(self) -> str:
        """Why not, in words."""
        ...

    @property
    def clock_difference_s(self) -> float | None:
        """The server's clock minus the own. [s]"""
        ...

    async def describe(self, node: str, deadline_s: float) -> "NodeDescription | None":
        """Return what the server says of a node; None if it does not answer."""
        ...

    async def write(
        self, values: Sequence[tuple[str, float]], deadline_s: float
    ) -> list[str] | None:
        """Write numbers; return the names of the status codes."""
        ...


class MachineParts(Protocol):
    """The parts that the self-test looks through."""

    @property
    def sessions(self) -> Mapping[str, Session]:
        """Connections by name."""
        ...

    @property
    def sink(self) -> Sink:
        """Where corrections go."""
        ...

    @property
    def probes(self) -> Session | None:
        """The connection of the probes; looked at only where the configuration has some."""
        ...


def reasons_against(findings: Sequence[Finding]) -> tuple[str, ...]:
    """Return the sentences of what forbids a correction.

    Parameters
    ----------
    findings : sequence of Finding
        What was found.

    Returns
    -------
    tuple of str
        One for each error; empty if there is none.
    """
    return tuple(finding.sentence for finding in findings if finding.level is Level.ERROR)


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
    `write`, whoever changes an offset between the question and the answer is overwritten once; the
    loop must not be writing at the same time.

    Parameters
    ----------
    parts : MachineParts
        Connections and sink, opened before.
    configuration : MachineConfiguration
        What should be.
    write : bool
        Whether every offset that is found is written back, which moves nothing and proves that it
        can be written. Default: the access level is believed.
    deadline_s : float
        Longest time for one question. Default: two seconds. [s]

    Returns
    -------
    tuple of Finding
        In the order of the configuration's tables; what is as it should be is among them.
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
            self.findings.append(judge_connection(f"[connection.{name}]", session))
        if source.kind == "opcua":
            await self._look(source.connection, self._look_at_values)
            if self.configuration.probes and self.parts.sessions[source.connection].connected:
                await self._look_at_probes(self.parts.probes)
        if sink.kind == "opcua":
            await self._look(sink.connection, self._look_at_offsets)
        elif sink.kind == "linuxcnc":
            self.findings.append(judge_linuxcnc(self.parts.sink))

    async def _look(self, connection: str, look: Callable[[Session], Awaitable[None]]) -> None:
        session = self.parts.sessions[connection]
        if not session.connected:
            return
        try:
            await look(session)
        except _NoAnswerError:
            remedy = session.last_error.rstrip(".") or "Look at the server and the network"
            self.findings.append(
                error(f"[connection.{connection}]", "the server does not answer any more", remedy)
            )

    async def _node(self, session: Session, node: str) -> "NodeDescription":
        described = await session.describe(node, self.deadline_s)
        if described is None:
            raise _NoAnswerError
        return described

    # ---- what is read ---------------------------------------------------------------------------

    async def _look_at_values(self, session: Session) -> None:
        configuration, findings = self.configuration, self.findings
        for name, entry in configuration.inputs.items():
            where, rules = f"[input.{name}]", configuration.rules.sensors[name]
            first = await self._node(session, entry.node)
            found = tuple(judge_input(where, first, entry, rules))
            if entry.redundant_node:
                second = await self._node(session, entry.redundant_node)
                found += tuple(judge_input(f"{where}, redundant_node", second, entry, rules))
                if not reasons_against(found):
                    found += tuple(judge_redundant(where, first, second, entry, rules))
            findings.extend(found)
        for name, flag in configuration.interlocks.items():
            node = await self._node(session, flag.node)
            findings.append(judge_interlock(f"[interlock.{name}]", node, flag))
        other, diameter = configuration.other_compensation, configuration.diameter
        if other is not None:
            node = await self._node(session, other.node)
            findings.append(judge_other_compensation("[other_compensation]", node, other))
        if diameter is not None:
            node = await self._node(session, diameter.node)
            model = configuration.model.model
            findings.append(judge_diameter("[diameter]", node, diameter, model))

    async def _look_at_probes(self, session: Session | None) -> None:
        """Look at the probes, by their own connection: what it lacks forbids nothing."""
        for name, settings in self.configuration.probes.items():
            where = f"[probe.{name}]"
            node = None
            if session is not None and session.connected:
                node = await session.describe(settings.node, self.deadline_s)
            if node is None:
                reason = "" if session is None else session.last_error.rstrip(".")
                self.findings.append(
                    warning(
                        where,
                        "the probe cannot be asked: its own connection to the server of the inputs"
                        " is not there, or gives no answer",
                        reason or "The compensation does without it; it is tried again by itself",
                    )
                )
                return
            self.findings.append(judge_probe(where, node, settings))

    # ---- what is written ------------------------------------------------------------------------

    async def _look_at_offsets(self, session: Session) -> None:
        heartbeat = self.configuration.sink.heartbeat_node
        if heartbeat:
            node = await self._node(session, heartbeat)
            self.findings.append(judge_heartbeat("[sink], heartbeat_node", node))
        for name in self.configuration.outputs:
            await self._look_at_output(session, name)

    async def _look_at_output(self, session: Session, name: str) -> None:
        settings, rules = self.configuration.outputs[name], self.configuration.rules
        where = f"[output.{name}]"
        written = await self._node(session, settings.node)
        found = tuple(judge_output(where, written, settings, rules.limits[name]))
        self.findings.extend(found)
        for key in ("read_back_node", "effective_node"):
            node: str = getattr(settings, key)
            if node and node != settings.node:
                reported = await self._node(session, node)
                tolerance_um = rules.supervisor.read_back_tolerance_um
                self.findings.append(
                    judge_read_back(f"{where}, {key}", reported, written, settings, tolerance_um)
                )
        if self.write and written.value is not None and not reasons_against(found):
            self.findings.append(await self._write_back(session, where, settings.node))

    async def _write_back(self, session: Session, where: str, node: str) -> Finding:
        """Write the offset that stands in the machine once more: nothing moves."""
        found = await self._node(session, node)
        if found.value is None or not math.isfinite(found.value):
            return error(where, f"the offset has no value any more: {found.status}", "Try again")
        answer = await session.write([(node, float(found.value))], self.deadline_s)
        if answer != ["Good"]:
            reason = answer[0] if answer else "no answer"
            return error(
                where,
                f"the offset that was found cannot be written back: {reason}",
                "Give the user the right to write, and look whether the machine lets it be written"
                " in its present mode",
            )
        return ok(where, "the offset that was found was written back: it can be written")


def judge_connection(where: str, session: Session) -> Finding:
    """Judge a connection and the clock behind it.

    Parameters
    ----------
    where : str
        Its table.
    session : Session
        The connection.

    Returns
    -------
    Finding
        What was found.
    """
    if not session.connected:
        return error(
            where,
            f"not connected: {session.last_error or 'no answer yet'}".rstrip("."),
            "Nothing is corrected before the machine is there; it is waited for",
        )
    difference_s = session.clock_difference_s
    if difference_s is None:
        return warning(
            where,
            "the server does not tell its time: how old values are is not known",
            "Let it tell its time; or state time_stamp_required = false",
        )
    if abs(difference_s) > CLOCK_WARNING_S:
        return warning(
            where,
            f"connected; the server's clock is {abs(difference_s):.1f} s"
            f" {'ahead of' if difference_s > 0 else 'behind'} this computer's",
            "Set one of the clocks; ages are judged by the server's, records by this computer's",
        )
    return ok(where, f"connected; the clocks differ by {abs(difference_s):.1f} s")


def judge_linuxcnc(sink: Sink) -> Finding:
    """Judge whether LinuxCNC runs with the arrangement that the offset needs.

    Parameters
    ----------
    sink : Sink
        The sink, which compares LinuxCNC with the configuration by itself.

    Returns
    -------
    Finding
        What was found.
    """
    if sink.connected:
        return ok("[sink]", "LinuxCNC runs, is arranged as it must be, and its joints are homed")
    reason: str = getattr(sink, "last_error", "")
    return error(
        "[sink]",
        f"LinuxCNC cannot be written to: {reason or 'it does not run, or is not homed'}".rstrip(
            "."
        ),
        "Start it with the HAL file that thermaxis hal writes, and home its joints",
    )
