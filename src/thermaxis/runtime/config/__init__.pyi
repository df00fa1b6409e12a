from ._connection import (
    ConnectionSection as ConnectionSection,
    Section as Section,
    explain as explain,
    problem as problem,
    read_tables as read_tables,
    refuse as refuse,
)
from ._hash import (
    configuration_sha256 as configuration_sha256,
)
from ._machine import (
    examine_machine as examine_machine,
    read_machine as read_machine,
    state_file_of as state_file_of,
)
from ._screen import (
    page_certificate_findings as page_certificate_findings,
)
from ._sections import (
    SECTIONS as SECTIONS,
    MachineFile as MachineFile,
)
from ._settings import (
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
    read_model_file as read_model_file,
)
from ._warnings import (
    certificate_ends as certificate_ends,
    warnings_of as warnings_of,
)
