"""The tables of ``machine.toml`` as they stand in the file; pydantic is used here and only here.

Keys whose name is a field of a class in `Rules` have no default here: what is not stated is left
to that class, so that a default stands in one place.
"""

from dataclasses import fields
from typing import Annotated, Any, ClassVar, Literal, TypeAlias, TypeVar, final

from pydantic import AfterValidator, BaseModel, Field
from pydantic_core import PydanticCustomError

from thermaxis.compensation import Limits, SensorRules, SupervisorRules
from thermaxis.messages import Language
from thermaxis.runtime.config._connection import ConnectionSection, Section
from thermaxis.runtime.history import HistorianSettings
from thermaxis.runtime.sinks import LinuxCncSettings

_Table = TypeVar("_Table")
Rules: TypeAlias = SensorRules | Limits | SupervisorRules | HistorianSettings | LinuxCncSettings
"""What has fields, defaults and checks of its own."""


def _shown(text: str) -> str:
    """Refuse what a terminal would obey instead of showing it."""
    if not text.isprintable():
        raise PydanticCustomError("shown", "control character")
    return text


Word = Annotated[str, Field(min_length=1, max_length=1000), AfterValidator(_shown)]
"""A text that says something."""
Text = Annotated[str, Field(max_length=1000), AfterValidator(_shown)]
"""A text that may be empty, which is the same as leaving it out."""
Scale = Annotated[float, Field(gt=0.0, le=1e6)]
"""A positive factor."""


def _not_zero(value: float) -> float:
    """Refuse a factor that makes everything zero."""
    if value == 0.0:
        raise PydanticCustomError("factor", "factor of zero")
    return value


Factor = Annotated[float, Field(ge=-1e6, le=1e6), AfterValidator(_not_zero)]
"""A factor other than zero; a negative one turns the sign."""
_MOST_ENTRIES = 200


class RulesSection(Section):
    """A table with keys that are fields of a class of rules, which has their defaults."""

    def stated(self, rules: type[Rules]) -> dict[str, Any]:
        """Return what the file states of the fields of a class of rules."""
        return {
            entry.name: getattr(self, entry.name)
            for entry in fields(rules)
            if entry.name in self.model_fields_set
        }


@final
class MachineSection(Section):
    """``[machine]``: what is compensated, and with which model."""

    name: Word
    """Name of the machine, as people call it."""
    model: Word
    """File of the compensation model, JSON."""
    model_folder: Text = ""
    """The only folder from which an operator may choose another model; without it none."""
    cycle_s: float = 1.0
    """Time from cycle to cycle. [s]"""
    state_file: Text = ""
    """File in which the state is kept for a restart."""


@final
class SourceSection(Section):
    """``[source]``: where the values come from."""

    kind: Literal["opcua", "replay"]
    """``opcua`` reads a server; ``replay`` plays a log."""
    connection: Text = ""
    """Name of the connection; opcua only."""
    log: Text = ""
    """File of the log; replay only."""
    mapping: Text = ""
    """File that says what the log's columns mean; replay only."""
    as_fast_as_possible: bool = False
    """Whether the log is played without waiting; replay only."""
    may_move_a_machine: bool = False
    """Whether a replayed log may act on a sink that is no dry run; replay only."""


@final
class SinkSection(RulesSection):
    """``[sink]``: where the corrections go."""

    kind: Literal["opcua", "linuxcnc", "dry"]
    """``opcua`` writes nodes of a server, ``linuxcnc`` pins of its HAL, ``dry`` nothing."""
    connection: Text = ""
    """Name of the connection; opcua only."""
    heartbeat_node: Text = ""
    """Node that moves with every write, by which the machine notices a dead writer; opcua only."""
    watchdog_s: float | None = None
    """Time without a heartbeat after which the machine takes the offset back; linuxcnc only.
    [s]"""
    thread: Word | None = None
    """Thread of HAL in which the motion controller runs; linuxcnc only."""
    halcmd: Word | None = None
    """Name or path of the program halcmd; linuxcnc only."""


