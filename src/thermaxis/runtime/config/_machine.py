"""Configuration of one machine: ``machine.toml`` to frozen values, and every mistake at its place.

.. code-block:: toml

    [machine]
    name = "vertical lathe"
    model = "models/lathe.json"

    [source]
    kind = "opcua"
    connection = "control"

Every key is listed in ``docs/machine-toml.md``.

Not protected: a configuration that is free of mistakes may still name the wrong node, or the
wrong sign. The self-test looks at the machine; the sign is proven at commissioning.
"""

import os
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, TypeVar, cast, final

from thermaxis.codes import Message, Place
from thermaxis.compensation import (
    Compensation,
    CompensationModel,
    Limits,
    SensorRules,
    SupervisorRules,
    TouchRules,
)
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings import placed, problem, read_toml, refuse, tree_of
from thermaxis.runtime._connection import ConnectionSettings, Secret
from thermaxis.runtime.config._configuration import (
    MachineConfiguration,
    MachineRules,
    read_model_file,
)
from thermaxis.runtime.config._contradictions import (
    about_model,
    about_screen,
    contradictions,
    undecided,
)
from thermaxis.runtime.config._tables import (
    MachineFile,
    ProbeSettings,
    SinkSettings,
    part_of,
    require_file,
    require_folder,
    tables_of,
)
from thermaxis.runtime.history import HistorianSettings, check_url, refuse_password, sqlite_path
from thermaxis.runtime.host import read_secret as secret_in, refuse_readable
from thermaxis.runtime.sinks import HalSettings, HalUnit, LinuxCncOutput, LinuxCncSettings

_VALIDITY = {"margin_k": "validity_margin_k", "lowest_weight": "lowest_weight"}
_T = TypeVar("_T")


def examine_machine(path: Path | str) -> MachineConfiguration | tuple[Message, ...]:
    """Read a configuration, or say everything that is wrong in it.

    Parameters
    ----------
    path : Path or str
        The file, TOML in UTF-8, at most 1 MB. Paths in it count from its folder.

    Returns
    -------
    MachineConfiguration or tuple of Message
        The configuration; or what is wrong, in the order of the file's tables, at least one.
        No value of a secret, and none of an unknown key, occurs in it.

    Raises
    ------
    ConfigurationError
        If the file cannot be read or is no TOML; then the line is named.
    """
    file = Path(path).absolute()
    tables = read_toml(file)
    found = tree_of(MachineFile, tables, file.parent)
    if isinstance(found, MachineFile):
        found = _Reading(found, file).configuration()
    else:
        found += undecided(tables)
    if isinstance(found, MachineConfiguration):
        return found
    from thermaxis.files.settings import with_lines  # noqa: PLC0415 - if there are some

    return with_lines(found, file)


def read_machine(path: Path | str) -> MachineConfiguration:
    """Read the configuration of a machine.

    Parameters
    ----------
    path : Path or str
        The file, TOML in UTF-8, at most 1 MB. Paths in it count from its folder.

    Returns
    -------
    MachineConfiguration
        What it says, with the model that it names; secrets are read and masked.

    Raises
    ------
    ConfigurationError
        If the file, or a file that it names, cannot be read; a key is unknown, missing, or has a
        value that cannot be; parts contradict each other or do not fit the model; or others can
        read a secret. Several mistakes are one error, ``several_problems``.
    """
    found = examine_machine(path)
    if isinstance(found, MachineConfiguration):
        return found
    raise refuse(found, path)


def state_file_of(path: Path | str) -> Path:
    """Return where a configuration keeps the loop's state; nothing else of it need be right."""
    file = Path(path).absolute()
    machine = read_toml(file).get("machine")
    table = cast("dict[str, object]", machine) if isinstance(machine, dict) else {}
    stated = table.get("state_file")
    return file.parent / (str(stated) if stated else f"{file.stem}.state.json")


