"""Tell the format of a measurement file from what is in it."""

import re
from pathlib import Path

from thermaxis.files.table import (
    FALLBACK_ENCODING,
    Layout,
    SourceText,
    csv_table,
    decode_text,
    read_content,
)
from thermaxis.positioning import PositioningTest

# Each reader is imported where its format is recognised: together they take as long to import as
# a run of 100 cycles takes to read.

_START_CHARACTERS = 65_536
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
    return _test_of(str(path), read_content(path), fallback_encoding)


def read_positioning_with_sha256(
    path: Path | str, *, fallback_encoding: str = FALLBACK_ENCODING
) -> tuple[PositioningTest, str]:
    """Read a positioning run, and identify the very bytes that it was made of.

    The file is read once: a program that writes to it at the same time cannot make the run and
    the hash belong to different contents.

    Parameters
    ----------
    path : Path or str
        The file.
    fallback_encoding : str
        Encoding of a text file that is not UTF-8. Default: as `read_positioning`.

    Returns
    -------
    test : PositioningTest
        As `read_positioning`.
    sha256 : str
        SHA-256 of the content of the file, 64 hexadecimal digits in lower case.

    Raises
    ------
    MeasurementFileError
        As `read_positioning`.
    ConfigurationError
        As `read_positioning`.
    """
    from hashlib import sha256  # noqa: PLC0415  not every reader of a run wants the hash

    content = read_content(path)
    return _test_of(str(path), content, fallback_encoding), sha256(content).hexdigest()


def _test_of(name: str, content: bytes, fallback_encoding: str) -> PositioningTest:
    if content.startswith(_WORKBOOK_STARTS):
        from thermaxis.files.runs.xlsx import workbook_test  # noqa: PLC0415  see above

        return workbook_test(name, content)
    return _test_of_text(decode_text(name, content, fallback_encoding=fallback_encoding))


def _test_of_text(source: SourceText) -> PositioningTest:
    start = source.text[:_START_CHARACTERS]
    if _RTL_SECTION.search(start):
        from thermaxis.files.runs.rtl import rtl_test  # noqa: PLC0415  see above

        return rtl_test(source)
    if _DAT_ENTRY.search(start):
        from thermaxis.files.runs.iso230_dat import dat_test  # noqa: PLC0415  see above

        return dat_test(source)
    table = csv_table(source)
    if table.layout is Layout.TIDY:
        from thermaxis.files.runs.tidy_csv import tidy_test  # noqa: PLC0415  see above

        return tidy_test(table)
    from thermaxis.files.runs.wide_csv import wide_test  # noqa: PLC0415  see above

    return wide_test(table)
