from ._config import (
    ChannelSettings as ChannelSettings,
    RecordSettings as RecordSettings,
    read_record as read_record,
)
from ._files import (
    RecordingFiles as RecordingFiles,
    sole_writer as sole_writer,
    write_parquet as write_parquet,
)
from ._recorder import (
    Recorder as Recorder,
    RecordSummary as RecordSummary,
    TriedChannel as TriedChannel,
    bytes_per_day as bytes_per_day,
    try_once as try_once,
)