@final
class _Reading:
    """Reads what the tables of a file name, fits it together, and collects what is wrong."""

    def __init__(self, file: MachineFile, path: Path) -> None:
        self.file, self.path = file, path
        self.problems: list[Message] = []

    def configuration(self) -> MachineConfiguration | list[Message]:
        """Return the configuration, or everything that is wrong."""
        file, attempt = self.file, self._attempt
        model = attempt("machine.model", lambda: read_model_file(file.machine.model))
        attempt("machine.model_folder", lambda: require_folder(file.machine.model_folder))
        connections = self._connections()
        self.problems += contradictions(file)
        if file.source.kind == "replay":
            for key in ("log", "mapping"):
                attempt(f"source.{key}", lambda key=key: require_file(getattr(file.source, key)))
        if model is not None:
            self.problems += about_model(file, model.model)
        history = attempt("historian", self._history)
        metrics = attempt("metrics", lambda: _with_secret("metrics", file.metrics, "token"))
        screen = attempt("screen", lambda: _with_secret("screen", file.screen))
        self.problems += about_screen(file)
        if model is None or history is None or self.problems:
            return self.problems
        read = _acting(file)
        rules = _rules(read, file.probes)
        compensation = attempt("", lambda: _fitted(rules, model.model))
        sink = compensation and attempt("", lambda: _sink_of(read))
        if compensation is None or sink is None:
            return self.problems
        name = f"{self.path.stem}.state.json"
        state_file = file.machine.state_file or self.path.with_name(name)
        tables: dict[str, Any] = vars(read) | {
            "machine": replace(file.machine, state_file=state_file),
            "connections": connections,
            "sink": sink,
            "historian": history,
            "metrics": metrics,
            "screen": screen,
        }
        self.problems += _overwritten(file, self.path, state_file, history.url)
        if self.problems:
            return self.problems
        return MachineConfiguration(
            **tables,
            path=self.path,
            model=model,
            rules=rules,
            compensation=compensation,
        )

    def _attempt(self, key: str, build: Callable[[], _T]) -> _T | None:
        """Return what a function builds, or take its error and return None."""
        try:
            return build()
        except ConfigurationError as error:
            self.problems.append(placed(error.message, key))
            return None

    def _connections(self) -> dict[str, ConnectionSettings]:
        """Return the connections that are used; files and secrets of others are not read."""
        parts = (self.file.source, self.file.sink)
        used = {part.connection for part in parts if part.kind == "opcua"}
        found: dict[str, ConnectionSettings] = {}
        for name, entry in self.file.connections.items():
            if name in used:
                table = f"connection.{name}"
                opened = self._attempt(table, lambda n=name, e=entry: open_connection(n, e))
                found |= {} if opened is None else {name: opened}
        return found

    def _history(self) -> HistorianSettings:
        """Return where cycles are recorded."""
        table, key = self.file.historian, "historian.url"
        url = table.url or f"sqlite:///{self.path.stem}.history.db"
        refuse_password(url, key=key)
        file, folder = check_url(url, key=key), table.folder
        table = _with_secret("historian", table)
        if file is not None:
            if table.password:
                raise ConfigurationError("sqlite_without_password", key="historian.password_file")
            url = f"sqlite:///{self.path.parent / file}"
        else:
            folder = folder or self.path.with_name(f"{self.path.stem}.postgresql")
        machine = self.file.machine.name
        return replace(table, url=url, machine=machine, folder=folder)


def open_connection(name: str, entry: ConnectionSettings) -> ConnectionSettings:
    """Return a connection with its name and its password; what it names must be there."""
    table = f"connection.{name}"
    found = replace(_with_secret(table, entry), name=name)
    for key in ("certificate", "private_key", "server_certificate"):
        require_file(getattr(entry, key), f"{table}.{key}")
    if entry.private_key is not None:
        refuse_readable(entry.private_key, key=f"{table}.private_key")
    return found


def _with_secret(table: str, entry: _T, key: str = "password") -> _T:
    """Return a table with the secret that it names by a file or an environment variable."""
    file: Path | None = getattr(entry, f"{key}_file", None)
    name: str = getattr(entry, f"{key}_environment", "")
    variable = Place(key=f"{table}.{key}_environment")
    if file is not None and name:
        raise ConfigurationError("stated_twice", name=key, place=variable)
    if name and not os.environ.get(name):
        raise ConfigurationError("variable_not_set", name=name, place=variable)
    if file is not None:
        secret = secret_in(file, key=f"{table}.{key}_file")
    elif name:
        secret = Secret(os.environ[name])
    else:
        return entry
    return replace(cast("Any", entry), **{key: secret})


