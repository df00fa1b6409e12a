"""Everything that a configuration says about one machine, with the files that it names read."""

import errno
import os
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import Any, Final, cast, final

from thermaxis.compensation import (
    Compensation,
    CompensationModel,
    Limits,
    SensorRules,
    SupervisorRules,
    TouchRules,
)
from thermaxis.errors import ConfigurationError, ThermaxisError
from thermaxis.runtime._connection import ConnectionSettings, Secret
from thermaxis.runtime.config._contradictions import EVERY_ADDRESS
from thermaxis.runtime.config._tables import MachineFile

_SECURITY: Final = "Basic256Sha256"
"""Security policy of encrypted connections to the status server: every one of them offers it."""
_STATUS_PATH: Final = "thermaxis"
"""Path of the status server's address."""


@final
@dataclass(frozen=True, slots=True)
class ModelFile:
    """A model and the file that it came from."""

    path: Path
    """The file."""
    sha256: str
    """Hash of the model's content."""
    model: CompensationModel
    """The model."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class MachineRules:
    """What holds for every model that may run on the machine."""

    cycle_s: float
    """Time from cycle to cycle. [s]"""
    sensors: Mapping[str, SensorRules]
    """Rules by input; there may be more inputs than the model has channels."""
    limits: Mapping[str, Limits]
    """Limits by output."""
    supervisor: SupervisorRules
    """Rules of the supervisor."""
    redundant: frozenset[str]
    """Inputs that have a redundant sensor."""
    interlocks: tuple[str, ...]
    """Names of the conditions that must be met."""
    validity: Mapping[str, float]
    """What is stated of `Compensation.validity_margin_k` and `Compensation.lowest_weight`."""
    touches: Mapping[str, TouchRules]
    """How touches are believed, by output."""

    def __post_init__(self) -> None:
        for name in ("sensors", "limits", "validity", "touches"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    def applied_to(self, model: CompensationModel) -> Compensation:
        """Return a compensation with a model."""
        witnesses = {r.moves_with for n, r in self.sensors.items() if n in model.channels}
        wanted = witnesses.union(model.channels)
        sensors = {name: rules for name, rules in self.sensors.items() if name in wanted}
        return Compensation(
            model=model,
            sensors=sensors,
            limits=self.limits,
            supervisor=self.supervisor,
            cycle_s=self.cycle_s,
            redundant=self.redundant.intersection(model.channels),
            interlocks=self.interlocks,
            touches=self.touches,
            **cast("Mapping[str, Any]", self.validity),
        )


@final
@dataclass(frozen=True, kw_only=True)
class MachineConfiguration(MachineFile):
    """The tables of a configuration file, and what follows from them.

    Tables of nodes are empty where a log is replayed, nodes of outputs where nothing is written.

    Not protected: whether nodes, units and signs are those of the machine. The self-test finds
    gross mistakes, commissioning proves the sign.
    """

    path: Path
    """The file, absolute."""
    model: ModelFile
    """The model to start with."""
    rules: MachineRules
    """What holds for every model."""
    compensation: Compensation
    """Rules and model together."""

    @property
    def name(self) -> str:
        """Name of the machine."""
        return self.machine.name

    @property
    def state_file(self) -> Path:
        """File in which the state is kept."""
        return self.machine.state_file or self.path.with_suffix(".state.json")

    def shown_names(self, language: str, model_sha256: str = "") -> dict[str, str]:
        """Return what people call inputs, interlocks, and parts of the model that are an input's.

        By the channel, interlock or part; only of those that have a name. Where another model is in
        force, its parts have none.
        """
        found = {
            key: name
            for wanted in ("en", language)
            for key, one in {**self.interlocks, **self.inputs}.items()
            for stated, name in one.name.items()
            if stated == wanted
        }
        if model_sha256 not in {"", self.model.sha256}:
            return found
        parts = {(part.name, part.plus) for one in self.model.model.outputs for part in one.parts}
        count = Counter(text for pair in parts for text in set(pair))
        own = {
            part: found[plus]
            for part, plus in parts
            if count[part] == count[plus] == 1 and plus in found
        }
        return {**own, **found}

    def screen_connection(self, user: str, password: Secret) -> ConnectionSettings:
        """Return the connection of a person, or of every page, to the status server.

        It is encrypted, with the status server's own certificate pinned, wherever both sides have
        one; without encryption nobody but an anonymous viewer of this computer gets in.
        """
        server, screen = self.server, self.screen
        if server is None or screen is None:
            raise ConfigurationError("no_screen_table", file=self.path)
        host = EVERY_ADDRESS.get(server.address, server.address)
        shown = f"[{host}]" if ":" in host else host
        encrypted = server.certificate is not None and screen.client_certificate is not None
        return ConnectionSettings(
            name="the status server",
            url=f"opc.tcp://{shown}:{server.port}/{_STATUS_PATH}",
            security=_SECURITY if encrypted else "none",
            user=user,
            password=password,
            certificate=screen.client_certificate if encrypted else None,
            private_key=screen.client_private_key if encrypted else None,
            server_certificate=server.certificate if encrypted else None,
        )

    def find_model(self, name: str) -> Path:
        """Return the file of a model that an operator names.

        Every link is followed: what lies outside of the folder is refused.
        """
        if self.machine.model_folder is None:
            raise ConfigurationError("no_model_folder", file=self.path.name)
        parts = PurePosixPath(name.replace("\\", "/"))
        if not name.isprintable() or parts.is_absolute() or ".." in parts.parts or ":" in name:
            raise ConfigurationError("no_model_name", file=name)
        try:
            folder = self.machine.model_folder.resolve(strict=True)
            file = (folder / parts).resolve(strict=True)
            inside = file.is_relative_to(folder) and file.is_file()
        except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle
            cause = getattr(error, "strerror", None) or os.strerror(errno.ELOOP)
            raise ConfigurationError("no_such_model", cause=cause, file=name) from None
        if not inside:
            raise ConfigurationError("model_outside_folder", file=name)
        return file

    def other_model(self, name: str) -> tuple[Compensation, str]:
        """Read another model, by the name that an operator gives; the loop's `Models`.

        An error names the file without its folder: people read it on pages.
        """
        file = self.find_model(name)
        try:
            found = read_model_file(file)
            return self.rules.applied_to(found.model), found.sha256
        except ThermaxisError as error:
            place = error.place._replace(file=file.name)
            raise ConfigurationError.of(replace(error.message, place=place)) from error

    def models_to_choose(self, most: int | None = None) -> tuple[str, ...]:
        """Return the names of the files that an operator may choose from, in order.

        Hidden ones, and those that nobody could ask for, are left out. Whether one is a model and
        fits the machine is found when it is chosen.
        """
        folder = self.machine.model_folder
        names = sorted(path.name for path in folder.glob("*.json")) if folder is not None else ()
        return tuple(islice(filter(self._may_be_chosen, names), most))

    def _may_be_chosen(self, name: str) -> bool:
        try:
            self.find_model(name)
        except ConfigurationError:
            return False
        return not name.startswith(".")


def read_model_file(path: Path) -> ModelFile:
    """Read a model together with its hash."""
    from thermaxis.files import model_sha256, read_model  # noqa: PLC0415  numpy comes with it

    model = read_model(path)
    return ModelFile(path, model_sha256(model), model)
