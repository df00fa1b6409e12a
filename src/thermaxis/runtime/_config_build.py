"""From the tables of a configuration file to frozen values: whether the parts fit together."""

import ipaddress
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar
from urllib.parse import parse_qs, urlsplit

from thermaxis.compensation._compensation import Compensation
from thermaxis.compensation._limits import Limits
from thermaxis.compensation._quality import SensorRules
from thermaxis.compensation._supervisor import SupervisorRules
from thermaxis.errors import ConfigurationError, printable
from thermaxis.runtime._config_connection import Problem, read_secret, refuse_readable
from thermaxis.runtime._config_sections import (
    HistorianSection,
    MachineFile,
    MetricsSection,
    OutputSection,
    ServerSection,
)
from thermaxis.runtime._config_settings import (
    DiameterSettings,
    FlagSettings,
    HistorianSettings,
    InputSettings,
    MachineConfiguration,
    MachineRules,
    MetricsSettings,
    ModelFile,
    OutputSettings,
    ServerSettings,
    SinkSettings,
    SourceSettings,
    read_model_file,
)
from thermaxis.runtime._connection import Secret
from thermaxis.runtime._ports import (
    DIAMETER,
    OTHER_COMPENSATION,
    interlock_name,
    spare_name,
)
from thermaxis.runtime._sign import AWAY, OFFSET_UNITS, SIGNS, TOWARDS

if TYPE_CHECKING:
    from thermaxis.runtime._connection import ConnectionSettings

_T = TypeVar("_T")
_REMEDY = "Correct the value; docs/machine-toml.md says what every key means"
_NODE = re.compile(
    r"(?:(?:ns=\d{1,5}|nsu=[^;]+);)?(?:i=\d{1,10}|s=.+|g=[0-9a-fA-F-]{36}|b=[A-Za-z0-9+/]+=*)"
)
_NODE_REMEDY = 'Write it as "ns=2;s=Name", "nsu=urn:of:the:server;s=Name" or "ns=2;i=1001"'
_FORGOTTEN_DATABASES = ("", "/", "/:memory:")
_ENCRYPTED_MODES = ("require", "verify-ca", "verify-full")
_VALIDITY = {"margin_k": "validity_margin_k", "lowest_weight": "lowest_weight"}
_PLACES = {field: f"[validity], {key}" for key, field in _VALIDITY.items()}
_LINUXCNC_UNITS = ("mm", "inch")


class _Problems:
    """What is wrong, in the order in which it was found."""

    def __init__(self) -> None:
        self.found: list[Problem] = []

    def add(self, place: str, what: str, remedy: str) -> None:
        """Take one mistake."""
        self.found.append(Problem(place, what, remedy))

    def guarded(self, place: str, build: Callable[[], _T]) -> _T | None:
        """Return what a function builds; take its error at a place if it cannot."""
        try:
            return build()
        except ConfigurationError as error:
            where = error.where.removeprefix(place).removeprefix(", ")
            self.add(f"{place}, {where}" if where else place, error.what, error.remedy or _REMEDY)
            return None


def nearest(name: str, known: Iterable[str]) -> str:
    """Return advice on a name that nobody knows.

    Parameters
    ----------
    name : str
        The name.
    known : iterable of str
        Names that are known.

    Returns
    -------
    str
        The nearest one if there is one, else all.
    """
    listed = sorted(known)
    found = get_close_matches(name[:100], listed, n=1, cutoff=0.6)
    if found:
        return f"Did you mean {printable(found[0], 80)}"
    if not listed:
        return "There are none"
    return f"There are {printable(', '.join(listed), 200)}"


def is_loopback(address: str) -> bool:
    """Return whether an address can be reached from this computer only.

    Parameters
    ----------
    address : str
        Address or name.

    Returns
    -------
    bool
        False for every name but ``localhost``.
    """
    if address == "localhost":
        return True
    try:
        return ipaddress.ip_address(address.strip("[]")).is_loopback
    except ValueError:
        return False


