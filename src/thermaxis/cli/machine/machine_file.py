"""Write the beginning of a machine.toml from what an OPC UA server shows; nothing is written there.

Variables are told apart by their names, types, units and values. What was guessed says so, and
what a person must decide (sign, limit, rate) is left so that `thermaxis check` refuses it.
"""

import argparse
import asyncio
import json
import re
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import cast

from thermaxis.cli._arguments import adder
from thermaxis.codes import printable
from thermaxis.errors import ConfigurationError
from thermaxis.files import read_model
from thermaxis.files.settings import read_toml, refuse, tree_of
from thermaxis.runtime import AWAY, TOWARDS, ConnectionSettings, SystemClock
from thermaxis.runtime.config import open_connection
from thermaxis.runtime.host import whole_file
from thermaxis.runtime.opcua import FoundNode, browse_server

_NAME = "control"
_OFFSET = re.compile("offset|shift|correct|korrek|komp")
_ACCEPTED = re.compile(rf"accept|read.?back|({_OFFSET.pattern}).*(act(ual)?|ist)$")
_EFFECTIVE = re.compile(rf"effect|acting|({_OFFSET.pattern}).*eff$")
_BEAT = re.compile("heart|beat|alive|life")
_TEMPERATURE = re.compile(r"temp|teplot|(^|_)t\d*(_|$)|_c$|sensor")
_TOUCH, _COUNT = re.compile("touch|antast|dotyk"), re.compile("count|number")
_DIAMETER = re.compile("diam|durchm|prumer")
_CELSIUS = {"°C": "degC", "degC": "degC", "C": "degC", "K": "K", "°F": "degF"}
_MET, _UNMET = re.compile("referenc|homed|machine_?on|ready"), re.compile("emerg|e_?stop|homing")
_KINDS = re.compile(
    "touch|count(er)?|offset|shift|correction|korrektur|accept(ed)?|eff(ect(ive)?)?|acting|read.?back|_|(?<=.)um$|mm$"
    "|(?<=.)(act(ual)?|ist|set(point)?|soll)$"
)
_LENGTHS = {"mm": "mm", "µm": "um", "μm": "um", "um": "um"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("url URL", "address of the server, such as opc.tcp://192.168.214.241:4840")
    add("-o, --output MACHINE.toml", "file to write; one that is there is kept", Path)
    add("--model MODEL.json", "the model: its channels and outputs name inputs and offsets", Path)
    add(
        "--connection FILE.toml",
        "file with a table [connection.NAME]: security, user, certificates (default: none of"
        " them, as on one computer)",
        Path,
    )


def run(arguments: argparse.Namespace) -> int:
    """Browse the server and write the file."""
    output: Path | None = arguments.output
    if output is not None and output.exists():
        raise ConfigurationError("file_kept", file=output)
    folder = (output or Path("machine.toml")).absolute().parent
    table, settings = _connection(arguments.connection, arguments.url, folder)
    found = asyncio.run(browse_server(open_connection(_NAME, settings), SystemClock()))
    text = "\n".join(_lines(found, table, arguments.model, folder)) + "\n\n"
    text += "".join(
        f"# not used: {_told(one)} {one.node}\n" for one in found if _quoted(one.node) not in text
    )
    if output is None:
        sys.stdout.write(text)
        return 0
    with whole_file(output) as stream:
        stream.write(text.encode())
    left, guessed = text.count("  # decide"), text.count("  # guessed")
    told = f"{len(found)} variables; decide {left} lines, confirm {guessed} that were guessed"
    sys.stdout.write(f"{output}: {told}, then thermaxis check {output}\n")
    return 0


def _connection(
    file: Path | None, url: str, folder: Path
) -> tuple[dict[str, object], ConnectionSettings]:
    """Return the table as it stands in a file of a folder, and what it says."""
    table: dict[str, object] = {"security": "none"}
    if file is not None:
        tables = cast("dict[str, dict[str, object]]", read_toml(file).get("connection", {}))
        if len(tables) != 1:
            raise ConfigurationError("connection_not_alone", file=file, key="connection")
        (table,) = tables.values()
    table = {**table, "url": url}
    found = tree_of(ConnectionSettings, table, (file or Path("machine.toml")).absolute().parent)
    if isinstance(found, list):
        raise refuse(found, file or url)
    named = ((key, getattr(found, key)) for key in table)
    return table | {key: _named(one, folder) for key, one in named if isinstance(one, Path)}, found


def _named(file: Path, folder: Path) -> str:
    """Return a file's name as it counts from a folder: whole where it does not lie there."""
    file = file.absolute()
    return (file.relative_to(folder) if file.is_relative_to(folder) else file).as_posix()


def _lines(
    found: Sequence[FoundNode],
    table: Mapping[str, object],
    model_file: Path | None,
    folder: Path,
) -> Iterator[str]:
    """Yield the file line by line."""
    model = None if model_file is None else read_model(model_file)
    left = [one for one in found if not isinstance(one.value, bool)]
    beats = _taken(left, _BEAT, writable=True)
    touches = _taken(left, _TOUCH)
    counters = _taken(touches, _COUNT)
    accepted, effective = _taken(left, _ACCEPTED), _taken(left, _EFFECTIVE)
    offsets = _taken(left, _OFFSET, writable=True)
    diameters, sensors = _taken(left, _DIAMETER), _taken(left, _TEMPERATURE, units=_CELSIUS)
    flags = [one for one in found if isinstance(one.value, bool)]
    yield "# Written from what the server shows. A guess says so: confirm it. What is to be decided"
    yield "# is 0 or empty, so that thermaxis check refuses it: docs/machine-toml.md."
    name = _named(model_file or folder / "model.json", folder)
    yield f'\n[machine]\nname = "machine"\nmodel = {_quoted(name)}'
    yield f"\n[connection.{_NAME}]"
    yield from (
        f"{key} = {_quoted(value) if isinstance(value, str) else value}"
        for key, value in table.items()
    )
    yield f'\n[source]\nkind = "opcua"\nconnection = "{_NAME}"'
    yield f'\n[sink]\nkind = "opcua"\nconnection = "{_NAME}"'
    yield from _node("heartbeat_node", beats[0] if beats else None)
    channels = {_short(one): one for one in sensors}
    if model is not None:
        channels = {name: _nearest(name, sensors) for name in model.channels}
    for name, sensor in channels.items():
        yield from _input(name, sensor)
    yield from _flags(flags)
    if diameters:
        yield from ("\n[diameter]", *_node("node", diameters[0]), 'unit = "mm"  # guessed')
    outputs = {f"{_core_of(_short(one)).upper() or _short(one)}_um": one for one in offsets}
    if model is not None:
        outputs = {one.name: _nearest(one.name, offsets) for one in model.outputs}
    for name, offset in outputs.items():
        yield from _output(name, offset, accepted, effective)
        probe, counter = _nearest(name, touches), _nearest(name, counters)
        if probe is not None and counter is not None:
            yield f"\n[probe.{_quoted(name)}]"
            yield from (*_node("node", probe), *_node("counter_node", counter), _unit(probe))
            yield from _limits("what touches add")


def _input(name: str, sensor: FoundNode | None) -> Iterator[str]:
    yield f"\n[input.{_quoted(name)}]"
    yield from _node("node", sensor)
    unit, whole, value = "degC", False, 0.0
    if sensor is not None:
        value, whole = float(sensor.value), "Int" in sensor.data_type
        unit = _CELSIUS.get(sensor.unit, "K" if not whole and 223.0 < value < 373.0 else "degC")
    stated = sensor is not None and sensor.unit in _CELSIUS
    yield f'unit = "{unit}"  # {"as the server says" if stated else "guessed"}'
    if whole and abs(value) >= 100.0:
        yield "scale = 0.1  # guessed: tenths"
    yield "lowest_c = 5.0  # guessed\nhighest_c = 80.0  # guessed"


def _output(
    name: str,
    offset: FoundNode | None,
    accepted: Sequence[FoundNode],
    effective: Sequence[FoundNode],
) -> Iterator[str]:
    yield f"\n[output.{_quoted(name)}]"
    yield from _node("node", offset)
    short = "" if offset is None else _short(offset)
    yield from _node("read_back_node", _nearest(short, accepted))
    yield from _node("effective_node", _nearest(short, effective))
    yield _unit(offset)
    yield f'sign = ""  # decide: "{AWAY}", or "{TOWARDS}"'
    yield from _limits("output limit")


def _unit(one: FoundNode | None) -> str:
    unit = "" if one is None else _LENGTHS.get(one.unit, "")
    return f'unit = "{unit}"  # {"as the server says" if unit else "decide"}'


def _limits(what: str) -> Iterator[str]:
    yield f"largest_um = 0  # decide: {what} in micrometres"
    yield "largest_rate_um_per_s = 0  # decide: fastest change"


def _flags(flags: Sequence[FoundNode]) -> Iterator[str]:
    """Yield interlocks and what tells of another compensation."""
    for one in flags:
        name = _short(one).lower()
        if "comp" in name:
            yield "\n[other_compensation]"
            yield from (*_node("node", one), "active = true  # guessed")
        elif _MET.search(name) or _UNMET.search(name):
            yield f"\n[interlock.{_quoted(_short(one))}]"
            met = "false" if _UNMET.search(name) else "true"
            yield from (*_node("node", one), f"met = {met}  # guessed")


def _taken(
    left: list[FoundNode],
    words: re.Pattern[str],
    *,
    writable: bool = False,
    units: Collection[str] = (),
) -> list[FoundNode]:
    """Take what has such a name, or such a unit, and may be written if it is to be."""
    taken = [
        one
        for one in left
        if (one.writable or not writable)
        and (words.search(_short(one).lower()) or one.unit in units)
    ]
    left[:] = [one for one in left if one not in taken]
    return taken


def _nearest(name: str, among: Sequence[FoundNode]) -> FoundNode | None:
    """Return the variable whose name is nearest to a name, the words of its kind left out."""
    names = {_core_of(_short(one)): one for one in reversed(among)}
    near = get_close_matches(_core_of(name), names, n=1, cutoff=0.0 if len(names) == 1 else 0.6)
    return names[near[0]] if near else None


def _core_of(name: str) -> str:
    return _KINDS.sub("", name.lower())


def _short(one: FoundNode) -> str:
    return one.path.rpartition(".")[2]


def _node(key: str, one: FoundNode | None) -> Iterator[str]:
    node, told = ("", "not found") if one is None else (one.node, _told(one))
    yield f"{key} = {_quoted(node)}  # {told}"


def _told(one: FoundNode) -> str:
    value = str(one.value).lower() if isinstance(one.value, bool) else f"{one.value:g}"
    return f"{one.path}, {one.data_type}, holds {value}{' ' * bool(one.unit)}{one.unit}"


def _quoted(text: str) -> str:
    """Return a text as TOML has it."""
    return json.dumps(printable(text), ensure_ascii=False)