def _overwritten(file: MachineFile, path: Path, state: Path, url: str) -> Iterator[Message]:
    """Yield where state or history would be written over another file."""
    taken = {path.resolve(): path.name}
    for table, entry in tables_of(file):
        for one in fields(entry):
            named, key = getattr(entry, one.name), f"{table}.{one.name}"
            if isinstance(named, Path) and key != "machine.state_file":
                taken.setdefault(named.resolve(), key)
    for key, written in (("machine.state_file", state), ("historian.url", sqlite_path(url))):
        if written is not None:
            first = taken.setdefault(written.resolve(), key)
            if first != key:
                yield problem("file_overwritten", key, other=first)
            elif written is state and not _is_state(state):
                yield problem("no_state_file", key)


def _is_state(path: Path) -> bool:
    """Whether a file may become the loop's state: it is none yet, empty, or begins as one does."""
    try:
        with path.open("rb") as file:
            start = file.read(67)
    except OSError:  # another check says so
        return True
    return not start.strip(b"\0") or re.fullmatch(rb'[0-9a-f]{64}\n\{"', start) is not None


def _acting(file: MachineFile) -> MachineFile:
    """Return what is left of the tables where a log is replayed, or nothing is written."""
    if file.source.kind == "replay":
        away = {"node": "", "redundant_node": "", "scale": 1.0, "on_change": False}
        file = replace(
            file,
            source=replace(file.source, connection="", life_node="", datum_node=""),
            inputs={name: replace(entry, **away) for name, entry in file.inputs.items()},
            interlocks={},
            other_compensation=None,
            diameter=None,
            probes={},
        )
    if file.sink.kind == "dry":
        keys = ("node", "read_back_node", "effective_node", "unit", "sign")
        away = dict.fromkeys(keys, "")
        outputs = {name: replace(entry, **away) for name, entry in file.outputs.items()}
        file = replace(
            file, sink=SinkSettings(kind="dry", halcmd=file.sink.halcmd), outputs=outputs
        )
    return file


def _rules(file: MachineFile, probes: Mapping[str, ProbeSettings]) -> MachineRules:
    validity = {field: getattr(file.validity, key) for key, field in _VALIDITY.items()}
    return MachineRules(
        cycle_s=file.machine.cycle_s,
        sensors={name: part_of(SensorRules, entry) for name, entry in file.inputs.items()},
        limits={name: part_of(Limits, entry) for name, entry in file.outputs.items()},
        supervisor=part_of(SupervisorRules, file.supervisor),
        redundant=frozenset(name for name, entry in file.inputs.items() if entry.redundant_node),
        interlocks=tuple(file.interlocks),
        validity={field: value for field, value in validity.items() if value is not None},
        touches={name: part_of(TouchRules, one) for name, one in probes.items() if one.limits},
    )


def _fitted(rules: MachineRules, model: CompensationModel) -> Compensation:
    try:
        return rules.applied_to(model)
    except ConfigurationError as error:
        keys = {field: f"validity.{key}" for key, field in _VALIDITY.items()} | {"sensors": "input"}
        keys |= {"touches.limits": f"probe.{error.place.channel}.largest_um"}
        key = keys.get(error.place.key, f"machine.{error.place.key}")
        raise error.at(Place(key=key)) from None


def _sink_of(file: MachineFile) -> SinkSettings:
    """Return the sink; that of LinuxCNC with its joints, limits and times."""
    sink = file.sink
    if sink.kind != "linuxcnc":
        return sink
    outputs: dict[str, LinuxCncOutput] = {}
    key = "sink"
    try:
        for name, entry in file.outputs.items():
            key = f"output.{name}"
            outputs[name] = LinuxCncOutput(
                cast("int", entry.joint),
                cast("HalUnit", entry.unit),
                entry.sign,
                part_of(Limits, entry),
                entry.largest_acceleration_um_per_s2 or 0.0,
            )
        key, times = "sink", {one.name: getattr(sink, one.name) for one in fields(HalSettings)}
        settings = LinuxCncSettings(outputs=outputs, cycle_s=file.machine.cycle_s, **times)
    except ConfigurationError as error:
        raise ConfigurationError.of(placed(error.message, key)) from None
    return replace(sink, linuxcnc=settings)
