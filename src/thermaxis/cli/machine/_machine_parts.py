"""Puts the parts of a machine's compensation together from its configuration.

Packages are named whole: what a machine does not use, such as a reader of logs, is not loaded.
"""

import asyncio
from dataclasses import dataclass, replace
from datetime import datetime
from typing import TYPE_CHECKING, final

from thermaxis import files, runtime
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import history, sinks, sources
from thermaxis.runtime.config import configuration_sha256
from thermaxis.runtime.host import is_loopback

if TYPE_CHECKING:
    from collections.abc import Mapping
    from contextlib import AbstractContextManager

    from thermaxis.runtime import (
        Clock,
        Historian,
        LoopSettings,
        MachineConfiguration,
        OpcUaSession,
        Sink,
        Source,
    )
    from thermaxis.runtime.sources import LifeCounter, LinuxCncSource, NodeSettings, ReplayClock


@final
@dataclass(frozen=True, slots=True)
class MachineParts:
    """Everything that touches the outside; nothing of it is open yet."""

    sessions: "Mapping[str, OpcUaSession]"
    """Connections by name, shared by source and sink."""
    ports: "runtime.Ports"
    """Source, sink, historian and clock as the loop takes them: of a log its own clock."""
    probes: "OpcUaSession | None" = None
    """The connection of the probes, which the source opens; None where there are none."""
    pins: "LinuxCncSource | None" = None
    """The source, where it is LinuxCNC."""

    @property
    def sink(self) -> "Sink":
        """Where corrections go."""
        return self.ports.sink


@final
class PacedClock:
    """The clock of a replayed log, at the pace of the day; without a real one as fast as can be."""

    def __init__(self, replay: "ReplayClock", real: "Clock | None") -> None:
        self._replay = replay
        self._real = real
        self._start_s = 0.0 if real is None else real.monotonic_s()

    def monotonic_s(self) -> float:
        """Return the time since the log's first row. [s]"""
        return self._replay.monotonic_s()

    def utc(self) -> datetime:
        """Return the time of day on the day of the log."""
        return self._replay.utc()

    async def sleep_until(self, monotonic_s: float) -> None:
        """Wait until that time has come on the real clock as well, or others have had a turn."""
        if self._real is None:
            await asyncio.sleep(0.0)
        else:
            await self._real.sleep_until(self._start_s + monotonic_s)
        await self._replay.sleep_until(monotonic_s)


def build_parts(
    configuration: "MachineConfiguration", clock: "Clock", historian: "Historian | None" = None
) -> MachineParts:
    """Make source, sink and historian; nothing is opened, connected or written.

    Not protected: a configuration that names the wrong node or sign; see `self_test`.
    """
    sessions = build_sessions(configuration, clock)
    probes = build_probe_session(configuration, clock)
    pins = build_pins(configuration, clock)
    if pins is not None:
        source = pins
    elif configuration.source.kind == "replay":
        source, clock = _replay(configuration, clock)
    else:
        session = sessions[configuration.source.connection]
        life = _life(configuration, clock) if configuration.source.life_node else None
        source = sources.OpcUaSource(session, nodes_read(configuration), life)
    if probes is not None:
        nodes = probes_read(configuration)
        probe_source = sources.OpcUaSource(probes, nodes)
        source = sources.ProbedSource(source, probe_source, tuple(nodes), clock)
    if historian is None:
        historian = history.SqlHistorian(configuration.historian, clock)
    sink = build_sink(configuration, sessions, clock)
    return MachineParts(sessions, runtime.Ports(source, sink, historian, clock), probes, pins)


def sole_runner(configuration: "MachineConfiguration") -> "AbstractContextManager[None]":
    """Hold a machine and every offset that is written to it, for this program alone."""
    sink, offsets = configuration.sink, list[str]()
    if sink.kind == "opcua":
        settings = configuration.connections[sink.connection]
        host = "localhost" if is_loopback(settings.host) else settings.host
        server = f"{host}:{settings.port}"
        offsets = [f"{server} {entry.node}" for entry in configuration.outputs.values()]
    elif sink.linuxcnc is not None:
        offsets = [f"LinuxCNC joint {entry.joint}" for entry in sink.linuxcnc.outputs.values()]
    return runtime.sole_runner(configuration.state_file, configuration.name, offsets)


def build_sessions(
    configuration: "MachineConfiguration", clock: "Clock"
) -> "dict[str, OpcUaSession]":
    """Make the connections that source and sink share; none is opened."""
    return {
        name: runtime.OpcUaSession(settings, clock)
        for name, settings in configuration.connections.items()
    }


def build_probe_session(
    configuration: "MachineConfiguration", clock: "Clock"
) -> "OpcUaSession | None":
    """Make the connection of the probes, of their own; it is not opened.

    A request that is not answered in time costs its connection: a slow probe must not cost that
    of the inputs.
    """
    if not probes_read(configuration) or configuration.source.kind != "opcua":
        return None
    settings = configuration.connections[configuration.source.connection]
    return runtime.OpcUaSession(replace(settings, name=f"{settings.name}, probes"), clock)


def build_pins(configuration: "MachineConfiguration", clock: "Clock") -> "LinuxCncSource | None":
    """Make the source of LinuxCNC's pins, probes among them; None where the source is another."""
    if configuration.source.kind != "linuxcnc":
        return None
    life = _life(configuration, clock, sources.THREAD_TIME)
    nodes = nodes_read(configuration) | probes_read(configuration)
    return sources.LinuxCncSource(nodes, life, clock, configuration.sink.halcmd)