@final
class InputSection(RulesSection):
    """``[input.NAME]``: one temperature; the name is the model's channel."""

    node: Text = ""
    """Node of the sensor; needed by an opcua source."""
    unit: Literal["degC", "K", "degF"]
    """Unit of its value, after the scale."""
    scale: Scale = 1.0
    """What the number is multiplied by first; 0.1 where a PLC counts tenths. [1]"""
    redundant_node: Text = ""
    """Node of a redundant sensor at the same place, in the same unit and scale."""
    lowest_c: float
    """Lowest plausible value. [degC]"""
    highest_c: float
    """Highest plausible value. [degC]"""
    largest_rate_k_per_s: float | None = None
    """Fastest plausible change. [K/s]"""
    step_k: float | None = None
    """Jump that is believed at any rate. [K]"""
    longest_age_s: float | None = None
    """Oldest value that is believed. [s]"""
    time_stamp_required: bool | None = None
    """Whether a value without a time stamp is refused."""
    frozen_s: float | None = None
    """A value that has not changed for so long is not believed; 0 switches this off. [s]"""
    largest_difference_k: float | None = None
    """Largest difference to the redundant sensor. [K]"""


@final
class InterlockSection(Section):
    """``[interlock.NAME]``: a condition that must be met for the compensation to be active."""

    node: Word
    """Node of the flag."""
    met: bool
    """Value of the flag at which the condition is met."""


@final
class OtherCompensationSection(Section):
    """``[other_compensation]``: a flag that tells whether another compensation is active."""

    node: Word
    """Node of the flag."""
    active: bool
    """Value of the flag at which the other compensation is active."""


@final
class DiameterSection(Section):
    """``[diameter]``: the workpiece's clamping diameter, as the control knows it."""

    node: Word
    """Node of the diameter."""
    unit: Literal["mm", "inch"]
    """Unit of its value, after the scale."""
    scale: Scale = 1.0
    """What the number is multiplied by first. [1]"""


@final
class ProbeSection(Section):
    """``[probe.NAME]``: a displacement that is measured while the correction acts; only shown."""

    node: Word
    """Node of the probe."""
    unit: Literal["um", "mm", "inch"]
    """Unit of its value, after the scale."""
    scale: Factor = 1.0
    """What the number is multiplied by first; negative where the probe counts towards the
    workpiece. [1]"""


@final
class OutputSection(RulesSection):
    """``[output.NAME]``: one correction; the name is the model's output."""

    node: Text = ""
    """Node that the correction is written to; opcua only."""
    read_back_node: Text = ""
    """Node at which the machine reports what it accepted; opcua only."""
    effective_node: Text = ""
    """Node at which the machine reports what acts now; opcua only."""
    joint: Annotated[int, Field(ge=0, le=15)] | None = None
    """Number of the joint; linuxcnc only."""
    unit: Text = ""
    """Unit of the value that is written; needed unless the sink is dry."""
    sign: Text = ""
    """What a positive value does, as a sentence; needed unless the sink is dry."""
    largest_um: float
    """Output limit. [µm]"""
    largest_rate_um_per_s: float
    """Fastest change of the correction. [µm/s]"""
    total_um: float | None = None
    """Total limit, of correction and trim together. [µm]"""
    deadband_um: float | None = None
    """The correction stays until the model asks for something that differs by more. [µm]"""
    soft_um: float | None = None
    """Magnitude from which the operator is warned. [µm]"""
    largest_trim_um: float | None = None
    """Largest trim. [µm]"""
    largest_acceleration_um_per_s2: float | None = None
    """Largest acceleration of the offset; linuxcnc only. [µm/s²]"""


