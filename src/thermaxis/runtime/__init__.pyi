from ._connection import (
    SECURITIES as SECURITIES,
    ConnectionSettings as ConnectionSettings,
    Secret as Secret,
)
from ._findings import (
    Finding as Finding,
    Level as Level,
)
from ._offsets import OTHERS_WITHIN_S as OTHERS_WITHIN_S
from ._ports import (
    DATUM as DATUM,
    DIAMETER as DIAMETER,
    NOT_READ as NOT_READ,
    OTHER_COMPENSATION as OTHER_COMPENSATION,
    Applied as Applied,
    Clock as Clock,
    CycleRecord as CycleRecord,
    EventRecord as EventRecord,
    Historian as Historian,
    HistorianStatus as HistorianStatus,
    LoopAnswer as LoopAnswer,
    RequestBox as RequestBox,
    RequestOutcome as RequestOutcome,
    Sink as Sink,
    Source as Source,
    SourceSample as SourceSample,
    SystemClock as SystemClock,
    counter_name as counter_name,
    interlock_name as interlock_name,
    probe_name as probe_name,
    redundant_name as redundant_name,
)
from ._sign import (
    AWAY as AWAY,
    OFFSET_UNITS as OFFSET_UNITS,
    SIGNS as SIGNS,
    TOWARDS as TOWARDS,
    offset_factor as offset_factor,
)
from ._virtual_time import (
    START_S as START_S,
    START_UTC as START_UTC,
    VirtualClock as VirtualClock,
    run_in_virtual_time as run_in_virtual_time,
)
from .checks import (
    CommissioningPlan as CommissioningPlan,
    StepProof as StepProof,
    by_touches as by_touches,
    prove_step as prove_step,
    reasons_against as reasons_against,
    self_test as self_test,
)
from .config import (
    DiameterSettings as DiameterSettings,
    FlagSettings as FlagSettings,
    InputSettings as InputSettings,
    MachineConfiguration as MachineConfiguration,
    MachineRules as MachineRules,
    MetricsSettings as MetricsSettings,
    ModelFile as ModelFile,
    OutputSettings as OutputSettings,
    ProbeSettings as ProbeSettings,
    ScreenSettings as ScreenSettings,
    ServerSettings as ServerSettings,
    SinkSettings as SinkSettings,
    SourceSettings as SourceSettings,
    examine_machine as examine_machine,
    read_machine as read_machine,
    warnings_of as warnings_of,
)
from .host import (
    sole_runner as sole_runner,
)
from .loop import (
    PROPOSAL_SUFFIX as PROPOSAL_SUFFIX,
    SELF_TEST as SELF_TEST,
    SHORTEST_WAIT_S as SHORTEST_WAIT_S,
    AtStop as AtStop,
    CompensationLoop as CompensationLoop,
    LoopSettings as LoopSettings,
    Models as Models,
    Ports as Ports,
    SavedState as SavedState,
    SignOfLife as SignOfLife,
    StateFile as StateFile,
    choosable_name as choosable_name,
    model_folder as model_folder,
    model_in_force as model_in_force,
    write_proposal as write_proposal,
)
from .opcua import (
    Certificate as Certificate,
    CertificateUse as CertificateUse,
    NodeDescription as NodeDescription,
    OpcUaSession as OpcUaSession,
)
from .record import (
    ChannelSettings as ChannelSettings,
    Recorder as Recorder,
    RecordSettings as RecordSettings,
    RecordSummary as RecordSummary,
    read_record as read_record,
)
from .status import (
    ALARMS as ALARMS,
    PRIORITIES as PRIORITIES,
    Alarm as Alarm,
    MetricsServer as MetricsServer,
    RuntimeStatus as RuntimeStatus,
    StatusServer as StatusServer,
    alarms_of as alarms_of,
)
from .users import (
    FAILURES_BY_ADDRESS as FAILURES_BY_ADDRESS,
    FAILURES_BY_NAME as FAILURES_BY_NAME,
    LONGEST_NAME as LONGEST_NAME,
    LONGEST_PASSWORD as LONGEST_PASSWORD,
    PIN_MARK as PIN_MARK,
    PIN_REFUSED_S as PIN_REFUSED_S,
    REFUSED_S as REFUSED_S,
    LogInThrottle as LogInThrottle,
    Role as Role,
    User as User,
    check_name as check_name,
    hash_password as hash_password,
    hash_pin as hash_pin,
    read_users as read_users,
    write_users as write_users,
)
