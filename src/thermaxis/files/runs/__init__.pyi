from ._recognition import (
    read_positioning as read_positioning,
    read_positioning_with_sha256 as read_positioning_with_sha256,
)
from .rtl import write_rtl as write_rtl
from .tidy_csv import (
    format_tidy_csv as format_tidy_csv,
    write_tidy_csv as write_tidy_csv,
)
