"""Tell the format of a measurement file from what is in it."""

import codecs
import re
from pathlib import Path

from thermaxis.files._csv_rows import read_csv_table
from thermaxis.files._source import FALLBACK_ENCODING, read_content
from thermaxis.files._table import Layout
from thermaxis.positioning import PositioningTest

# Each reader is imported where its format is recognised: together they take as long to import as
# a run of 100 cycles takes to read.

_START_BYTES = 65_536
_WORKBOOK_STARTS = (b"PK\x03\x04", b"PK\x05\x06", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1")
_RTL_SECTION = re.compile(r"^[ \t]*(?:HEADER|TARGET DATA|RUNS|DEVIATIONS) ?::", re.MULTILINE)
_DAT_ENTRY = re.compile(r"^[ \t]*(?:TGT_DATA|REF_DATA_FWD|REF_DATA_BWD) ?\[", re.MULTILINE)


def read_positioning(
    path: Path | str, *, fallback_encoding: str = FALLBACK_ENCODING
) -> PositioningTest:
    """Read a positioning run from a file of any format that is known here.

    The format is told from the content: Renishaw ``.rtl``, ``_ISO230.dat``, tidy or wide CSV, or a
    workbook with either CSV layout. The name of the file plays no part.

    Parameters
    ----------
    path : Path or str
        The file.
    fallback_encoding : str
        Encoding of a text file that is not UTF-8. Default: cp1250, met in files of Czech Windows.

    Returns
    -------
    PositioningTest
        The run as measured: nothing is corrected, averaged or left out without a remark.

    Raises
    ------
    MeasurementFileError
        If the file cannot be read, is of no known format, or does not hold what its format
        promises.
    ConfigurationError
        If there is no such fallback encoding.
    """
    start = read_content(path)[:_START_BYTES]
    if start.startswith(_WORKBOOK_STARTS):
        from thermaxis.files.xlsx import read_xlsx  # noqa: PLC0415  see above

        return read_xlsx(path)
    utf16 = start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    text = start.decode("utf-16" if utf16 else "latin-1", errors="replace")
    text = text.removeprefix(codecs.BOM_UTF8.decode("latin-1")).replace("\r", "\n")
    if _RTL_SECTION.search(text):
        from thermaxis.files.rtl import read_rtl  # noqa: PLC0415  see above

        return read_rtl(path, fallback_encoding=fallback_encoding)
    if _DAT_ENTRY.search(text):
        from thermaxis.files.iso230_dat import read_iso230_dat  # noqa: PLC0415  see above

        return read_iso230_dat(path, fallback_encoding=fallback_encoding)
    table = read_csv_table(path, fallback_encoding=fallback_encoding)
    if table.layout is Layout.TIDY:
        from thermaxis.files.tidy_csv import tidy_test  # noqa: PLC0415  see above

        return tidy_test(table)
    from thermaxis.files.wide_csv import wide_test  # noqa: PLC0415  see above

    return wide_test(table)
