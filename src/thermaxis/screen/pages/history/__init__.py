"""The page of past hours."""

from thermaxis.screen.pages.history._events import said_event
from thermaxis.screen.pages.history._rows import (
    Kept,
    NoHistoryError,
    close_history,
    found_in_history,
    history_of,
)
from thermaxis.screen.pages.history._series import (
    Json,
    line_of,
    points_within,
    shortened,
    span_of,
    to_ms,
)
from thermaxis.screen.pages.history.page import (
    LENGTHS,
    points_of,
)

__all__ = [
    "LENGTHS",
    "Json",
    "Kept",
    "NoHistoryError",
    "close_history",
    "found_in_history",
    "history_of",
    "line_of",
    "points_of",
    "points_within",
    "said_event",
    "shortened",
    "span_of",
    "to_ms",
]