def build_configuration(
    file: Path, sections: MachineFile
) -> MachineConfiguration | tuple[Problem, ...]:
    """Read what the tables name, and fit the parts together.

    Parameters
    ----------
    file : Path
        The configuration file, absolute.
    sections : MachineFile
        Its tables.

    Returns
    -------
    MachineConfiguration or tuple of Problem
        The configuration, or everything that is wrong.
    """
    return _Build(file, sections).build()


class _Build:
    """One file on its way to a configuration."""

    def __init__(self, file: Path, sections: MachineFile) -> None:
        self.file = file
        self.folder = file.parent
        self.sections = sections
        self.problems = _Problems()

    def build(self) -> MachineConfiguration | tuple[Problem, ...]:
        """Return the configuration, or everything that is wrong."""
        machine = self.sections.machine
        model = self.problems.guarded(
            "[machine], model", lambda: read_model_file(self._path(machine.model))
        )
        model_folder = self._model_folder(machine.model_folder)
        connections = self._connections()
        source, sink = self._source(), self._sink()
        inputs, outputs = self._inputs(), self._outputs()
        self._check_flags()
        self._check_nodes()
        if model is not None:
            self._check_names(model)
        rules = self._rules()
        historian = self._historian(self.sections.historian)
        server = self._server(self.sections.server)
        metrics = self._metrics(self.sections.metrics)
        compensation = None
        if model is not None and rules is not None and not self.problems.found:
            compensation = self._compensation(rules, model)
        if (
            self.problems.found
            or model is None
            or rules is None
            or compensation is None
            or historian is None
        ):
            return tuple(self.problems.found)
        replayed = source.kind == "replay"
        other, diameter = self.sections.other_compensation, self.sections.diameter
        return MachineConfiguration(
            path=self.file,
            name=machine.name,
            rules=rules,
            model=model,
            compensation=compensation,
            model_folder=model_folder,
            state_file=self._path(machine.state_file or f"{self.file.stem}.state.json"),
            resume_enabled=self.sections.supervisor.resume_enabled,
            resume_within_s=self.sections.supervisor.resume_within_s,
            at_stop=self.sections.supervisor.at_stop,
            stop_within_s=self.sections.supervisor.stop_within_s,
            connections=connections,
            source=source,
            sink=sink,
            inputs=inputs,
            interlocks={
                name: FlagSettings(entry.node, entry.met)
                for name, entry in self.sections.interlock.items()
                if not replayed
            },
            other_compensation=(
                None if other is None or replayed else FlagSettings(other.node, other.active)
            ),
            diameter=(
                None
                if diameter is None or replayed
                else DiameterSettings(diameter.node, diameter.unit)
            ),
            outputs=outputs,
            historian=historian,
            server=server,
            metrics=metrics,
        )

    def _path(self, name: str) -> Path:
        return self.folder / name

    # ---- machine, connections, source, sink -----------------------------------------------------

    def _model_folder(self, name: str) -> Path | None:
        if not name:
            return None
        folder = self._path(name)
        try:
            there = folder.is_dir()
        except (OSError, ValueError):
            there = False
        if not there:
            self.problems.add(
                "[machine], model_folder",
                f"there is no folder {folder}",
                "Make it, or leave the key out: then no other model can be chosen",
            )
        return folder

    def _connections(self) -> dict[str, "ConnectionSettings"]:
        used = {
            part.connection
            for part in (self.sections.source, self.sections.sink)
            if part.kind == "opcua"
        }
        found: dict[str, ConnectionSettings] = {}
        for name, section in self.sections.connection.items():
            if name not in used:
                continue
            place = f"[connection.{name}]"
            settings = self.problems.guarded(
                place,
                lambda name=name, section=section, place=place: section.settings(
                    name, self.folder, where=place
                ),
            )
            if settings is not None:
                found[name] = settings
        return found

    def _check_connection(self, table: str, name: str) -> None:
        known = self.sections.connection
        if not name:
            self.problems.add(f"[{table}]", "the key connection is missing", nearest(name, known))
        elif name not in known:
            self.problems.add(
                f"[{table}], connection",
                f"there is no table [connection.{printable(name, 60)}]",
                nearest(name, known),
            )

    def _refuse_foreign(
        self, table: str, kind: str, values: Mapping[str, object], own: Collection[str]
    ) -> None:
        """Refuse keys that another kind of the same table has."""
        for key, value in values.items():
            if value and key not in own:
                self.problems.add(
                    f"[{table}], {key}",
                    f"{key} has no meaning where the kind is {kind}",
                    "Leave it out, or choose another kind",
                )

    def _source(self) -> SourceSettings:
        section = self.sections.source
        values = {
            "connection": section.connection,
            "log": section.log,
            "mapping": section.mapping,
            "as_fast_as_possible": section.as_fast_as_possible,
            "may_move_a_machine": section.may_move_a_machine,
        }
        if section.kind == "opcua":
            self._refuse_foreign("source", section.kind, values, ("connection",))
            self._check_connection("source", section.connection)
            return SourceSettings(section.kind, section.connection)
        # a connection may stay, so that a replay is one changed word
        self._refuse_foreign("source", section.kind, {}, ())
        if not section.log:
            self.problems.add("[source]", "the key log is missing", "Name the log to be replayed")
        if self.sections.sink.kind != "dry" and not section.may_move_a_machine:
            self.problems.add(
                "[sink], kind",
                "a replayed log would move the machine by temperatures that it does not have",
                'Write kind = "dry"; or, where the sink is a simulation, may_move_a_machine ='
                " true in the table [source]",
            )
        log = self._existing("[source], log", section.log)
        mapping = self._existing("[source], mapping", section.mapping)
        return SourceSettings(
            section.kind,
            log=log,
            mapping=mapping,
            as_fast_as_possible=section.as_fast_as_possible,
        )

    def _existing(self, place: str, name: str) -> Path | None:
        if not name:
            return None
        path = self._path(name)
        try:
            there = path.is_file()
        except (OSError, ValueError):
            there = False
        if not there:
            self.problems.add(
                place,
                f"there is no file {path}",
                "Check the name; relative names count from the folder of the configuration file",
            )
        return path

    def _sink(self) -> SinkSettings:
        section = self.sections.sink
        if section.kind == "opcua":
            self._check_connection("sink", section.connection)
            return SinkSettings(section.kind, section.connection, section.heartbeat_node)
        if section.kind == "linuxcnc":
            values = {
                "connection": section.connection,
                "heartbeat_node": section.heartbeat_node,
            }
            self._refuse_foreign("sink", section.kind, values, ())
        return SinkSettings(section.kind)

    # ---- inputs, outputs, flags -----------------------------------------------------------------

    def _inputs(self) -> dict[str, InputSettings]:
        wanted = self.sections.source.kind == "opcua"
        for name, section in self.sections.input.items():
            if wanted and not section.node:
                self.problems.add(
                    f"[input.{name}]", "the key node is missing", "Name the node of the sensor"
                )
        return {
            name: InputSettings(
                section.node if wanted else "",
                section.unit,
                section.spare_node if wanted else "",
            )
            for name, section in self.sections.input.items()
        }

    def _outputs(self) -> dict[str, OutputSettings]:
        kind = self.sections.sink.kind
        check = {"opcua": self._check_opcua_output, "linuxcnc": self._check_linuxcnc_output}
        joints: dict[int, str] = {}
        for name, section in self.sections.output.items():
            if kind == "dry":
                continue
            check[kind](f"output.{name}", section)
            self._check_sign(f"output.{name}", section.sign)
            if section.joint is not None and joints.setdefault(section.joint, name) != name:
                self.problems.add(
                    f"[output.{name}], joint",
                    f"the output {joints[section.joint]} has the same joint",
                    "Give every output a joint of its own",
                )
        if kind == "dry":
            return {name: OutputSettings() for name in self.sections.output}
        return {
            name: OutputSettings(
                section.node,
                section.read_back_node or section.node,
                section.effective_node,
                section.joint,
                section.unit,
                section.sign,
                read_back_stated=bool(section.read_back_node),
            )
            for name, section in self.sections.output.items()
        }

    def _check_opcua_output(self, table: str, section: OutputSection) -> None:
        if not section.node:
            self.problems.add(
                f"[{table}]", "the key node is missing", "Name the node that is written to"
            )
        if section.joint is not None:
            self._refuse_foreign(table, "opcua", {"joint": True}, ())
        self._check_unit(table, section.unit, tuple(OFFSET_UNITS))

    def _check_linuxcnc_output(self, table: str, section: OutputSection) -> None:
        values = {
            "node": section.node,
            "read_back_node": section.read_back_node,
            "effective_node": section.effective_node,
        }
        self._refuse_foreign(table, "linuxcnc", values, ())
        if section.joint is None:
            self.problems.add(
                f"[{table}]", "the key joint is missing", "Write the joint's number, such as 2"
            )
        self._check_unit(table, section.unit, _LINUXCNC_UNITS)

    def _check_unit(self, table: str, unit: str, known: tuple[str, ...]) -> None:
        if not unit:
            self.problems.add(
                f"[{table}]",
                "the key unit is missing: it has no default",
                f"Write one of {', '.join(known)}, as the machine's documents say",
            )
        elif unit not in known:
            self.problems.add(
                f"[{table}], unit",
                f"the unit '{printable(unit, 40)}' is not known here",
                f"Write one of {', '.join(known)}",
            )

    def _check_sign(self, table: str, sign: str) -> None:
        remedy = f'Write "{AWAY}" or "{TOWARDS}"; commissioning proves it'
        if not sign:
            self.problems.add(f"[{table}]", "the key sign is missing: it has no default", remedy)
        elif sign not in SIGNS:
            self.problems.add(f"[{table}], sign", "this sentence is not known", remedy)

    def _check_flags(self) -> None:
        """Refuse names that would be read as something else."""
        for name in self.sections.interlock:
            if not re.fullmatch(r"[\w-]{1,60}", name):
                self.problems.add(
                    f"[interlock.{printable(name, 60)}]",
                    "the name has other signs than letters, digits, _ and -, or is too long",
                    "Choose another name",
                )
        taken = {OTHER_COMPENSATION, DIAMETER}
        taken |= {interlock_name(name) for name in self.sections.interlock}
        taken |= {spare_name(name) for name in self.sections.input}
        for name in self.sections.input:
            if name in taken:
                self.problems.add(
                    f"[input.{printable(name, 60)}]",
                    "the name is that of something else that is read",
                    "Rename the channel in the model and here",
                )

    def _check_nodes(self) -> None:
        """Check the form of every node, and that nothing is read or written by two names."""
        readers = {place: node for place, node in self._read_nodes() if node}
        writers = {place: node for place, node in self._written_nodes() if node}
        for place, node in {**readers, **writers}.items():
            if not _NODE.fullmatch(node):
                self.problems.add(place, "this is no node", _NODE_REMEDY)
        seen: dict[tuple[str, str], str] = {}
        for places in (writers, readers):
            for place, node in places.items():
                key = (self._connection_of(place), node)
                first = seen.setdefault(key, place)
                if first != place:
                    self.problems.add(
                        place, f"the node is the same as that of {first}", "Check both nodes"
                    )

    def _connection_of(self, place: str) -> str:
        written = place.startswith(("[sink]", "[output."))
        return (self.sections.sink if written else self.sections.source).connection

    def _read_nodes(self) -> Iterable[tuple[str, str]]:
        for name, entry in self.sections.input.items():
            yield f"[input.{name}], node", entry.node
            yield f"[input.{name}], spare_node", entry.spare_node
        for name, flag in self.sections.interlock.items():
            yield f"[interlock.{name}], node", flag.node
        if self.sections.other_compensation is not None:
            yield "[other_compensation], node", self.sections.other_compensation.node
        if self.sections.diameter is not None:
            yield "[diameter], node", self.sections.diameter.node

    def _written_nodes(self) -> Iterable[tuple[str, str]]:
        yield "[sink], heartbeat_node", self.sections.sink.heartbeat_node
        for name, entry in self.sections.output.items():
            yield f"[output.{name}], node", entry.node
            if entry.read_back_node != entry.node:
                yield f"[output.{name}], read_back_node", entry.read_back_node
            if entry.effective_node not in {entry.node, entry.read_back_node}:
                yield f"[output.{name}], effective_node", entry.effective_node

    def _check_names(self, model: ModelFile) -> None:
        """Check that the tables fit the model; inputs that it does not need are only recorded."""
        file = model.path.name
        for kind, wanted, given in (
            ("input", model.model.channels, self.sections.input),
            ("output", tuple(o.name for o in model.model.outputs), self.sections.output),
        ):
            word = "channel" if kind == "input" else "output"
            foreign = [name for name in given if name not in wanted]
            for name in wanted:
                if name not in given:
                    near = nearest(name, foreign) if foreign else f"Add a table [{kind}.{name}]"
                    self.problems.add(
                        "[machine], model",
                        f"the model {file} has the {word} {printable(name, 60)}, and there is no"
                        f" table [{kind}.{printable(name, 60)}]",
                        near,
                    )
            if kind == "output":
                for name in foreign:
                    self.problems.add(
                        f"[output.{name}]",
                        f"the model {file} has no output of this name",
                        nearest(name, wanted),
                    )

    # ---- rules ----------------------------------------------------------------------------------

    def _rules(self) -> MachineRules | None:
        sections = self.sections
        replayed = sections.source.kind == "replay"
        sensors: dict[str, SensorRules] = {}
        for name, entry in sections.input.items():
            rules = self._dataclass(f"[input.{name}]", SensorRules, entry.stated(SensorRules))
            if rules is not None:
                sensors[name] = rules
        limits: dict[str, Limits] = {}
        for name, output in sections.output.items():
            bounds = self._dataclass(f"[output.{name}]", Limits, output.stated(Limits))
            if bounds is not None:
                limits[name] = bounds
        supervisor = self._dataclass(
            "[supervisor]", SupervisorRules, sections.supervisor.stated(SupervisorRules)
        )
        if supervisor is None or len(sensors) < len(sections.input):
            return None
        if len(limits) < len(sections.output):
            return None
        return MachineRules(
            cycle_s=sections.machine.cycle_s,
            sensors=sensors,
            limits=limits,
            supervisor=supervisor,
            spares=frozenset(
                name for name, entry in sections.input.items() if entry.spare_node and not replayed
            ),
            interlocks=() if replayed else tuple(sections.interlock),
            validity={
                field: getattr(sections.validity, key)
                for key, field in _VALIDITY.items()
                if key in sections.validity.model_fields_set
            },
        )

    def _dataclass(
        self, place: str, rules: Callable[..., _T], values: Mapping[str, float | bool]
    ) -> _T | None:
        return self.problems.guarded(place, lambda: rules(**values))

    def _compensation(self, rules: MachineRules, model: ModelFile) -> Compensation | None:
        try:
            return rules.applied_to(model.model)
        except ConfigurationError as error:
            place = _PLACES.get(error.where, f"[machine], {error.where}")
            self.problems.add(place, error.what, error.remedy or _REMEDY)
            return None

    # ---- historian, servers ---------------------------------------------------------------------

    def _historian(self, section: HistorianSection) -> HistorianSettings | None:
        table = "[historian]"
        url = section.url or f"sqlite:///{self.file.stem}.history.db"
        try:
            parts = urlsplit(url)
            host, password = parts.hostname or "", parts.password
        except ValueError:
            self.problems.add(f"{table}, url", "this is no address of a database", _URL_REMEDY)
            return None
        if password is not None or "password" in parse_qs(parts.query):
            self.problems.add(
                f"{table}, url",
                "the address contains a password",
                "Write it into a file that only its owner can read, name that as password_file,"
                " and change the password",
            )
            return None
        secret = self._secret(
            table, section.password_file, section.password_environment, key="password"
        )
        if secret is None:
            return None
        if parts.scheme == "sqlite":
            return self._sqlite(section, url, secret)
        if parts.scheme not in {"postgresql", "postgresql+psycopg"}:
            self.problems.add(f"{table}, url", "this database is not known", _URL_REMEDY)
            return None
        mode = parse_qs(parts.query).get("sslmode", [""])[-1]
        if host and not is_loopback(host) and mode not in _ENCRYPTED_MODES:
            self.problems.add(
                f"{table}, url",
                "the connection to another computer is not encrypted for certain",
                f"End the address with ?sslmode={_ENCRYPTED_MODES[-1]}",
            )
        return HistorianSettings(url, secret, section.retention_days)

    def _sqlite(
        self, section: HistorianSection, url: str, secret: Secret
    ) -> HistorianSettings | None:
        name = url.removeprefix("sqlite://")
        if secret.reveal():
            self.problems.add(
                "[historian], password_file",
                "SQLite has no password",
                "Leave it out; who may read the file is decided by its folder's permissions",
            )
        if name in _FORGOTTEN_DATABASES or not name.startswith("/") or "?" in name:
            self.problems.add("[historian], url", "this is no file of SQLite", _URL_REMEDY)
            return None
        path = self._path(name[1:])
        return HistorianSettings(f"sqlite:///{path}", secret, section.retention_days)

    def _secret(self, table: str, file: str, environment: str, *, key: str) -> Secret | None:
        """Return the secret, an empty one where none is stated, None where it cannot be read."""
        if file and environment:
            self.problems.add(
                f"{table}, {key}_environment",
                f"the {key} is stated twice",
                f"Give {key}_file or {key}_environment",
            )
            return None
        if not file and not environment:
            return Secret("")
        return self.problems.guarded(
            table,
            lambda: read_secret(file, environment, folder=self.folder, where=table, key=key),
        )

    def _key_pair(
        self, table: str, certificate: str, private_key: str
    ) -> tuple[Path | None, Path | None]:
        if bool(certificate) != bool(private_key):
            lacking = "private_key" if certificate else "certificate"
            self.problems.add(
                table,
                f"the key {lacking} is missing",
                "Certificate and private key go together",
            )
        path = self._existing(f"{table}, certificate", certificate)
        key = self._path(private_key) if private_key else None
        if key is not None:
            place = f"{table}, private_key"
            self.problems.guarded(place, lambda: refuse_readable(key, where=place))
        return path, key

    def _server(self, section: ServerSection | None) -> ServerSettings | None:
        if section is None:
            return None
        table = "[server]"
        certificate, private_key = self._key_pair(table, section.certificate, section.private_key)
        users = self._existing(f"{table}, users", section.users)
        if not is_loopback(section.address):
            for lacking, key in ((users, "users"), (certificate, "certificate")):
                if lacking is None:
                    self.problems.add(
                        table,
                        f"the server can be reached from other computers, and {key} is missing",
                        "Write users, certificate and private_key, or the address 127.0.0.1",
                    )
            if section.anonymous_role != "none":
                self.problems.add(
                    f"{table}, anonymous_role",
                    "the server can be reached from other computers by people without a name",
                    'Write "none", or the address 127.0.0.1',
                )
        return ServerSettings(
            section.address, section.port, users, section.anonymous_role, certificate, private_key
        )

    def _metrics(self, section: MetricsSection | None) -> MetricsSettings | None:
        if section is None:
            return None
        table = "[metrics]"
        certificate, private_key = self._key_pair(table, section.certificate, section.private_key)
        token = self._secret(table, section.token_file, section.token_environment, key="token")
        if token is None:
            return None
        if not is_loopback(section.address):
            for there, key in ((token.reveal(), "token_file"), (certificate, "certificate")):
                if not there:
                    self.problems.add(
                        table,
                        f"the figures can be read from other computers, and {key} is missing",
                        "Write token_file, certificate and private_key, or the address 127.0.0.1",
                    )
        return MetricsSettings(section.address, section.port, token, certificate, private_key)


_URL_REMEDY = (
    'Write url = "sqlite:///lathe.history.db", or "postgresql+psycopg://user@127.0.0.1/database"'
    " with password_file"
)
