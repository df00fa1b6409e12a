"""The tables of ``machine.toml``: every key with its kind, range, default, meaning and unit.

They are what a file is checked against, what the rest of the program reads, and what the schema
for editors and the tables of ``docs/machine-toml.md`` are made of. Below a key stands what it
means; behind *Default* where its default comes from, behind *Without it* what follows where it is
left out and no value stands for that; in brackets at the end the unit.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal, TypeVar, cast, final, get_type_hints

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from thermaxis.codes import Place
from thermaxis.compensation import (
    FASTEST_LIMIT_UM_PER_S,
    LARGEST_LIMIT_UM,
    Limits,
    SensorRules,
    SupervisorRules,
    TouchFilter,
    TouchRules,
)
from thermaxis.errors import ConfigurationError
from thermaxis.messages import Language
from thermaxis.runtime._connection import ConnectionSettings, Secret
from thermaxis.runtime._keys import (
    LOCATED,
    Checked,
    Factor,
    FileName,
    Hidden,
    Needed,
    Only,
    Own,
    Port,
    Scale,
    Table,
    Text,
    Word,
    located,
    read_as,
)
from thermaxis.runtime.history import HistorianSettings
from thermaxis.runtime.host import is_loopback, parsed_address, refuse_readable
from thermaxis.runtime.sinks import HalSettings, LinuxCncSettings
from thermaxis.runtime.sources import check_node

SHORTEST_TOKEN = 16
"""Shortest token of a reader of the figures. [1]"""
_Kind = Callable[[Path], bool]
Shown = Annotated[Word, Field(max_length=40)]
"""A short text for people."""
_Rules = TypeVar("_Rules", SensorRules, Limits, SupervisorRules, TouchRules)


def require_file(
    path: Path | None, key: str = "", *, code: str = "file_not_found", kind: _Kind = Path.is_file
) -> Path | None:
    """Check that a file that a key names is there."""
    try:
        there = path is None or kind(path)
    except (OSError, ValueError):
        there = False
    if not there:
        raise ConfigurationError(code, file=path or "", key=key)
    return path


require_folder = partial(require_file, code="folder_not_found", kind=Path.is_dir)
"""The same for a folder."""


def _private(path: Path) -> Path:
    refuse_readable(path)
    return path


def _checked_by(check: Any) -> AfterValidator:
    def checked(value: Any) -> Any:
        try:
            return check(value) if value else value
        except ConfigurationError as error:
            raise PydanticCustomError("refused", "refused", {"message": error.message}) from None

    return AfterValidator(checked)


def _node(text: str) -> str:
    check_node(text)
    return text


File = Annotated[Path | None, read_as(Annotated[LOCATED, _checked_by(require_file)])]
"""A file that must be there."""
PrivateFile = Annotated[Path | None, read_as(Annotated[LOCATED, _checked_by(_private)])]
"""A file that nobody but its owner may read."""
Node = Annotated[Text, _checked_by(_node)]
"""A node, or none."""
Names = Annotated[Mapping[Language, Shown], Field(max_length=3)]
"""What people call something, by language."""
_Joint = Annotated[int, Field(ge=0, le=15)]
NeededNode = Annotated[Word, _checked_by(_node)]
"""A node."""


def part_of(kind: type[_Rules], table: object) -> _Rules:
    """Return the rules alone that are part of a table."""
    return kind(**{one.name: getattr(table, one.name) for one in fields(kind) if one.init})


@final
@dataclass(frozen=True, kw_only=True)
class MachineSettings:
    """``[machine]``: what is compensated, and with which model."""

    name: Word
    """Name of the machine, as people call it."""
    model: Annotated[Path, read_as(Annotated[Word, AfterValidator(located)])]
    """File of the compensation model, JSON of `thermaxis identify` or `combine`."""
    model_folder: FileName = None
    """The only folder from which an operator may choose another model; a name with `..`, an
    absolute name and a link that leads out are refused. Default: what nobody configured, nobody
    can do. Without it: no other model can be chosen."""
    cycle_s: float = 1.0
    """Time from cycle to cycle, 0.1 to 60. Default: heat needs no more; a SINUMERIK server samples
    at 0.1 s at best [src]. [s]"""
    state_file: FileName = None
    """File in which the state is kept for a restart. Default: beside the configuration. Without
    it: the file's name with `.state.json`."""


