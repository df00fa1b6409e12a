"""Commands of this program in processes of their own, with limits."""

from thermaxis.screen.work._work import (
    BusyError,
    Ending,
    Limits,
    Outcome,
    Work,
    WorkFolder,
    close_work,
    remove_leftovers,
    work_of,
)

__all__ = [
    "BusyError",
    "Ending",
    "Limits",
    "Outcome",
    "Work",
    "WorkFolder",
    "close_work",
    "remove_leftovers",
    "work_of",
]
