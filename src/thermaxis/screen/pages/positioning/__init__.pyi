from ._work import (
    BusyError as BusyError,
    Ending as Ending,
    Limits as Limits,
    Outcome as Outcome,
    WorkFolder as WorkFolder,
    close_work as close_work,
    work_of as work_of,
)
