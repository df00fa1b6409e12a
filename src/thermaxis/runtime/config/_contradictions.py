"""What cannot be in a configuration though each of its tables is right by itself."""

import ipaddress
import re
from collections.abc import Iterable, Iterator
from typing import Final, get_args

from thermaxis.codes import Message
from thermaxis.compensation import CompensationModel
from thermaxis.runtime._ports import (
    DIAMETER,
    OTHER_COMPENSATION,
    interlock_name,
    probe_name,
    redundant_name,
)
from thermaxis.runtime._sign import AWAY, OFFSET_UNITS, SIGNS, TOWARDS
from thermaxis.runtime.config._reading import nearest, problem
from thermaxis.runtime.config._tables import (
    MachineFile,
    OutputSettings,
    ScreenSettings,
    ServerSettings,
)
from thermaxis.runtime.host import is_loopback
from thermaxis.runtime.sinks import HalSettings, HalUnit

EVERY_ADDRESS: Final = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # noqa: S104 - not listened at
"""Addresses that mean every one of this computer, and its own for each."""
_LABEL = r"[a-z0-9_](?:[a-z0-9_-]{0,61}[a-z0-9_])?"
HOST = re.compile(rf"(?P<name>{_LABEL}(?:\.{_LABEL})*|\[[0-9a-f:.]+\])(?::(?P<port>\d{{1,5}}))?")
"""Name of a computer in small letters, perhaps with a port."""
_LONGEST_HOST = 253
_MOST_PORTS = 65_535
_OF_LINUXCNC = ("joint", "largest_acceleration_um_per_s2")


def contradictions(file: MachineFile) -> Iterator[Message]:
    """Yield what cannot be between the tables of a file."""
    yield from _about_source_and_sink(file)
    for name, entry in file.inputs.items():
        if file.source.kind == "opcua" and not entry.node:
            yield problem("key_needed_here", f"input.{name}", name="node")
    if file.sink.kind != "dry":
        for name, output in file.outputs.items():
            yield from _about_output(f"output.{name}", output, file.sink.kind)
    yield from _about_names(file)
    yield from _about_nodes(file)


def _foreign(table: str, kind: str, of: object, keys: Iterable[str]) -> Iterator[Message]:
    for key in keys:
        if getattr(of, key):
            yield problem("key_of_other_kind", f"{table}.{key}", name=key, kind=kind)


def _about_source_and_sink(file: MachineFile) -> Iterator[Message]:
    source, sink = file.source, file.sink
    if source.kind == "opcua":
        keys = ("log", "mapping", "as_fast_as_possible", "may_move_a_machine")
        yield from _foreign("source", "opcua", source, keys)
        yield from _about_connection("source", source.connection, file)
    else:
        # the connection may stay, so that a replay of the real configuration is few changed words
        if source.log is None:
            yield problem("key_needed_here", "source", name="log")
        if sink.kind != "dry" and not source.may_move_a_machine:
            yield problem("replay_moves_machine", "sink.kind")
    if sink.kind == "opcua":
        usual = HalSettings()
        keys = ("watchdog_s", "thread", "halcmd")
        stated = [key for key in keys if getattr(sink, key) != getattr(usual, key)]
        yield from _foreign("sink", "opcua", sink, stated)
        yield from _about_connection("sink", sink.connection, file)
    elif sink.kind == "linuxcnc":
        yield from _foreign("sink", "linuxcnc", sink, ("connection", "heartbeat_node"))


def _about_connection(table: str, name: str, file: MachineFile) -> Iterator[Message]:
    known = tuple(file.connections)
    if not name:
        yield problem("key_needed_here", table, name="connection")
    elif name not in known:
        near = nearest(name, known)
        yield problem("unknown_name", f"{table}.connection", name=name, known=near)


def _about_output(table: str, output: OutputSettings, kind: str) -> Iterator[Message]:
    if kind == "opcua":
        if not output.node:
            yield problem("key_needed_here", table, name="node")
        stated = [key for key in _OF_LINUXCNC if getattr(output, key) is not None]
        for key in stated:
            yield problem("key_of_other_kind", f"{table}.{key}", name=key, kind=kind)
    else:
        yield from _foreign(table, kind, output, ("node", "read_back_node", "effective_node"))
        if output.joint is None:
            yield problem("key_needed_here", table, name="joint")
    units: tuple[str, ...] = tuple(OFFSET_UNITS) if kind == "opcua" else get_args(HalUnit)
    if not output.unit:
        yield problem("key_needed_here", table, name="unit")
    elif output.unit not in units:
        yield problem("unknown_choice", f"{table}.unit", name=output.unit, known=units)
    if not output.sign:
        yield problem("key_needed_here", table, name="sign")
    elif output.sign not in SIGNS:
        values = {"sign": output.sign, "away": AWAY, "towards": TOWARDS}
        yield problem("unknown_sign", f"{table}.sign", **values)


def _about_names(file: MachineFile) -> Iterator[Message]:
    """Refuse names that would be read as something else."""
    for name in file.interlocks:
        if not re.fullmatch(r"[\w-]{1,60}", name):
            yield problem("interlock_name", f"interlock.{name}")
    taken = {OTHER_COMPENSATION, DIAMETER}
    taken |= {interlock_name(name) for name in file.interlocks}
    taken |= {redundant_name(name) for name in file.inputs}
    taken |= {probe_name(name) for name in file.probes}
    for name in file.inputs:
        if name in taken:
            yield problem("reserved_name", f"input.{name}", name=name)


