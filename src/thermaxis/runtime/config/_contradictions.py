"""What cannot be in a configuration though each of its tables is right by itself."""

import ipaddress
import math
import re
from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import fields
from itertools import combinations
from typing import Any, Final, get_args, get_type_hints

from thermaxis.codes import Message, Value
from thermaxis.compensation import MOST_EXPECTED, CompensationModel
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings import nearest, problem
from thermaxis.runtime._keys import Needed, Only
from thermaxis.runtime._ports import (
    DATUM,
    DIAMETER,
    OTHER_COMPENSATION,
    counter_name,
    interlock_name,
    probe_name,
    redundant_name,
)
from thermaxis.runtime._sign import AWAY, OFFSET_UNITS, SIGNS, TOWARDS
from thermaxis.runtime.config._tables import (
    InputSettings,
    MachineFile,
    OutputSettings,
    ProbeSettings,
    ScreenSettings,
    ServerSettings,
    SinkSettings,
    SourceSettings,
    tables_of,
)
from thermaxis.runtime.host import is_loopback, parsed_address
from thermaxis.runtime.sinks import HalUnit
from thermaxis.runtime.sources import HAL

EVERY_ADDRESS: Final = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # noqa: S104 - not listened at
"""Addresses that mean every one of this computer, and its own for each."""
_LABEL = r"[a-z0-9_](?:[a-z0-9_-]{0,61}[a-z0-9_])?"
HOST = re.compile(rf"(?P<name>{_LABEL}(?:\.{_LABEL})*|\[[0-9a-f:.]+\])(?::(?P<port>\d{{1,5}}))?")
"""Name of a computer in small letters, perhaps with a port."""
_LONGEST_HOST = 253
_MOST_PORTS = 65_535
_Marked = SourceSettings | SinkSettings | InputSettings | OutputSettings
_Row = tuple[bool, str, str, dict[str, Value]]
"""Whether something is wrong, its code, its place and its values."""


def contradictions(file: MachineFile) -> Iterator[Message]:
    """Yield what cannot be between the tables of a file."""
    source, sink = file.source, file.sink
    yield from _of_kind("source", source, source.kind)
    if source.kind == "opcua":
        yield from _about_connection("source", source.connection, file)
    elif source.kind == "replay" and sink.kind != "dry" and not source.may_move_a_machine:
        yield problem("replay_moves_machine", "sink.kind")
    if sink.kind != "dry":
        yield from _of_kind("sink", sink, sink.kind)
    if sink.kind == "opcua":
        yield from _about_connection("sink", sink.connection, file)
    for name, entry in file.inputs.items():
        yield from _of_kind(f"input.{name}", entry, source.kind)
        if entry.on_change and not source.life_node and source.kind == "opcua":
            yield problem("key_needed_here", "source", name="life_node")
    if sink.kind != "dry":
        for name, output in file.outputs.items():
            yield from _of_kind(f"output.{name}", output, sink.kind)
            yield from _about_output(f"output.{name}", output, sink.kind)
    for name, probe in file.probes.items():
        yield from _about_probe(f"probe.{name}", probe)
        most_s = max(probe.oldest_s, MOST_EXPECTED * file.machine.cycle_s)
        if probe.delay_s >= most_s:
            values = {"value": probe.delay_s, "least": 0.0, "most": most_s}
            yield problem("outside_range", f"probe.{name}.delay_s", **values)
    yield from _about_names(file)
    yield from _about_nodes(file)


def _of_kind(table: str, entry: _Marked, kind: str) -> Iterator[Message]:
    """Yield keys of another kind of source or sink, and what this kind needs."""
    stated = {one.name for one in fields(entry) if getattr(entry, one.name) != one.default}
    hints = get_type_hints(type(entry), include_extras=True)
    for name in (one.name for one in fields(entry) if one.name in stated):
        marks = getattr(hints[name], "__metadata__", ())
        if any(isinstance(mark, Only) and mark.kind != kind for mark in marks):
            yield problem("key_of_other_kind", f"{table}.{name}", name=name, kind=kind)
    yield from _lacking(table, type(entry), stated, kind)


