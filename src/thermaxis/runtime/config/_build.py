"""From the tables of a configuration file to frozen values: whether the parts fit together."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import cast, final, get_args

from thermaxis.codes import Message, Place
from thermaxis.compensation import Compensation, Limits, SensorRules, SupervisorRules
from thermaxis.errors import ConfigurationError
from thermaxis.runtime._connection import ConnectionSettings
from thermaxis.runtime._ports import (
    DIAMETER,
    OTHER_COMPENSATION,
    interlock_name,
    probe_name,
    redundant_name,
)
from thermaxis.runtime._sign import AWAY, OFFSET_UNITS, SIGNS, TOWARDS
from thermaxis.runtime.config._problems import Problems, nearest
from thermaxis.runtime.config._screen import screen_settings
from thermaxis.runtime.config._sections import MachineFile, OutputSection
from thermaxis.runtime.config._servers import historian_settings, metrics_settings, server_settings
from thermaxis.runtime.config._settings import (
    DiameterSettings,
    FlagSettings,
    InputSettings,
    MachineConfiguration,
    MachineRules,
    ModelFile,
    OutputSettings,
    ProbeSettings,
    SinkSettings,
    SourceSettings,
    read_model_file,
)
from thermaxis.runtime.opcua import parse_node
from thermaxis.runtime.sinks import HalUnit, LinuxCncOutput, LinuxCncSettings

_VALIDITY = {"margin_k": "validity_margin_k", "lowest_weight": "lowest_weight"}
_KEYS = {field: f"validity.{key}" for key, field in _VALIDITY.items()}
_NOT_REPLAYED: Mapping[str, object] = {
    "interlock": {},
    "other_compensation": None,
    "diameter": None,
    "probe": {},
}
"""Tables of nodes that are not read while a log is replayed."""
_LINUXCNC_KEYS = ("watchdog_s", "thread", "halcmd")


def build_configuration(
    file: Path, sections: MachineFile
) -> MachineConfiguration | tuple[Message, ...]:
    """Read what the tables name, and fit the parts together."""
    return _Build(file, sections).build()


@final
class _Build:
    """One file on its way to a configuration."""

    def __init__(self, file: Path, sections: MachineFile) -> None:
        self.file = file
        self.sections = sections
        self.problems = Problems(file.parent)
        self.replayed = sections.source.kind == "replay"
        self.read = sections.model_copy(update=_NOT_REPLAYED) if self.replayed else sections

    def build(self) -> MachineConfiguration | tuple[Message, ...]:
        """Return the configuration, or everything that is wrong."""
        sections, problems, read = self.sections, self.problems, self.read
        machine, other = sections.machine, read.other_compensation
        model = problems.guarded(
            "machine.model", lambda: read_model_file(self._path(machine.model))
        )
        model_folder = self._model_folder(machine.model_folder)
        connections = self._connections()
        source, sink = self._source(), self._sink()
        inputs, outputs = self._inputs(), self._outputs()
        self._check_names_that_are_read()
        self._check_nodes()
        if model is not None:
            self._check_model(model)
        rules = self._rules()
        if rules is not None and sink.kind == "linuxcnc":
            sink = replace(sink, linuxcnc=self._linuxcnc(rules.limits))
        historian = historian_settings(
            sections.historian, problems, sections.machine.name, f"{self.file.stem}.history"
        )
        server = server_settings(sections.server, problems)
        metrics = metrics_settings(sections.metrics, problems)
        screen = screen_settings(
            sections.screen, server, metrics, problems, server_stated=sections.server is not None
        )
        compensation = None
        if model is not None and rules is not None and not problems.found:
            compensation = self._compensation(rules, model)
        if model is None or rules is None or compensation is None or historian is None:
            return tuple(problems.found)
        return MachineConfiguration(
            path=self.file,
            name=machine.name,
            rules=rules,
            model=model,
            compensation=compensation,
            model_folder=model_folder,
            state_file=self._path(machine.state_file or f"{self.file.stem}.state.json"),
            resume_enabled=sections.supervisor.resume_enabled,
            resume_within_s=sections.supervisor.resume_within_s,
            at_stop=sections.supervisor.at_stop,
            stop_within_s=sections.supervisor.stop_within_s,
            ask_enables=sections.supervisor.ask_enables,
            connections=connections,
            source=source,
            sink=sink,
            inputs=inputs,
            interlocks={n: FlagSettings(e.node, e.met) for n, e in read.interlock.items()},
            other_compensation=None if other is None else FlagSettings(other.node, other.active),
            diameter=read.diameter and DiameterSettings(**read.diameter.model_dump()),
            probes={n: ProbeSettings(**entry.model_dump()) for n, entry in read.probe.items()},
            outputs=outputs,
            historian_url=historian[0],
            historian=historian[1],
            server=server,
            metrics=metrics,
            screen=screen,
        )

    def _path(self, name: str) -> Path:
        return self.file.parent / name

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
            place = Place(str(folder), key="machine.model_folder")
            self.problems.found.append(ConfigurationError("folder_not_found", place=place).message)
        return folder

    def _connections(self) -> dict[str, ConnectionSettings]:
        """Check every connection and return those that are used; secrets of others are not read."""
        parts = (self.sections.source, self.sections.sink)
        used = {part.connection for part in parts if part.kind == "opcua"}
        found: dict[str, ConnectionSettings] = {}
        for name, section in self.sections.connection.items():
            settings = self.problems.guarded(
                f"connection.{name}",
                lambda name=name, section=section: section.settings(
                    name, self.file.parent, used=name in used
                ),
            )
            if settings is not None and name in used:
                found[name] = settings
        return found

    def _check_connection(self, table: str, name: str) -> None:
        known = self.sections.connection
        if not name:
            self._lacking(table, "connection")
        elif name not in known:
            self.problems.add(
                "unknown_name", f"{table}.connection", name=name, known=tuple(nearest(name, known))
            )

    def _lacking(self, table: str, key: str) -> None:
        self.problems.add("key_needed_here", table, name=key)

    def _source(self) -> SourceSettings:
        section, problems = self.sections.source, self.problems
        if section.kind == "opcua":
            keys = ("log", "mapping", "as_fast_as_possible", "may_move_a_machine")
            problems.refuse_foreign("source", "opcua", [k for k in keys if getattr(section, k)])
            self._check_connection("source", section.connection)
            return SourceSettings(section.kind, section.connection)
        # the connection may stay, so that a replay of the real configuration is few changed words
        if not section.log:
            self._lacking("source", "log")
        if self.sections.sink.kind != "dry" and not section.may_move_a_machine:
            problems.add("replay_moves_machine", "sink.kind")
        return SourceSettings(
            section.kind,
            log=problems.existing("source.log", section.log),
            mapping=problems.existing("source.mapping", section.mapping),
            as_fast_as_possible=section.as_fast_as_possible,
        )

    def _sink(self) -> SinkSettings:
        section, problems = self.sections.sink, self.problems
        if section.kind == "opcua":
            stated = [key for key in _LINUXCNC_KEYS if getattr(section, key) is not None]
            problems.refuse_foreign("sink", "opcua", stated)
            self._check_connection("sink", section.connection)
            return SinkSettings(section.kind, section.connection, section.heartbeat_node)
        if section.kind == "linuxcnc":
            keys = ("connection", "heartbeat_node")
            problems.refuse_foreign("sink", "linuxcnc", [k for k in keys if getattr(section, k)])
        return SinkSettings(section.kind)

    # ---- inputs, outputs, flags -----------------------------------------------------------------

    def _inputs(self) -> dict[str, InputSettings]:
        inputs: dict[str, InputSettings] = {}
        for name, section in self.sections.input.items():
            if self.replayed:
                inputs[name] = InputSettings("", section.unit)
                continue
            if not section.node:
                self._lacking(f"input.{name}", "node")
            inputs[name] = InputSettings(
                section.node, section.unit, section.redundant_node, section.scale
            )
        return inputs

    def _outputs(self) -> dict[str, OutputSettings]:
        kind = self.sections.sink.kind
        if kind == "dry":
            return {name: OutputSettings() for name in self.sections.output}
        outputs: dict[str, OutputSettings] = {}
        for name, section in self.sections.output.items():
            table = f"output.{name}"
            if kind == "opcua":
                self._check_opcua_output(table, section)
            else:
                self._check_linuxcnc_output(table, section)
            self._check_sign(table, section.sign)
            outputs[name] = OutputSettings(
                section.node,
                section.read_back_node or section.node,
                section.effective_node,
                section.unit,
                section.sign,
                read_back_stated=bool(section.read_back_node),
            )
        return outputs

    def _check_opcua_output(self, table: str, section: OutputSection) -> None:
        if not section.node:
            self._lacking(table, "node")
        keys = ("joint", "largest_acceleration_um_per_s2")
        stated = [key for key in keys if getattr(section, key) is not None]
        self.problems.refuse_foreign(table, "opcua", stated)
        self._check_unit(table, section.unit, tuple(OFFSET_UNITS))

    def _check_linuxcnc_output(self, table: str, section: OutputSection) -> None:
        keys = ("node", "read_back_node", "effective_node")
        self.problems.refuse_foreign(table, "linuxcnc", [k for k in keys if getattr(section, k)])
        if section.joint is None:
            self._lacking(table, "joint")
        self._check_unit(table, section.unit, get_args(HalUnit))

    def _check_unit(self, table: str, unit: str, known: tuple[str, ...]) -> None:
        if not unit:
            self._lacking(table, "unit")
        elif unit not in known:
            self.problems.add("unknown_choice", f"{table}.unit", name=unit, known=known)

    def _check_sign(self, table: str, sign: str) -> None:
        if not sign:
            self._lacking(table, "sign")
        elif sign not in SIGNS:
            self.problems.add(
                "unknown_sign", f"{table}.sign", sign=sign, away=AWAY, towards=TOWARDS
            )

    def _check_names_that_are_read(self) -> None:
        """Refuse names that would be read as something else."""
        for name in self.sections.interlock:
            if not re.fullmatch(r"[\w-]{1,60}", name):
                self.problems.add("interlock_name", f"interlock.{name}")
        taken = {OTHER_COMPENSATION, DIAMETER}
        taken |= {interlock_name(name) for name in self.sections.interlock}
        taken |= {redundant_name(name) for name in self.sections.input}
        taken |= {probe_name(name) for name in self.sections.probe}
        for name in self.sections.input:
            if name in taken:
                self.problems.add("reserved_name", f"input.{name}", name=name)

    def _check_nodes(self) -> None:
        """Check the form of every node, and that no node is named for two purposes."""
        seen: dict[tuple[str, str], str] = {}
        source, sink = self.sections.source.connection, self.sections.sink.connection
        for connection, nodes in (
            (sink, self._written_nodes()),
            (source, self._read_nodes()),
        ):
            for key, node in nodes:
                if not node:
                    continue
                self.problems.guarded(key, lambda node=node: parse_node(node))
                first = seen.setdefault((connection, node), key)
                if first != key:
                    self.problems.add("node_twice", key, first=first)

    def _read_nodes(self) -> Iterable[tuple[str, str]]:
        for name, entry in self.sections.input.items():
            yield f"input.{name}.node", entry.node
            yield f"input.{name}.redundant_node", entry.redundant_node
        for name, flag in self.sections.interlock.items():
            yield f"interlock.{name}.node", flag.node
        if self.sections.other_compensation is not None:
            yield "other_compensation.node", self.sections.other_compensation.node
        if self.sections.diameter is not None:
            yield "diameter.node", self.sections.diameter.node
        for name, probe in self.sections.probe.items():
            yield f"probe.{name}.node", probe.node

    def _written_nodes(self) -> Iterable[tuple[str, str]]:
        yield "sink.heartbeat_node", self.sections.sink.heartbeat_node
        for name, entry in self.sections.output.items():
            yield f"output.{name}.node", entry.node
            if entry.read_back_node != entry.node:
                yield f"output.{name}.read_back_node", entry.read_back_node
            if entry.effective_node not in {entry.node, entry.read_back_node}:
                yield f"output.{name}.effective_node", entry.effective_node

    def _check_model(self, model: ModelFile) -> None:
        """Check that the tables fit the model; inputs that it does not need are only recorded."""
        outputs = tuple(output.name for output in model.model.outputs)
        self._check_lacking(model, "input", "channel_without_table", model.model.channels)
        self._check_lacking(model, "output", "output_without_table", outputs)
        for table in ("output", "probe"):
            for name in getattr(self.sections, table):
                if name not in outputs:
                    self.problems.add(
                        "not_of_model",
                        f"{table}.{name}",
                        name=name,
                        model=model.path.name,
                        known=tuple(nearest(name, outputs)),
                    )

    def _check_lacking(
        self, model: ModelFile, table: str, code: str, wanted: tuple[str, ...]
    ) -> None:
        given: Iterable[str] = getattr(self.sections, table)
        for name in wanted:
            if name not in given:
                table_of = f"{table}.{name}"
                self.problems.add(code, "machine.model", model=model.path.name, table=table_of)

    # ---- rules ----------------------------------------------------------------------------------

    def _rules(self) -> MachineRules | None:
        sections, guarded = self.sections, self.problems.guarded
        sensors: dict[str, SensorRules] = {}
        for name, entry in sections.input.items():
            stated = entry.stated(SensorRules)
            rules = guarded(f"input.{name}", lambda stated=stated: SensorRules(**stated))
            if rules is not None:
                sensors[name] = rules
        limits: dict[str, Limits] = {}
        for name, output in sections.output.items():
            stated = output.stated(Limits)
            bounds = guarded(f"output.{name}", lambda stated=stated: Limits(**stated))
            if bounds is not None:
                limits[name] = bounds
        times = sections.supervisor.stated(SupervisorRules)
        supervisor = guarded("supervisor", lambda: SupervisorRules(**times))
        whole = len(sensors) == len(sections.input) and len(limits) == len(sections.output)
        if supervisor is None or not whole:
            return None
        redundant = [name for name, entry in sections.input.items() if entry.redundant_node]
        return MachineRules(
            cycle_s=sections.machine.cycle_s,
            sensors=sensors,
            limits=limits,
            supervisor=supervisor,
            redundant=frozenset() if self.replayed else frozenset(redundant),
            interlocks=tuple(self.read.interlock),
            validity={
                field: getattr(sections.validity, key)
                for key, field in _VALIDITY.items()
                if key in sections.validity.model_fields_set
            },
        )

    def _linuxcnc(self, limits: Mapping[str, Limits]) -> LinuxCncSettings | None:
        outputs: dict[str, LinuxCncOutput] = {}
        for name, section in self.sections.output.items():
            if section.joint is None or section.unit not in get_args(HalUnit):
                return None
            made = self.problems.guarded(
                f"output.{name}",
                lambda section=section, limits=limits[name]: LinuxCncOutput(
                    cast("int", section.joint),
                    cast("HalUnit", section.unit),
                    section.sign,
                    limits,
                    section.largest_acceleration_um_per_s2 or 0.0,
                ),
            )
            if made is None:
                return None
            outputs[name] = made
        cycle_s = self.sections.machine.cycle_s
        stated = self.sections.sink.stated(LinuxCncSettings)
        return self.problems.guarded(
            "sink", lambda: LinuxCncSettings(outputs=outputs, cycle_s=cycle_s, **stated)
        )

    def _compensation(self, rules: MachineRules, model: ModelFile) -> Compensation | None:
        try:
            return rules.applied_to(model.model)
        except ConfigurationError as error:
            key = _KEYS.get(error.place.key, f"machine.{error.place.key}")
            self.problems.found.append(error.at(Place(key=key)).message)
            return None