def _about_nodes(file: MachineFile) -> Iterator[Message]:
    """Refuse a node that is named for two purposes."""
    seen: dict[tuple[str, str], str] = {}
    for connection, nodes in (
        (file.sink.connection, _written_nodes(file)),
        (file.source.connection, _read_nodes(file)),
    ):
        for key, node in nodes:
            first = seen.setdefault((connection, node), key) if node else key
            if first != key:
                yield problem("node_twice", key, first=first)


def _read_nodes(file: MachineFile) -> Iterator[tuple[str, str]]:
    for name, entry in file.inputs.items():
        yield f"input.{name}.node", entry.node
        yield f"input.{name}.redundant_node", entry.redundant_node
    for name, flag in file.interlocks.items():
        yield f"interlock.{name}.node", flag.node
    for key in ("other_compensation", "diameter"):
        one = getattr(file, key)
        yield f"{key}.node", "" if one is None else one.node
    for name, probe in file.probes.items():
        yield f"probe.{name}.node", probe.node


def _written_nodes(file: MachineFile) -> Iterator[tuple[str, str]]:
    yield "sink.heartbeat_node", file.sink.heartbeat_node
    for name, entry in file.outputs.items():
        yield f"output.{name}.node", entry.node
        if entry.read_back_node != entry.node:
            yield f"output.{name}.read_back_node", entry.read_back_node
        if entry.effective_node not in {entry.node, entry.read_back_node}:
            yield f"output.{name}.effective_node", entry.effective_node


def about_model(file: MachineFile, model: CompensationModel) -> Iterator[Message]:
    """Yield where the tables do not fit the model; inputs that it does not need are recorded."""
    outputs = tuple(output.name for output in model.outputs)
    of_file = file.machine.model.name
    for table, code, wanted, given in (
        ("input", "channel_without_table", model.channels, file.inputs),
        ("output", "output_without_table", outputs, file.outputs),
    ):
        for name in wanted:
            if name not in given:
                yield problem(code, "machine.model", model=of_file, table=f"{table}.{name}")
    for table, names in (("output", file.outputs), ("probe", file.probes)):
        for name in names:
            if name not in outputs:
                values = {"name": name, "model": of_file, "known": nearest(name, outputs)}
                yield problem("not_of_model", f"{table}.{name}", **values)


# ---- the pages ----------------------------------------------------------------------------------


def about_screen(file: MachineFile) -> Iterator[Message]:
    """Yield what of one table makes the pages useless that another one serves.

    The pages show what the status server says, and each log-in is a connection of its own to it.
    """
    screen, server = file.screen, file.server
    if screen is None:
        return
    yield from _about_reach(screen)
    if screen.idle_s > screen.longest_login_s:
        yield problem("idle_too_long", "screen.idle_s", longest_s=screen.longest_login_s)
    password = screen.password_file or screen.password_environment
    if password and not screen.user:
        yield problem("password_without_user", "screen.user")
    if screen.user and not password:
        yield problem("user_needs_password", "screen.user")
    for table, other in (("server", server), ("metrics", file.metrics)):
        if other and other.port == screen.port != 0 and _meet(other.address, screen.address):
            yield problem("port_twice", "screen.port", table=table)
    if server is None:
        yield problem("screen_without_server", "screen")
    else:
        yield from _about_server(screen, server)


def _about_reach(screen: ScreenSettings) -> Iterator[Message]:
    """Yield what is wrong with the names under which the pages are reached."""
    if not is_loopback(screen.address) and screen.certificate is None:
        yield problem("screen_unencrypted", "screen")
    if screen.address in EVERY_ADDRESS and not screen.hosts:
        yield problem("screen_without_name", "screen.hosts")
    for host in screen.hosts:
        if not is_host(host):
            yield problem("no_host_name", "screen.hosts", name=host)


def is_host(text: str) -> bool:
    """Return whether a text in small letters names a computer, perhaps with a port."""
    found = HOST.fullmatch(text)
    if found is None or len(found["name"]) > _LONGEST_HOST:
        return False
    if found["port"] is not None and not 1 <= int(found["port"]) <= _MOST_PORTS:
        return False
    if not found["name"].startswith("["):
        return True
    try:
        ipaddress.IPv6Address(found["name"][1:-1])
    except ValueError:
        return False
    return True


def _meet(one: str, other: str) -> bool:
    """Whether two addresses may be listened at only once with the same port."""
    every = one in EVERY_ADDRESS or other in EVERY_ADDRESS
    local = {one, other} <= {"127.0.0.1", "::1", "localhost"} and "localhost" in {one, other}
    return every or local or one == other


def _about_server(screen: ScreenSettings, server: ServerSettings) -> Iterator[Message]:
    if server.port == 0:
        yield problem("server_port_changes", "server.port")
    if screen.client_certificate is not None and server.certificate is None:
        yield problem("server_without_certificate", "screen.client_certificate")
    if screen.client_certificate is None and server.users is not None:
        yield problem("client_certificate_missing", "screen")
    elif screen.client_certificate is None and screen.user:
        yield problem("user_unencrypted", "screen.user")
    if not screen.user and server.anonymous_role != "viewer":
        yield problem("screen_sees_nothing", "screen.user")
    if screen.user and server.users is None:
        yield problem("server_without_users", "screen.user")
    if server.users is None and not screen.view_without_login:
        yield problem("nobody_can_look", "screen.view_without_login")