def _lacking(table: str, of: type, stated: Collection[str], kind: str) -> Iterator[Message]:
    for name, hint in get_type_hints(of, include_extras=True).items():
        if name not in stated and Needed(kind) in getattr(hint, "__metadata__", ()):
            yield problem("key_needed_here", table, name=name)


def undecided(tables: Any) -> Iterator[Message]:
    """Yield what the kinds of source and sink need, of a file in which other things are wrong."""
    for many, one, of in (("input", "source", InputSettings), ("output", "sink", OutputSettings)):
        with suppress(AttributeError, LookupError, TypeError):  # what is no table is told already
            kind = tables[one]["kind"]
            for name, entry in tables[many].items():
                stated = {key for key, value in entry.items() if value != ""}
                yield from _lacking(f"{many}.{name}", of, stated, kind)


def _about_connection(table: str, name: str, file: MachineFile) -> Iterator[Message]:
    known = tuple(file.connections)
    if name and name not in known:
        near = nearest(name, known)
        yield problem("unknown_name", f"{table}.connection", name=name, known=near)


def _about_output(table: str, output: OutputSettings, kind: str) -> Iterator[Message]:
    units: tuple[str, ...] = tuple(OFFSET_UNITS) if kind == "opcua" else get_args(HalUnit)
    if output.unit and output.unit not in units:
        yield problem("unknown_choice", f"{table}.unit", name=output.unit, known=units)
    if output.sign and output.sign not in SIGNS:
        values = {"sign": output.sign, "away": AWAY, "towards": TOWARDS}
        yield problem("unknown_sign", f"{table}.sign", **values)


def _about_probe(table: str, probe: ProbeSettings) -> Iterator[Message]:
    """Yield what a probe, or what is touched, needs."""
    touched = probe.largest_um is not None
    for lacks, name in (
        (not probe.node and (bool(probe.counter_node) or not touched), "node"),
        (bool(probe.node) and not probe.unit, "unit"),
        (bool(probe.counter_node) and not touched, "largest_um"),
        (touched and probe.largest_rate_um_per_s is None, "largest_rate_um_per_s"),
    ):
        if lacks:
            yield problem("key_needed_here", table, name=name)
    start_um2, left_um2 = probe.start_um**2, probe.discrepancy_um**2
    seen_um2 = probe.noise_um**2 + left_um2
    least_um = math.sqrt(start_um2 * seen_um2 / (start_um2 + seen_um2) + left_um2)
    # a touch leaves so much: who wants less would touch without an end
    if probe.wanted_std_um is not None and probe.wanted_std_um <= least_um:
        values = {"value": probe.wanted_std_um, "least": round(least_um, 2), "most": 1000.0}
        yield problem("outside_range", f"{table}.wanted_std_um", **values)


def _about_names(file: MachineFile) -> Iterator[Message]:
    """Refuse names that would be read as something else."""
    for name in file.interlocks:
        if not re.fullmatch(r"[\w-]{1,60}", name):
            yield problem("interlock_name", f"interlock.{name}")
    taken = {OTHER_COMPENSATION, DIAMETER, DATUM}
    taken |= {interlock_name(name) for name in file.interlocks}
    taken |= {redundant_name(name) for name in file.inputs}
    taken |= {of(name) for name in file.probes for of in (probe_name, counter_name)}
    for name in file.inputs:
        if name in taken:
            yield problem("reserved_name", f"input.{name}", name=name)


