"""The self-test: whether the machine is as the configuration says, found by looking at it."""

import asyncio
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Final, TypeAlias

from thermaxis.codes import Message
from thermaxis.compensation import SensorRules
from thermaxis.runtime._findings import Finding, Level, error, ok, warning
from thermaxis.runtime._ports import Sink
from thermaxis.runtime.checks._nodes import (
    judge_diameter,
    judge_heartbeat,
    judge_input,
    judge_interlock,
    judge_life,
    judge_other_compensation,
    judge_output,
    judge_probe,
    judge_read_back,
    judge_redundant,
)
from thermaxis.runtime.config import InputSettings, MachineConfiguration, ProbeSettings

if TYPE_CHECKING:
    from thermaxis.runtime.opcua import NodeDescription, OpcUaSession
    from thermaxis.runtime.sources import LinuxCncSource

    _Asked = OpcUaSession | LinuxCncSource

DEADLINE_S: Final = 2.0
"""Longest time for one question to a server. [s]"""
CLOCK_WARNING_S: Final = 2.0
"""A server's clock that differs by more is said; ages are judged by the server's clock. [s]"""


_LOOKS: Final = 20
_NO_ANSWER: Final = Message("error-machine_silent")


_REPORTED: Final = ("read_back_node", "effective_node")
_Look: TypeAlias = "tuple[Sequence[str], Callable[..., Finding | Iterable[Finding]]]"
"""Nodes that are looked at, and what is found from what the server says of them."""


def reasons_against(findings: Sequence[Finding]) -> tuple[Message, ...]:
    """Return what forbids a correction."""
    return tuple(finding.message for finding in findings if finding.level is Level.ERROR)


async def self_test(
    configuration: MachineConfiguration,
    sessions: "Mapping[str, OpcUaSession]",
    sink: Sink,
    probes: "OpcUaSession | None" = None,
    pins: "LinuxCncSource | None" = None,
    *,
    write: bool = False,
) -> tuple[Finding, ...]:
    """Look at the machine, and say how it differs from the configuration.

    Not protected: a node that is the wrong one but looks right, such as a neighbouring sensor; the
    sign of an offset, which commissioning proves; a unit whose values look plausible. With
    `write`, every offset that is found is written back, which moves nothing and proves that it can
    be written; whoever changes it between the question and the answer is overwritten once, and the
    loop must not be writing at the same time.
    """
    source, kind = configuration.source, configuration.sink.kind
    found = [judge_connection(f"connection.{name}", one) for name, one in sessions.items()]
    if pins is not None:
        found += await _look_at_pins(pins, configuration)
    elif source.kind == "opcua":
        session = sessions[source.connection]
        found += await _looked(session, source.connection, _values(configuration))
        if configuration.probes and session.connected:
            found += await _look_at_probes(probes, configuration)
    if kind == "opcua":
        name = configuration.sink.connection
        offsets = await _looked(sessions[name], name, _offsets(configuration))
        if write and offsets and not reasons_against(offsets):
            for output, entry in configuration.outputs.items():
                key = f"output.{output}"
                offsets.append(await _written_back(sessions[name], name, key, entry.node))
        found += offsets
    elif kind == "linuxcnc":
        found.append(judge_linuxcnc(sink))
    return tuple(found)


async def _look_at_pins(
    pins: "LinuxCncSource", configuration: MachineConfiguration
) -> list[Finding]:
    """Look at pins of LinuxCNC, once its life counter was seen to move."""
    for _ in range(_LOOKS):
        await pins.read(DEADLINE_S)
        if pins.connected:
            found = await _looked(pins, "source", _values(configuration))
            return [ok("pins", "source"), *found, *await _look_at_probes(pins, configuration)]
        await asyncio.sleep(DEADLINE_S / _LOOKS)
    return [error("pins_unread", "source", why=pins.failure or _NO_ANSWER)]


async def _looked(session: "_Asked", name: str, looks: Iterable[_Look]) -> list[Finding]:
    """Ask for the nodes one after the other, until one is not answered."""
    found: list[Finding] = []
    for nodes, judged in looks if session.connected else ():
        described = [await session.describe(node, DEADLINE_S) for node in nodes]
        if None in described:
            return [*found, _silent(session, name)]
        said = judged(*described)
        found += [said] if isinstance(said, Finding) else said
    return found