def nodes_read(configuration: "MachineConfiguration") -> "dict[str, NodeSettings]":
    """Return what an OPC UA source reads, by the names of the ports."""
    node = sources.NodeSettings
    nodes: dict[str, NodeSettings] = {}
    for name, entry in configuration.inputs.items():
        nodes[name] = node(
            node=entry.node, unit=entry.unit, scale=entry.scale, on_change=entry.on_change
        )
        if entry.redundant_node:
            second = replace(nodes[name], node=entry.redundant_node)
            nodes[runtime.redundant_name(name)] = second
    for name, flag in configuration.interlocks.items():
        nodes[runtime.interlock_name(name)] = node(node=flag.node, unit="bool", bit=flag.bit)
    other, diameter = configuration.other_compensation, configuration.diameter
    if configuration.source.datum_node:
        nodes[runtime.DATUM] = node(node=configuration.source.datum_node, unit="1")
    if other is not None:
        nodes[runtime.OTHER_COMPENSATION] = node(node=other.node, unit="bool", bit=other.bit)
    if diameter is not None:
        nodes[runtime.DIAMETER] = node(node=diameter.node, unit=diameter.unit, scale=diameter.scale)
    return nodes


def _life(
    configuration: "MachineConfiguration", clock: "Clock", default: str = ""
) -> "LifeCounter":
    source = configuration.source
    return sources.LifeCounter(source.life_node or default, source.life_s, clock)


def probes_read(configuration: "MachineConfiguration") -> "dict[str, NodeSettings]":
    """Return which probes are read, by the names of the ports, a counter before its value.

    A probing cycle writes the counter last: what is read after it is no older.
    """
    nodes: dict[str, NodeSettings] = {}
    for name, entry in configuration.probes.items():
        if entry.counter_node:
            counter = sources.NodeSettings(node=entry.counter_node, unit="1")
            nodes[runtime.counter_name(name)] = counter
        if entry.node:
            node = sources.NodeSettings(node=entry.node, unit="um", scale=entry.factor)
            nodes[runtime.probe_name(name)] = node
    return nodes


def _replay(configuration: "MachineConfiguration", clock: "Clock") -> "tuple[Source, PacedClock]":
    settings = configuration.source
    if settings.log is None:
        raise ConfigurationError("missing_key", file=configuration.path, key="source.log")
    mapping = None if settings.mapping is None else files.read_thermal_mapping(settings.mapping)
    log = files.read_thermal_log(settings.log, mapping=mapping)
    replay = sources.ReplayClock()
    rules = configuration.compensation  # a witness that the log lacks is one that is not read
    names = [n for n in rules.judged if n in rules.model.channels or n in log.columns]
    touched = [name for name in rules.touches if name in log.columns]
    source = sources.ReplaySource(log, dict.fromkeys(names, "degC"), replay, touched)
    return source, PacedClock(replay, None if settings.as_fast_as_possible else clock)


def build_sink(
    configuration: "MachineConfiguration", sessions: "Mapping[str, OpcUaSession]", clock: "Clock"
) -> "Sink":
    """Make the sink; it is not opened, and nothing is written."""
    settings = configuration.sink
    if settings.kind == "opcua":
        outputs = {
            name: sinks.OpcUaOutput(
                node=entry.node,
                unit=entry.unit,
                sign=entry.sign,
                read_back_node=entry.read_back_node,
                effective_node=entry.effective_node,
            )
            for name, entry in configuration.outputs.items()
        }
        session = sessions[settings.connection]
        token = None
        if settings.token_node:
            rules = configuration.compensation
            seconds = rules.cycle_s, rules.supervisor.read_back_s
            token = sinks.Token(settings.token_node, *seconds)
        return sinks.OpcUaSink(session, outputs, settings.heartbeat_node or None, token)
    if settings.linuxcnc is not None:
        return sinks.LinuxCncSink(settings.linuxcnc, clock)
    return sinks.DrySink(tuple(configuration.outputs))


def loop_settings(configuration: "MachineConfiguration") -> "LoopSettings":
    """Return what the loop needs besides the compensation."""
    other, probes = configuration.other_compensation, configuration.probes
    return runtime.LoopSettings(
        machine=configuration.name,
        model_file=configuration.model.path.name,
        model_sha256=configuration.model.sha256,
        interlocks_met={name: flag.value for name, flag in configuration.interlocks.items()},
        other_active=None if other is None else other.value,
        reads_diameter=configuration.diameter is not None,
        resume_enabled=configuration.supervisor.resume_enabled,
        resume_within_s=configuration.supervisor.resume_within_s,
        at_stop=runtime.AtStop(configuration.supervisor.at_stop),
        stop_within_s=configuration.supervisor.stop_within_s,
        latch_offset_mismatch=configuration.supervisor.latch_offset_mismatch,
        replayed=configuration.source.kind == "replay",
        touch_delay_s={name: one.delay_s for name, one in probes.items()},
        wanted_std_um={n: one.wanted_std_um for n, one in probes.items() if one.wanted_std_um},
        configuration_sha256=configuration_sha256(configuration),
    )