def _about_nodes(file: MachineFile) -> Iterator[Message]:
    """Refuse a node that is named for two purposes; an offset may be read where it is written."""
    writes: dict[tuple[str, str], str] = {}
    reads: dict[tuple[str, str, int | None], str] = {}
    for written, connection in ((True, file.sink.connection), (False, file.source.connection)):
        for table, entry in tables_of(file):
            if table.startswith(("sink", "output.")) is not written:
                continue
            for name in (one.name for one in fields(entry) if one.name.endswith("node")):
                node, key = getattr(entry, name), f"{table}.{name}"
                if not node:
                    continue
                place, bit = (connection, node), getattr(entry, "bit", None)
                pin = file.source.kind == "linuxcnc" and not written
                if file.source.kind != "replay" and node.startswith(HAL) is not pin:
                    yield problem("no_hal_pin" if pin else "hal_pin", key, text=node)
                if written:
                    first = writes.setdefault(place, key)
                else:  # two bits of a word may be read, but none of one that is written
                    first = writes.get(place) or reads.setdefault((*place, bit), key)
                of_offset = table.startswith("output.") and first.rpartition(".")[0] == table
                if first != key and not of_offset:
                    yield problem("node_twice", key, first=first)


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
    """Yield ports that two tables share, and what of one makes the pages of another useless.

    The pages show what the status server says, and each log-in is a connection of its own to it.
    """
    screen, server, rows = file.screen, file.server, [*_about_ports(file)]
    if screen is not None:
        rows += _about_pages(screen)
        rows.append((server is None, "screen_without_server", "screen", {}))
        rows += [] if server is None else _about_server(screen, server)
    for wrong, code, key, values in rows:
        if wrong:
            yield problem(code, key, **values)


def check_pages(screen: ScreenSettings) -> None:
    """Check how pages of no machine are served."""
    for wrong, code, key, values in _about_pages(screen):
        if wrong:
            raise ConfigurationError.of(problem(code, key, **values))


def _about_pages(screen: ScreenSettings) -> Iterator[_Row]:
    reach, secret = "screen.hosts", screen.password_file or screen.password_environment
    outside, sealed = not is_loopback(screen.address), screen.certificate is not None
    yield outside and not sealed, "screen_unencrypted", "screen", {}
    yield screen.address in EVERY_ADDRESS and not screen.hosts, "screen_without_name", reach, {}
    for host in screen.hosts:
        yield not is_host(host), "no_host_name", reach, {"name": host}
    for panel in screen.pin_from:
        yield parsed_address(panel) is None, "no_address", "screen.pin_from", {"name": panel}
    longest_s = screen.longest_login_s
    yield screen.idle_s > longest_s, "idle_too_long", "screen.idle_s", {"longest_s": longest_s}
    yield bool(secret) and not screen.user, "password_without_user", "screen.user", {}
    yield bool(screen.user) and not secret, "user_needs_password", "screen.user", {}


def _about_ports(file: MachineFile) -> Iterator[_Row]:
    tables = (("server", file.server), ("metrics", file.metrics), ("screen", file.screen))
    for (table, first), (other, second) in combinations(tables, 2):
        if first is not None and second is not None and first.port == second.port != 0:
            met = _meet(first.address, second.address)
            yield met, "port_twice", f"{other}.port", {"table": table}


def _about_server(screen: ScreenSettings, server: ServerSettings) -> Iterator[_Row]:
    sealed, users = screen.client_certificate is not None, server.users is not None
    named, key = bool(screen.user), "screen.user"
    unproven = sealed and server.certificate is None
    yield server.port == 0, "server_port_changes", "server.port", {}
    yield unproven, "server_without_certificate", "screen.client_certificate", {}
    yield users and not sealed, "client_certificate_missing", "screen", {}
    yield named and not sealed and not users, "user_unencrypted", key, {}
    yield not named and server.anonymous_role != "viewer", "screen_sees_nothing", key, {}
    yield named and not users, "server_without_users", key, {}
    hidden = not users and not screen.view_without_login
    yield hidden, "nobody_can_look", "screen.view_without_login", {}


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