def _silent(session: "_Asked", name: str) -> Finding:
    return error("no_more_answers", f"connection.{name}", why=session.failure or _NO_ANSWER)


def _values(configuration: MachineConfiguration) -> Iterator[_Look]:
    """Yield what is read."""
    if configuration.source.life_node:
        yield (configuration.source.life_node,), partial(judge_life, "source.life_node")
    for name, entry in configuration.inputs.items():
        nodes = tuple(node for node in (entry.node, entry.redundant_node) if node)
        rules = configuration.rules.sensors[name]
        yield nodes, partial(_about_sensors, f"input.{name}", entry, rules)
    for name, flag in configuration.interlocks.items():
        yield (flag.node,), partial(judge_interlock, f"interlock.{name}", settings=flag)
    other, diameter = configuration.other_compensation, configuration.diameter
    if other is not None:
        key = "other_compensation"
        yield (other.node,), partial(judge_other_compensation, key, settings=other)
    if diameter is not None:
        model = configuration.model.model
        yield (diameter.node,), partial(judge_diameter, "diameter", settings=diameter, model=model)


def _offsets(configuration: MachineConfiguration) -> Iterator[_Look]:
    """Yield what is written, and what the machine reports of it."""
    for key in ("heartbeat_node", "token_node"):
        if node := getattr(configuration.sink, key):
            yield (node,), partial(judge_heartbeat, f"sink.{key}", token=key == "token_node")
    for name, entry in configuration.outputs.items():
        keys = [one for one in _REPORTED if getattr(entry, one) not in {"", entry.node}]
        nodes = (entry.node, *(getattr(entry, one) for one in keys))
        yield nodes, partial(_about_offset, name, keys, configuration)


def _about_sensors(
    key: str,
    settings: InputSettings,
    rules: SensorRules,
    first: "NodeDescription",
    second: "NodeDescription | None" = None,
) -> list[Finding]:
    """Judge the sensor of an input, and its redundant one."""
    found = [*judge_input(key, first, settings, rules)]
    if second is not None:
        found += judge_input(f"{key}.redundant_node", second, settings, rules)
        if not reasons_against(found):
            found += judge_redundant(key, first, second, settings, rules)
    return found


def _about_offset(
    name: str,
    keys: Sequence[str],
    configuration: MachineConfiguration,
    written: "NodeDescription",
    *reported: "NodeDescription",
) -> Iterator[Finding]:
    """Judge an offset, and what the machine reports of it."""
    key, settings, rules = f"output.{name}", configuration.outputs[name], configuration.rules
    yield from judge_output(key, written, settings, rules.limits[name])
    tolerance_um = rules.supervisor.read_back_tolerance_um
    for one, node in zip(keys, reported, strict=True):
        yield judge_read_back(f"{key}.{one}", node, written, settings, tolerance_um)


async def _look_at_probes(
    session: "_Asked | None", configuration: MachineConfiguration
) -> list[Finding]:
    """Look at the probes, by their own connection: what it lacks forbids nothing."""
    found: list[Finding] = []
    rows: list[tuple[str, str, ProbeSettings | None]] = []
    for name, probe in configuration.probes.items():
        rows += [(f"probe.{name}", probe.node, probe)] if probe.node else []
        counter = f"probe.{name}.counter_node", probe.counter_node, None
        rows += [counter] if probe.counter_node else []
    for key, node_id, settings in rows:
        node = None
        if session is not None and session.connected:
            node = await session.describe(node_id, DEADLINE_S)
        if node is None:
            why = None if session is None else session.failure
            return [*found, warning("probe_not_asked", key, why=why or _NO_ANSWER)]
        found.append(judge_probe(key, node, settings))
    return found


async def _written_back(session: "OpcUaSession", name: str, key: str, node: str) -> Finding:
    """Write the offset that stands in the machine once more: nothing moves."""
    found = await session.describe(node, DEADLINE_S)
    if found is None:
        return _silent(session, name)
    if found.value is None or not math.isfinite(found.value):
        return error("offset_gone", key, status=found.status)
    answer = await session.write([(node, float(found.value))], DEADLINE_S)
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
