from ._recognition import (
    read_positioning as read_positioning,
    read_positioning_with_sha256 as read_positioning_with_sha256,
)
from .iso230_dat import read_iso230_dat as read_iso230_dat
from .rtl import read_rtl as read_rtl, write_rtl as write_rtl
from .tidy_csv import (
    format_tidy_csv as format_tidy_csv,
    read_tidy_csv as read_tidy_csv,
    write_tidy_csv as write_tidy_csv,
)
from .wide_csv import read_wide_csv as read_wide_csv
from .xlsx import read_xlsx as read_xlsx