@final
class SupervisorSection(RulesSection):
    """``[supervisor]``: how long what is tolerated."""

    settle_s: float | None = None
    """Time that the model runs with good inputs before the first correction. [s]"""
    recovery_delay_s: float | None = None
    """Time that everything must be there again after a loss. [s]"""
    input_timeout_s: float | None = None
    """Time for which a lost input is bridged by its last value. [s]"""
    hold_input_s: float | None = None
    """Time for which the correction is held while an input is lost. [s]"""
    hold_connection_s: float | None = None
    """The same while the connection is lost. [s]"""
    hold_interlock_s: float | None = None
    """The same while an interlock is not met. [s]"""
    hold_operator_s: float | None = None
    """Time after which an operator's hold fades. [s]"""
    at_limit_s: float | None = None
    """Time at the output limit that is a fault. [s]"""
    read_back_tolerance_um: float | None = None
    """Difference of read-back and written correction that is believed. [µm]"""
    read_back_s: float | None = None
    """Time for which they may differ, or nothing be read back. [s]"""
    longest_trim_s: float | None = None
    """Longest time after which a trim expires. [s]"""
    resume_enabled: bool = True
    """Whether it is enabled again after a restart if it was enabled before."""
    resume_within_s: Annotated[float, Field(ge=0.0, le=86_400.0)] = 3600.0
    """After a longer break it is not. [s]"""
    at_stop: Literal["fade", "leave"] = "fade"
    """What becomes of the offset when the program is ended: ``fade`` or ``leave``."""
    stop_within_s: Annotated[float, Field(ge=0.0, le=3600.0)] = 120.0
    """A fade at the end lasts at most so long. [s]"""
    ask_enables: bool = False
    """Whether ``thermaxis ask`` may enable and end a hold, at the computer itself."""


@final
class ValiditySection(Section):
    """``[validity]``: what follows outside the range of the model's training logs."""

    margin_k: float | None = None
    """So far outside nothing but the lowest weight is left. [K]"""
    lowest_weight: float | None = None
    """Weight that is left far outside. [1]"""


@final
class HistorianSection(RulesSection):
    """``[historian]``: where every cycle is recorded."""

    secret_keys: ClassVar[frozenset[str]] = frozenset({"password"})

    url: Text = ""
    """Database, as a URL of SQLAlchemy."""
    password_file: Text = ""
    """File whose first line is the database's password; readable by its owner only."""
    password_environment: Text = ""
    """Environment variable that holds it."""
    folder: Text = ""
    """Folder of the finished hours and days."""
    retention_days: int | None = None
    """Days with records that are kept. [d]"""
    largest_waiting_bytes: int | None = None
    """Memory for what cannot be stored at the moment. [byte]"""


@final
class ServerSection(Section):
    """``[server]``: the status server, OPC UA. Without this table there is none."""

    secret_keys: ClassVar[frozenset[str]] = frozenset({"password"})

    address: Word = "127.0.0.1"
    """Address at which it listens."""
    port: Annotated[int, Field(ge=0, le=65_535)] = 4850
    """Port; 0 takes a free one. [1]"""
    users: Text = ""
    """File of the users, as thermaxis user writes it."""
    anonymous_role: Literal["none", "viewer"] = "none"
    """What somebody without a name may do."""
    certificate: Text = ""
    """The server's own certificate."""
    private_key: Text = ""
    """Its key; readable by its owner only."""


@final
class MetricsSection(Section):
    """``[metrics]``: figures for Prometheus. Without this table there are none."""

    secret_keys: ClassVar[frozenset[str]] = frozenset({"token", "password"})

    address: Word = "127.0.0.1"
    """Address at which they are served."""
    port: Annotated[int, Field(ge=0, le=65_535)] = 9180
    """Port; 0 takes a free one. [1]"""
    token_file: Text = ""
    """File whose first line is the token that a reader must send; readable by its owner only."""
    token_environment: Text = ""
    """Environment variable that holds it."""
    certificate: Text = ""
    """Certificate for TLS."""
    private_key: Text = ""
    """Its key; readable by its owner only."""