@final
@dataclass(frozen=True, kw_only=True)
class SourceSettings:
    """``[source]``: where the values come from."""

    kind: Literal["opcua", "linuxcnc", "replay"]
    """`opcua` reads a server, `linuxcnc` pins of HAL of the LinuxCNC of this computer, `replay`
    plays a log."""
    connection: Annotated[Text, Needed("opcua")] = ""
    """Name of the connection; required for opcua."""
    life_node: Node = ""
    """Node of a number that the controller changes all the time, such as a counter that its PLC
    increments: while it stands still, nothing that is read is believed. Without it: only time
    stamps say whether a value is new; for linuxcnc a pin that every servo period sets."""
    life_s: Annotated[float, Field(gt=0.0, le=600.0)] = 5.0
    """It must have changed within so long. Default: PLCs count once a second or faster. [s]"""
    datum_node: Node = ""
    """Node of a number that changes when a datum is set, or an axis referenced anew: what touches
    have taught is then forgotten. Without it: `thermaxis ask` says so, or a restart."""
    log: Annotated[FileName, Only("replay"), Needed("replay")] = None
    """The log; required for replay."""
    mapping: Annotated[FileName, Only("replay")] = None
    """What the log's columns mean (as `--mapping` of the commands); replay only. Without it: the
    columns are named as the inputs."""
    as_fast_as_possible: Annotated[bool, Only("replay")] = False
    """Whether the log is played without waiting; replay only. Default: a replay looks like the day
    itself."""
    may_move_a_machine: Annotated[bool, Only("replay")] = False
    """Whether a replayed log may act on a sink that is no dry run: for simulations. Default: a
    machine must not be moved by temperatures of another day."""


@final
@dataclass(frozen=True, kw_only=True)
class SinkSettings(HalSettings):
    """``[sink]``: where the corrections go."""

    kind: Literal["opcua", "linuxcnc", "dry"]
    """`opcua` writes nodes, `linuxcnc` signals of the LinuxCNC of this computer, `dry` nothing at
    all."""
    connection: Annotated[Text, Only("opcua"), Needed("opcua")] = ""
    """Name of the connection; required for opcua."""
    heartbeat_node: Annotated[Node, Only("opcua")] = ""
    """Node that moves with every write; a watchdog on the machine takes the offset back when it
    stands still; opcua only. Without it: none, and `check` warns."""
    token_node: Annotated[Node, Only("opcua")] = ""
    """Node of a number of 32 bits or more in which the program that writes keeps a random token:
    while another one's is renewed there, nothing is written; opcua only. Without it: one computer
    keeps copies apart."""
    linuxcnc: Own[LinuxCncSettings | None] = None
    """Joints, limits and times of LinuxCNC; None for every other kind."""


@final
@dataclass(frozen=True, kw_only=True)
class InputSettings(SensorRules):
    """``[input.NAME]``: one temperature; the name is the model's channel."""

    node: Annotated[Node, Needed("opcua"), Needed("linuxcnc")] = ""
    """Node of the sensor, or `hal:` and the name of a pin; required unless a log is replayed."""
    unit: Literal["degC", "K", "degF"]
    """Unit of its value, after the scale: `degC`, `K` or `degF`."""
    scale: Scale = 1.0
    """What the number is multiplied by first; 0.1 where a PLC counts tenths of a degree. Default:
    the node holds the value itself. [1]"""
    on_change: bool = False
    """Whether the server stamps the value only when it changes: its age is then that of the last
    change of `life_node`, which is required. Default: a time stamp says when it was measured."""
    redundant_node: Node = ""
    """Node of a redundant sensor at the same place, in the same unit and scale."""
    name: Names = field(default_factory=dict[Language, str])
    """What people call it on the pages, at most 40 characters in each language, such as
    `{en = "Spindle", de = "Spindel", cs = "Vřeteno"}`; where a language is left out, the English
    one. Without it: the channel's name without its unit."""


