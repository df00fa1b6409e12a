"""What a configuration file says, as frozen values: the rest of the program sees nothing else."""

import errno
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import Final, Literal, final

from thermaxis.codes import Place
from thermaxis.compensation import (
    Compensation,
    CompensationModel,
    Limits,
    SensorRules,
    SupervisorRules,
)
from thermaxis.errors import ConfigurationError, ThermaxisError
from thermaxis.messages import Language
from thermaxis.runtime._connection import ConnectionSettings, Secret
from thermaxis.runtime.history import HistorianSettings
from thermaxis.runtime.host import is_loopback
from thermaxis.runtime.sinks import LinuxCncSettings

SHORTEST_TOKEN: Final = 16
"""Shortest token of a reader of the figures. [1]"""
EVERY_ADDRESS: Final = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # noqa: S104 - not listened at
"""Addresses that mean every one of this computer, and its own for each."""
_SECURITY: Final = "Basic256Sha256"
"""Security policy of encrypted connections to the status server: every one of them offers it."""
_STATUS_PATH: Final = "thermaxis"
"""Path of the status server's address."""


@final
@dataclass(frozen=True, slots=True)
class InputSettings:
    """Where a temperature is read."""

    node: str
    """Node of the sensor; empty where a log is replayed."""
    unit: Literal["degC", "K", "degF"]
    """Unit of its value, after the scale."""
    redundant_node: str = ""
    """Node of the redundant sensor; empty where there is none."""
    scale: float = 1.0
    """What the number is multiplied by first. [1]"""


@final
@dataclass(frozen=True, slots=True)
class FlagSettings:
    """Where a flag is read."""

    node: str
    """Its node."""
    value: bool
    """Value at which it says what its table is called: met, or active."""


@final
@dataclass(frozen=True, slots=True)
class DiameterSettings:
    """Where the workpiece's diameter is read."""

    node: str
    """Its node."""
    unit: Literal["mm", "inch"]
    """Unit of its value, after the scale."""
    scale: float = 1.0
    """What the number is multiplied by first. [1]"""


@final
@dataclass(frozen=True, slots=True)
class ProbeSettings:
    """Where a displacement is measured while the correction acts; nothing is decided by it."""

    node: str
    """Its node."""
    unit: Literal["um", "mm", "inch"]
    """Unit of its value, after the scale."""
    scale: float = 1.0
    """What the number is multiplied by first; negative where the probe counts towards the
    workpiece. [1]"""

    @property
    def factor(self) -> float:
        """What the number in the node is multiplied by. [µm per unit of the node]"""
        return self.scale * _PROBE_UNITS_UM[self.unit]


_PROBE_UNITS_UM = {"um": 1.0, "mm": 1e3, "inch": 25.4e3}


@final
@dataclass(frozen=True, slots=True)
class OutputSettings:
    """Where a correction is written; joints of LinuxCNC stand with the sink."""

    node: str = ""
    """Node that is written to; opcua only."""
    read_back_node: str = ""
    """Node at which the machine reports what it accepted: the same where none is stated."""
    effective_node: str = ""
    """Node at which it reports what acts now; empty where there is none."""
    unit: str = ""
    """Unit of the value in the machine; empty for a dry run."""
    sign: str = ""
    """What a positive value does, as a sentence; empty for a dry run."""
    read_back_stated: bool = False
    """Whether the file states a node for reading back."""


@final
@dataclass(frozen=True, slots=True)
class SourceSettings:
    """Where values come from."""

    kind: Literal["opcua", "replay"]
    """Which kind of source."""
    connection: str = ""
    """Name of the connection."""
    log: Path | None = None
    """The log that is replayed."""
    mapping: Path | None = None
    """What its columns mean."""
    as_fast_as_possible: bool = False
    """Whether it is played without waiting."""


@final
@dataclass(frozen=True, slots=True)
class SinkSettings:
    """Where corrections go."""

    kind: Literal["opcua", "linuxcnc", "dry"]
    """Which kind of sink."""
    connection: str = ""
    """Name of the connection."""
    heartbeat_node: str = ""
    """Node that moves with every write; empty where there is none."""
    linuxcnc: LinuxCncSettings | None = None
    """Joints, limits and times of LinuxCNC; None for every other kind."""