@final
class ScreenSection(Section):
    """``[screen]``: the pages of thermaxis screen. Without this table there are none."""

    secret_keys: ClassVar[frozenset[str]] = frozenset({"password"})

    address: Word = "127.0.0.1"
    """Address at which the pages are served."""
    port: Annotated[int, Field(ge=0, le=65_535)] = 8450
    """Port; 0 takes a free one. [1]"""
    hosts: Annotated[list[Word], Field(max_length=20)] = []  # noqa: RUF012 - pydantic copies it
    """Further names by which browsers reach it, as host or host:port."""
    certificate: Text = ""
    """Certificate for TLS of the pages."""
    private_key: Text = ""
    """Its key; readable by its owner only."""
    view_without_login: bool = False
    """Whether somebody who has not logged in may look."""
    language: Language = "en"
    """Language for browsers that ask for none of the three."""
    user: Text = ""
    """User of the status server, with the role viewer, for what every page shows; empty:
    anonymous."""
    password_file: Text = ""
    """File whose first line is that user's password; readable by its owner only."""
    password_environment: Text = ""
    """Environment variable that holds it."""
    client_certificate: Text = ""
    """Own certificate for connections to the status server."""
    client_private_key: Text = ""
    """Its key; readable by its owner only."""
    idle_s: Annotated[float, Field(ge=60.0, le=86_400.0)] = 900.0
    """A log-in ends after so long without a sign of its person. [s]"""
    longest_login_s: Annotated[float, Field(ge=60.0, le=86_400.0)] = 28_800.0
    """A log-in ends after so long in any case. [s]"""
    evaluation_s: Annotated[float, Field(ge=1.0, le=600.0)] = 60.0
    """Longest time of the evaluation of an uploaded run. [s]"""


Named = Annotated[dict[Word, _Table], Field(max_length=_MOST_ENTRIES)]
"""Tables by a name that the file chooses."""


@final
class MachineFile(Section):
    """The whole file."""

    machine: MachineSection
    """What is compensated, and with which model."""
    connection: Named[ConnectionSection] = Field(default_factory=dict)
    """OPC UA connections by name."""
    source: SourceSection
    """Where the values come from."""
    sink: SinkSection
    """Where the corrections go."""
    input: Named[InputSection]
    """One table for every channel of the model."""
    interlock: Named[InterlockSection] = Field(default_factory=dict)
    """Conditions that must be met."""
    other_compensation: OtherCompensationSection | None = None
    """A flag that tells whether another compensation is active."""
    diameter: DiameterSection | None = None
    """The workpiece's clamping diameter."""
    probe: Named[ProbeSection] = Field(default_factory=dict)
    """What is measured while the correction acts."""
    output: Named[OutputSection]
    """One table for every output of the model."""
    supervisor: SupervisorSection = Field(default_factory=SupervisorSection)
    """How long what is tolerated."""
    validity: ValiditySection = Field(default_factory=ValiditySection)
    """What follows outside the range of the training logs."""
    historian: HistorianSection = Field(default_factory=HistorianSection)
    """Where every cycle is recorded."""
    server: ServerSection | None = None
    """The status server."""
    metrics: MetricsSection | None = None
    """Figures for Prometheus."""
    screen: ScreenSection | None = None
    """The pages of thermaxis screen."""


SECTIONS: dict[str, tuple[type[BaseModel], type[Rules] | None]] = {
    "machine": (MachineSection, None),
    "connection.NAME": (ConnectionSection, None),
    "source": (SourceSection, None),
    "sink": (SinkSection, LinuxCncSettings),
    "input.NAME": (InputSection, SensorRules),
    "interlock.NAME": (InterlockSection, None),
    "other_compensation": (OtherCompensationSection, None),
    "diameter": (DiameterSection, None),
    "probe.NAME": (ProbeSection, None),
    "output.NAME": (OutputSection, Limits),
    "supervisor": (SupervisorSection, SupervisorRules),
    "validity": (ValiditySection, None),
    "historian": (HistorianSection, HistorianSettings),
    "server": (ServerSection, None),
    "metrics": (MetricsSection, None),
    "screen": (ScreenSection, None),
}
"""Every table with its keys, and the class that has the defaults of the rest."""
