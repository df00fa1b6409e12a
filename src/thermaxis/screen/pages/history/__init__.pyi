from ._rows import (
    Kept as Kept,
    NoHistoryError as NoHistoryError,
    asker_of as asker_of,
    close_history as close_history,
    history_of as history_of,
)
from ._series import (
    Json as Json,
    line_of as line_of,
    points_within as points_within,
    shortened as shortened,
    span_of as span_of,
    to_ms as to_ms,
)
from .page import (
    LENGTHS as LENGTHS,
    away as away,
    points_of as points_of,
)