@final
@dataclass(frozen=True, slots=True)
class ServerSettings:
    """The status server.

    Raises
    ------
    ConfigurationError
        If a certificate stands without its key, users without a certificate (a password is never
        taken over an unencrypted connection), an address other than this computer's own without
        users or with an anonymous role, or if nobody could connect at all.
    """

    address: str
    """Address at which it listens."""
    port: int
    """Port; 0 takes a free one. [1]"""
    users: Path | None
    """File of the users."""
    anonymous_role: Literal["none", "viewer"]
    """What somebody without a name may do."""
    certificate: Path | None
    """Its own certificate."""
    private_key: Path | None
    """The certificate's key."""

    def __post_init__(self) -> None:
        """Check that nobody can connect who must not, and that somebody can."""
        outside, users = not is_loopback(self.address), self.users is not None
        _check_pair(self.certificate, self.private_key, "server")
        if outside and not users:
            code = "users_needed"
        elif users and self.certificate is None:
            code = "certificate_for_users_missing"
        elif outside and self.anonymous_role != "none":
            code = "anonymous_from_outside"
        elif not users and self.anonymous_role == "none":
            code = "nobody_can_connect"
        else:
            return
        raise ConfigurationError(code, place=Place(key="server"))


@final
@dataclass(frozen=True, slots=True)
class MetricsSettings:
    """Figures for Prometheus.

    Raises
    ------
    ConfigurationError
        If an address other than this computer's own has no certificate or no token, a certificate
        stands without its key, or the token is shorter than 16 characters or is no plain ASCII.
    """

    address: str
    """Address at which they are served."""
    port: int
    """Port; 0 takes a free one. [1]"""
    token: Secret
    """What a reader must send; masked; empty where nothing is asked for."""
    certificate: Path | None
    """Certificate for TLS."""
    private_key: Path | None
    """The certificate's key."""

    def __post_init__(self) -> None:
        """Check that nobody reads the figures who must not."""
        place, token = Place(key="metrics"), self.token.reveal()
        _check_pair(self.certificate, self.private_key, "metrics")
        if token and not (len(token) >= SHORTEST_TOKEN and token.isascii() and token.isprintable()):
            raise ConfigurationError("token_unusable", fewest=SHORTEST_TOKEN, place=place)
        if not is_loopback(self.address) and (self.certificate is None or not token):
            raise ConfigurationError("token_needed", place=place)