@dataclass(frozen=True)
class FlagSettings:
    """Where a flag is read."""

    node: NeededNode
    """Node of the flag: a Boolean, or a number 0 or 1; with `bit` a whole number."""
    value: bool
    """Value at which it says what its table is called: met, or active."""
    bit: Annotated[int | None, Field(ge=0, le=63)] = None
    """Bit of a status word that is the flag, 0 is the lowest. Without it: the node is the flag."""


@final
@dataclass(frozen=True)
class InterlockSettings(FlagSettings):
    """``[interlock.NAME]``: a condition that must be met for the compensation to be active."""

    value: Annotated[bool, Field(alias="met")]
    """`true` or `false`: the flag's value at which the condition is met."""
    name: Names = field(default_factory=dict[Language, str])
    """What people call it on the pages, as of an input, such as `{en = "Emergency stop", de =
    "Not-Halt", cs = "Nouzové zastavení"}`. Without it: its NAME."""


@final
@dataclass(frozen=True)
class OtherCompensationSettings(FlagSettings):
    """``[other_compensation]``: a flag that tells whether another compensation is active."""

    value: Annotated[bool, Field(alias="active")]
    """`true` or `false`: the flag's value at which the other compensation is active."""


@final
@dataclass(frozen=True)
class DiameterSettings:
    """``[diameter]``: the workpiece's clamping diameter, as the control knows it."""

    node: NeededNode
    """Node of the diameter."""
    unit: Literal["mm", "inch"]
    """`mm` or `inch`, after the scale."""
    scale: Scale = 1.0
    """What the number is multiplied by first. Default: the node holds the value itself. [1]"""


@final
@dataclass(frozen=True, kw_only=True)
class ProbeSettings(TouchFilter):
    """``[probe.NAME]``: a displacement that is measured, or touched, while the correction acts."""

    node: Node = field(default="", kw_only=False)
    """Node of the probe; required unless there is `largest_um`. Without it: there is none."""
    unit: Literal["um", "mm", "inch"] | None = field(default=None, kw_only=False)
    """`um`, `mm` or `inch`, after the scale; required with `node`. Default: a wrong unit is a
    factor of 1000. Without it: none."""
    scale: Factor = field(default=1.0, kw_only=False)
    """What the number is multiplied by first; negative where the probe counts towards the
    workpiece; not 0. Default: the node holds the value itself. [1]"""
    counter_node: Node = ""
    """Node of a whole number that a probing cycle raises when a new touch stands in `node`, as
    `thermaxis program --touch` does; it needs `largest_um`. Without it: `node` holds no touches."""
    delay_s: Annotated[float, Field(ge=0.0, le=3600.0)] = 0.0
    """Time from the touch to its counter, such as the way back: what was in force that much earlier
    counts. Default: the counter rises at once. [s]"""
    wanted_std_um: Annotated[float | None, Field(gt=0.0, le=1000.0)] = None
    """Standard uncertainty of the tool point from which `TouchNow` asks for a touch, above what a
    touch leaves. Without it: only a touch that does not fit asks for another one. [µm]"""
    largest_um: Annotated[float | None, Field(gt=0.0, le=LARGEST_LIMIT_UM)] = None
    """Limit of what touches add to the correction, up or down, inside the total; up to 10 000.
    Touches that show half as much again turn it off.
    Without it: no touch is looked at. [µm]"""
    largest_rate_um_per_s: Annotated[float | None, Field(gt=0.0, le=FASTEST_LIMIT_UM_PER_S)] = None
    """Fastest change of that, up to 1000; required with `largest_um`. Without it: none. [µm/s]"""

    @property
    def factor(self) -> float:
        """What the number in the node is multiplied by. [µm per unit of the node]"""
        return self.scale * {None: 1.0, "um": 1.0, "mm": 1e3, "inch": 25.4e3}[self.unit]

    @property
    def limits(self) -> Limits | None:
        """Limit and rate of what touches add; None where none are looked at."""
        if self.largest_um is None or self.largest_rate_um_per_s is None:
            return None
        return Limits(self.largest_um, self.largest_rate_um_per_s)


