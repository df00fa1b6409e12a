from ._columns import (
    ACTIVE as ACTIVE,
    TIME as TIME,
    Columns as Columns,
    input_column as input_column,
    output_column as output_column,
)
from ._database import (
    check_database as check_database,
    printable_cause as printable_cause,
    writing_engine as writing_engine,
)
from ._export import (
    Condition as Condition,
    Export as Export,
    check_history as check_history,
    copy_history as copy_history,
    export_history as export_history,
)
from ._historian import (
    SqlHistorian as SqlHistorian,
    pack_event as pack_event,
)
from ._integrity import (
    check_file as check_file,
)
from ._none import (
    NoHistorian as NoHistorian,
)
from ._parts import (
    DATUM_SET as DATUM_SET,
    MINUTE as MINUTE,
    Part as Part,
    machine_folder as machine_folder,
    note_shipped as note_shipped,
    unjoined as unjoined,
)
from ._reader import (
    HistoryReader as HistoryReader,
    Trend as Trend,
)
from ._settings import (
    HistorianSettings as HistorianSettings,
)
from ._touched import (
    BELIEVED as BELIEVED,
    touch_column as touch_column,
    touched_log as touched_log,
)
from ._url import (
    Encryption as Encryption,
    check_url as check_url,
    encryption_of as encryption_of,
    history_folder as history_folder,
    refuse_password as refuse_password,
    sqlite_path as sqlite_path,
)
