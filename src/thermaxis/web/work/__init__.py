"""Commands of this program in processes of their own, with limits."""

from thermaxis.web.work._work import (
    PROGRESS as PROGRESS,
    BusyError as BusyError,
    Ending as Ending,
    Limits as Limits,
    Outcome as Outcome,
    Work as Work,
    WorkFolder as WorkFolder,
    close_work as close_work,
    is_file as is_file,
    remove_leftovers as remove_leftovers,
    work_of as work_of,
)