@final
@dataclass(frozen=True, kw_only=True)
class OutputSettings(Limits):
    """``[output.NAME]``: one correction; the name is the model's output."""

    largest_um: Annotated[float, Field(gt=0.0, le=LARGEST_LIMIT_UM)] = field(kw_only=False)
    largest_rate_um_per_s: Annotated[float, Field(gt=0.0, le=FASTEST_LIMIT_UM_PER_S)] = field(
        kw_only=False
    )
    node: Annotated[Node, Only("opcua"), Needed("opcua")] = ""
    """Node that the correction is written to; required for an opcua sink."""
    read_back_node: Annotated[Node, Only("opcua")] = ""
    """Node at which the machine reports what it accepted. Without it: the node that is written to,
    and `check` warns."""
    effective_node: Annotated[Node, Only("opcua")] = ""
    """Node at which the machine reports what acts now. Without it: not known."""
    joint: Annotated[_Joint | None, Only("linuxcnc"), Needed("linuxcnc")] = None
    """Number of the joint, 0 to 15; required for linuxcnc."""
    unit: Annotated[Text, Needed("opcua"), Needed("linuxcnc")] = ""
    """Unit of the value in the machine: `um`, `0.1 um`, `mm`, `m` or `inch`; for linuxcnc `mm` or
    `inch`; required unless the sink is dry. Default: a wrong unit is a factor of 1000. Without
    it: none."""
    sign: Annotated[Text, Needed("opcua"), Needed("linuxcnc")] = ""
    """`positive moves the tool away from the workpiece` or `positive moves the tool towards the
    workpiece`; required unless the sink is dry. Default: a wrong sign doubles the error. Without
    it: none."""
    largest_acceleration_um_per_s2: Annotated[float | None, Only("linuxcnc")] = None
    """Largest acceleration of the offset; linuxcnc only. Default: the full rate stands after
    0.04 s. Without it: 25 times the rate. [µm/s²]"""


@final
@dataclass(frozen=True, kw_only=True)
class SupervisorSettings(SupervisorRules):
    """``[supervisor]``: how long what is tolerated."""

    resume_enabled: bool = True
    """Whether it is enabled again after a restart if it was enabled before. Default: a power cut
    must not cost the shift's accuracy."""
    resume_within_s: Annotated[float, Field(ge=0.0, le=86_400.0)] = 3600.0
    """After a longer break it is not. Default: an hour. [s]"""
    at_stop: Literal["fade", "leave"] = "fade"
    """What becomes of the offset when the program is ended: `fade`, or `leave` it to the machine's
    watchdog. Default: nothing stays that nobody watches."""
    stop_within_s: Annotated[float, Field(ge=0.0, le=3600.0)] = 120.0
    """A fade at the end lasts at most so long. Default: two minutes. [s]"""
    latch_offset_mismatch: bool = False
    """Whether the correction fades and stays off, until somebody acknowledges it, once an offset
    was not where it had been left, as after the machine's watchdog. Default: it goes on from
    there, with an alarm."""
    ask_enables: bool = False
    """Whether `thermaxis ask` may enable and end a hold, at the computer itself. Default: who
    starts it again stands at the machine."""


@final
@dataclass(frozen=True, kw_only=True)
class ValiditySettings:
    """``[validity]``: what follows outside the range of the model's training logs."""

    margin_k: float | None = None
    """A part's weight falls from 1 at the range's end to the lowest weight so far outside.
    Without it: five kelvin. [K]"""
    lowest_weight: float | None = None
    """Weight that is left, 0 to 1. Without it: none is left. [1]"""


@final
@dataclass(frozen=True)
class ServerSettings:
    """``[server]``: the status server, OPC UA. Without this table there is none.

    Raises
    ------
    ConfigurationError
        If a certificate stands without its key, users without a certificate (a password is never
        taken over an unencrypted connection), an address other than this computer's own without
        users or with an anonymous role, or if nobody could connect at all.
    """

    address: Word = "127.0.0.1"
    """Address at which it listens. Default: this computer only."""
    port: Port = 4850
    """Port, 0 to 65 535; 0 takes a free one. Default: ten above the machine's usual 4840. [1]"""
    users: File = None
    """File of users, roles and password hashes, written by `thermaxis user`. Without it: nobody
    has a name."""
    anonymous_role: Literal["none", "viewer"] = "none"
    """What somebody without a name may do: `none`, or `viewer`."""
    certificate: File = None
    """The server's own certificate."""
    private_key: PrivateFile = None
    """Its key; mode 0600."""

    def __post_init__(self) -> None:
        """Check that nobody can connect who must not, and that somebody can."""
        outside, users = not is_loopback(self.address), self.users is not None
        check_pair(self.certificate, self.private_key, "server")
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
        raise ConfigurationError(code, key="server")


