from ._backlog import (
    Backlog as Backlog,
)
from ._condition import (
    Condition as Condition,
    check_history as check_history,
    copy_history as copy_history,
)
from ._database import (
    parse_url as parse_url,
)
from ._export import (
    Export as Export,
    export_history as export_history,
)
from ._integrity import (
    check_file as check_file,
)
from ._reading import (
    HistoryReader as HistoryReader,
    Piece as Piece,
    Trend as Trend,
    values_of as values_of,
)
from ._rows import (
    RowPacker as RowPacker,
    printable_cause as printable_cause,
)
from ._settings import (
    HistorianSettings as HistorianSettings,
)
from ._sql import (
    SqlHistorian as SqlHistorian,
)
from ._store import (
    FileWatch as FileWatch,
    open_store as open_store,
)
from ._url import (
    Encryption as Encryption,
    check_encryption as check_encryption,
    encryption_of as encryption_of,
    refuse_password as refuse_password,
)
from ._writer import (
    Writer as Writer,
    pack_event as pack_event,
)
from .none import (
    NoHistorian as NoHistorian,
)