@final
@dataclass(frozen=True, slots=True)
class ScreenSettings:
    """The pages of ``thermaxis screen``."""

    address: str
    """Address at which they are served."""
    port: int
    """Port; 0 takes a free one. [1]"""
    hosts: tuple[str, ...]
    """Further names by which browsers reach them, as host or host:port, in small letters."""
    certificate: Path | None
    """Certificate for TLS of the pages."""
    private_key: Path | None
    """The certificate's key."""
    view_without_login: bool
    """Whether somebody who has not logged in may look."""
    language: Language
    """Language for browsers that ask for none of the three."""
    user: str
    """User of the status server for what every page shows; empty: anonymous."""
    password: Secret
    """That user's password; masked; empty without a user."""
    client_certificate: Path | None
    """Own certificate for connections to the status server; None: they are not encrypted."""
    client_private_key: Path | None
    """The certificate's key."""
    idle_s: float
    """A log-in ends after so long without a sign of its person. [s]"""
    longest_login_s: float
    """A log-in ends after so long in any case. [s]"""
    evaluation_s: float
    """Longest time of the evaluation of an uploaded run. [s]"""

    @property
    def secure(self) -> bool:
        """Whether the pages are served over TLS."""
        return self.certificate is not None


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

    def __post_init__(self) -> None:
        """Freeze the mappings."""
        for name in ("sensors", "limits", "validity"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    def applied_to(self, model: CompensationModel) -> Compensation:
        """Return a compensation with a model."""
        sensors = {name: r for name, r in self.sensors.items() if name in model.channels}
        return Compensation(
            model=model,
            sensors=sensors,
            limits=self.limits,
            supervisor=self.supervisor,
            cycle_s=self.cycle_s,
            redundant=self.redundant & frozenset(sensors),
            interlocks=self.interlocks,
            **self.validity,
        )


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class MachineConfiguration:
    """Everything that a configuration file says about one machine.

    Not protected: whether nodes, units and signs are those of the machine. The self-test finds
    gross mistakes, commissioning proves the sign.
    """

    path: Path
    """The file, absolute."""
    name: str
    """Name of the machine."""
    rules: MachineRules
    """What holds for every model."""
    model: ModelFile
    """The model to start with."""
    compensation: Compensation
    """Rules and model together."""
    model_folder: Path | None
    """The only folder from which another model may be chosen; None: none may be chosen."""
    state_file: Path
    """File in which the state is kept."""
    resume_enabled: bool
    """Whether it is enabled again after a restart if it was enabled before."""
    resume_within_s: float
    """After a longer break it is not. [s]"""
    at_stop: Literal["fade", "leave"]
    """What becomes of the offset when the program is ended."""
    stop_within_s: float
    """A fade at the end lasts at most so long. [s]"""
    ask_enables: bool
    """Whether the loop may be enabled, and a hold be ended, at the computer itself."""
    connections: Mapping[str, ConnectionSettings]
    """Connections that source or sink use, by name."""
    source: SourceSettings
    """Where values come from."""
    sink: SinkSettings
    """Where corrections go."""
    inputs: Mapping[str, InputSettings]
    """Where temperatures are read, by name."""
    interlocks: Mapping[str, FlagSettings]
    """Where interlocks are read, by name; not used where a log is replayed."""
    other_compensation: FlagSettings | None
    """Where the flag of another compensation is read."""
    diameter: DiameterSettings | None
    """Where the workpiece's diameter is read."""
    probes: Mapping[str, ProbeSettings]
    """Where displacements are measured while corrections act, by output; only shown and
    recorded; empty where a log is replayed."""
    outputs: Mapping[str, OutputSettings]
    """Where corrections are written, by name."""
    historian_url: str
    """Database of the cycles, without a password; the path of SQLite is absolute."""
    historian: HistorianSettings
    """How cycles are recorded; the password is masked."""
    server: ServerSettings | None
    """The status server; None: there is none."""
    metrics: MetricsSettings | None
    """Figures for Prometheus; None: there are none."""
    screen: ScreenSettings | None
    """The pages of ``thermaxis screen``; None: there are none."""

    def __post_init__(self) -> None:
        """Freeze the mappings."""
        for name in ("connections", "inputs", "interlocks", "probes", "outputs"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    def screen_connection(self, user: str, password: Secret) -> ConnectionSettings:
        """Return the connection of a person, or of every page, to the status server.

        It is encrypted, with the status server's own certificate pinned, wherever both sides have
        one; without encryption nobody but an anonymous viewer of this computer gets in.
        """
        server, screen = self.server, self.screen
        if server is None or screen is None:
            raise ConfigurationError("no_screen_table", place=Place(str(self.path)))
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
        if self.model_folder is None:
            raise ConfigurationError("no_model_folder", place=Place(self.path.name))
        place = Place(name)
        parts = PurePosixPath(name.replace("\\", "/"))
        if not name.isprintable() or parts.is_absolute() or ".." in parts.parts or ":" in name:
            raise ConfigurationError("no_model_name", place=place)
        try:
            folder = self.model_folder.resolve(strict=True)
            file = (folder / parts).resolve(strict=True)
            inside = file.is_relative_to(folder) and file.is_file()
        except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle
            cause = getattr(error, "strerror", None) or os.strerror(errno.ELOOP)
            raise ConfigurationError("no_such_model", cause=cause, place=place) from None
        if not inside:
            raise ConfigurationError("model_outside_folder", place=place)
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
        if self.model_folder is None or not self.model_folder.is_dir():
            return ()
        folder = self.model_folder.resolve()
        paths = sorted(path for path in folder.glob("*.json") if _may_be_named(path.name))
        found = (
            path.name for path in paths if path.is_file() and path.resolve().is_relative_to(folder)
        )
        return tuple(islice(found, most))


def _check_pair(certificate: Path | None, private_key: Path | None, key: str) -> None:
    if (certificate is None) != (private_key is None):
        lacking = "certificate" if certificate is None else "private_key"
        raise ConfigurationError("pair_incomplete", name=lacking, place=Place(key=key))


def _may_be_named(name: str) -> bool:
    """Whether a file is not hidden, and its name is one that `find_model` takes."""
    return not name.startswith(".") and name.isprintable() and not set(name) & {"\\", ":"}


def read_model_file(path: Path) -> ModelFile:
    """Read a model together with its hash."""
    from thermaxis.files import model_sha256, read_model  # noqa: PLC0415  numpy comes with it

    model = read_model(path)
    return ModelFile(path, model_sha256(model), model)