@final
@dataclass(frozen=True)
class MetricsSettings:
    """``[metrics]``: figures for Prometheus. Without this table there are none.

    Raises
    ------
    ConfigurationError
        If an address other than this computer's own has no certificate or no token, a certificate
        stands without its key, or the token is shorter than 16 characters or is no plain ASCII.
    """

    address: Word = "127.0.0.1"
    """Address at which they are served. Default: this computer only."""
    port: Port = 9180
    """Port, 0 to 65 535; 0 takes a free one. [1]"""
    token: Hidden[Secret] = Secret("")  # noqa: RUF009 - it cannot change
    """What a reader must send; empty where nothing is asked for."""
    token_file: FileName = None
    """File whose first line is the token that a reader must send."""
    token_environment: Text = ""
    """Environment variable that holds it."""
    certificate: File = None
    """Certificate for TLS."""
    private_key: PrivateFile = None
    """Its key; mode 0600."""

    def __post_init__(self) -> None:
        """Check that nobody reads the figures who must not."""
        place, token = Place(key="metrics"), self.token.reveal()
        check_pair(self.certificate, self.private_key, "metrics")
        if token and not (len(token) >= SHORTEST_TOKEN and token.isascii() and token.isprintable()):
            raise ConfigurationError("token_unusable", fewest=SHORTEST_TOKEN, place=place)
        asked = token or self.token_file or self.token_environment
        if not is_loopback(self.address) and (self.certificate is None or not asked):
            raise ConfigurationError("token_needed", place=place)


@final
@dataclass(frozen=True, kw_only=True)
class ScreenSettings:
    """``[screen]``: the pages of thermaxis screen. Without this table there are none."""

    address: Word = "127.0.0.1"
    """Address at which the pages are served. Default: this computer only."""
    port: Port = 8450
    """Port, 0 to 65 535; 0 takes a free one. [1]"""
    hosts: Annotated[tuple[Word, ...], Field(max_length=20, strict=False)] = ()
    """Further names by which browsers reach them, such as `"lathe-3.shop"` or `"10.0.0.5:8450"`, at
    most 20; a page that is asked for by any other name is refused; required where the address is
    `0.0.0.0` or `::`. Default: a name that nobody stated may lead elsewhere."""
    certificate: File = None
    """Certificate for TLS of the pages."""
    private_key: PrivateFile = None
    """Its key; mode 0600."""
    view_without_login: bool | None = None
    """Whether somebody who has not logged in may look. Without it: yes where the pages are served
    to this computer only, by no further name."""
    pin_from: Annotated[tuple[Word, ...], Field(max_length=20, strict=False)] = ()
    """Addresses of panels where an operator may log in by a PIN, such as `"10.0.0.7"`, at most 20.
    Default: this computer itself where the pages are served to it alone and have no `hosts`;
    else whoever comes through a proxy on it comes from it, too."""
    language: Language = "en"
    """Language for browsers that ask for none of them: `en`, `de` or `cs`."""
    user: Text = ""
    """User of the status server, with the role viewer, for what every page shows. Without it:
    anonymous."""
    password: Hidden[Secret] = Secret("")  # noqa: RUF009 - it cannot change
    """That user's password."""
    password_file: FileName = None
    """File whose first line is that user's password."""
    password_environment: Text = ""
    """Environment variable that holds it."""
    client_certificate: File = None
    """Own certificate for connections to the status server; its address is that of
    `thermaxis certificate new`; required with users there. Without it: none, and they are not
    encrypted."""
    client_private_key: PrivateFile = None
    """Its key; mode 0600."""
    idle_s: Annotated[float, Field(ge=60.0, le=86_400.0)] = 900.0
    """A log-in ends after so long without a sign of its person, 60 to 86 400. Default: a quarter of
    an hour. [s]"""
    longest_login_s: Annotated[float, Field(ge=60.0, le=86_400.0)] = 28_800.0
    """A log-in ends after so long in any case, 60 to 86 400. Default: a shift. [s]"""
    evaluation_s: Annotated[float, Field(ge=1.0, le=600.0)] = 60.0
    """Longest time of the evaluation of an uploaded run, 1 to 600. Default: a minute. [s]"""

    def __post_init__(self) -> None:
        """Write names of computers in small letters, and check that certificates have keys."""
        object.__setattr__(self, "hosts", tuple(host.lower() for host in self.hosts))
        if self.view_without_login is None:
            here = is_loopback(self.address) and not self.hosts
            object.__setattr__(self, "view_without_login", here)
        check_pair(self.certificate, self.private_key, "screen")
        check_pair(self.client_certificate, self.client_private_key, "screen", "client_")

    @property
    def secure(self) -> bool:
        """Whether the pages are served over TLS."""
        return self.certificate is not None

    def takes_pin(self, address: str) -> bool:
        """Return whether a PIN is taken from an address."""
        here = is_loopback(self.address) and not self.hosts
        own = parsed_address(address)
        panels = [parsed_address(panel) for panel in self.pin_from]
        return own is not None and (own in panels or (own.is_loopback and here))


