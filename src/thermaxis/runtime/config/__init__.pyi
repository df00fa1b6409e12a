from ._certificates import (
    certificate_ends as certificate_ends,
    certificates_of as certificates_of,
)
from ._configuration import (
    MachineConfiguration as MachineConfiguration,
    MachineRules as MachineRules,
    ModelFile as ModelFile,
    read_model_file as read_model_file,
)
from ._contradictions import (
    check_pages as check_pages,
)
from ._hash import (
    configuration_sha256 as configuration_sha256,
)
from ._machine import (
    examine_machine as examine_machine,
    open_connection as open_connection,
    read_machine as read_machine,
    state_file_of as state_file_of,
)
from ._tables import (
    DiameterSettings as DiameterSettings,
    FlagSettings as FlagSettings,
    InputSettings as InputSettings,
    MachineFile as MachineFile,
    MetricsSettings as MetricsSettings,
    OutputSettings as OutputSettings,
    ProbeSettings as ProbeSettings,
    ScreenSettings as ScreenSettings,
    ServerSettings as ServerSettings,
    SinkSettings as SinkSettings,
    SourceSettings as SourceSettings,
)
from ._touch_proofs import (
    keep_touch_proof as keep_touch_proof,
    unproven_touches as unproven_touches,
    with_proven_touches as with_proven_touches,
)
from ._warnings import (
    history_day_mb as history_day_mb,
    page_certificate_findings as page_certificate_findings,
    warnings_of as warnings_of,
)
