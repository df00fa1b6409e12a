"""The page of past hours."""

from thermaxis.screen.pages.history._events import said_event as said_event
from thermaxis.screen.pages.history._rows import (
    Kept as Kept,
    NoHistoryError as NoHistoryError,
    close_history as close_history,
    found_in_history as found_in_history,
    history_of as history_of,
)
from thermaxis.screen.pages.history._series import (
    Json as Json,
    line_of as line_of,
    points_within as points_within,
    shortened as shortened,
    span_of as span_of,
    to_ms as to_ms,
)
from thermaxis.screen.pages.history._worker_thread import WorkerThread as WorkerThread
from thermaxis.screen.pages.history.page import (
    LENGTHS as LENGTHS,
    points_of as points_of,
)