def check_pair(
    certificate: Path | None, private_key: Path | None, key: str, prefix: str = ""
) -> None:
    """Check that a certificate does not stand without its key."""
    if (certificate is None) != (private_key is None):
        lacking = f"{prefix}{'certificate' if certificate is None else 'private_key'}"
        raise ConfigurationError("pair_incomplete", name=lacking, key=key)


@dataclass(frozen=True, kw_only=True)
class MachineFile:
    """The tables of one machine's configuration."""

    machine: Checked[MachineSettings]
    """What is compensated, and with which model."""
    connections: Annotated[Table[Checked[ConnectionSettings]], Field(alias="connection")] = field(
        default_factory=dict[str, ConnectionSettings]
    )
    """OPC UA connections by name."""
    source: SourceSettings
    """Where the values come from."""
    sink: SinkSettings
    """Where the corrections go."""
    inputs: Annotated[Table[Checked[InputSettings]], Field(alias="input")]
    """One table for every channel of the model."""
    interlocks: Annotated[Table[InterlockSettings], Field(alias="interlock")] = field(
        default_factory=dict[str, InterlockSettings]
    )
    """Conditions that must be met."""
    other_compensation: OtherCompensationSettings | None = None
    """A flag that tells whether another compensation is active."""
    diameter: DiameterSettings | None = None
    """The workpiece's clamping diameter."""
    probes: Annotated[Table[Checked[ProbeSettings]], Field(alias="probe")] = field(
        default_factory=dict[str, ProbeSettings]
    )
    """What is measured or touched while the correction acts, by output."""
    outputs: Annotated[Table[Checked[OutputSettings]], Field(alias="output")]
    """One table for every output of the model."""
    supervisor: Checked[SupervisorSettings] = SupervisorSettings()
    """How long what is tolerated."""
    validity: ValiditySettings = ValiditySettings()
    """What follows outside the range of the training logs."""
    historian: HistorianSettings = field(default_factory=HistorianSettings)
    """Where every cycle is recorded."""
    server: Checked[ServerSettings] | None = None
    """The status server."""
    metrics: Checked[MetricsSettings] | None = None
    """Figures for Prometheus."""
    screen: Checked[ScreenSettings] | None = None
    """The pages of thermaxis screen."""

    def __post_init__(self) -> None:
        for one in fields(self):
            value: object = getattr(self, one.name)
            if isinstance(value, dict):
                frozen = MappingProxyType(cast("dict[str, object]", value))
                object.__setattr__(self, one.name, frozen)


def tables_of(file: MachineFile) -> Iterator[tuple[str, Any]]:
    """Yield every table of a file with its heading."""
    hints = get_type_hints(MachineFile, include_extras=True)
    for one in fields(MachineFile):
        marks: tuple[Any, ...] = getattr(hints[one.name], "__metadata__", ())
        name = next((mark.alias for mark in marks if getattr(mark, "alias", None)), one.name)
        table: object = getattr(file, one.name)
        if isinstance(table, Mapping):
            for entry in cast("Mapping[str, object]", table):
                yield f"{name}.{entry}", table[entry]
        elif table is not None:
            yield name, table
