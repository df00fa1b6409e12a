"""Tell the format of a measurement file from what is in it."""

import re
from dataclasses import fields
from hashlib import sha256
from pathlib import Path

from thermaxis.codes import Message, Place
from thermaxis.errors import MeasurementFileError
from thermaxis.files import table as tables
from thermaxis.files.runs.iso230_dat import dat_test
from thermaxis.files.runs.rtl import rtl_test
from thermaxis.files.runs.tidy_csv import tidy_test
from thermaxis.files.runs.wide_csv import wide_test
from thermaxis.files.table import (
    FALLBACK_ENCODING,
    NO_MAPPING,
    Layout,
    RunMapping,
    Table,
    csv_table,
    decode_text,
    read_content,
)
from thermaxis.positioning import PositioningTest

_START_CHARACTERS = 65_536
_WORKBOOK_STARTS = (b"PK\x03\x04", b"PK\x05\x06", b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1")
_RTL_SECTION = re.compile(r"^[ \t]*(?:HEADER|TARGET DATA|RUNS|DEVIATIONS) ?::", re.MULTILINE)
_DAT_ENTRY = re.compile(r"^[ \t]*(?:TGT_DATA|REF_DATA_FWD|REF_DATA_BWD) ?\[", re.MULTILINE)
_NUMBER = r"[-+]?[0-9.]+"
_NO_RUNS = {
    "run_is_table": re.compile(
        rf"\$AA_ENC_COMP\w*\[|\A(?:\s*{_NUMBER}[ \t]+{_NUMBER}[ \t]+{_NUMBER}[ \t]*$)+\s*\Z",
        re.MULTILINE,
    ),
    "run_is_report": re.compile(r"\A# ecmc motion system test report"),
}
"""Files that lie beside runs, by the code of the error."""


def read_positioning(
    path: Path | str,
    *,
    fallback_encoding: str = FALLBACK_ENCODING,
    mapping: RunMapping = NO_MAPPING,
) -> PositioningTest:
    """Read a positioning run from a file of any format that is known here.

    The format is told from the content: Renishaw ``.rtl``, ``_ISO230.dat``, tidy or wide CSV, or a
    workbook with either CSV layout. The name of the file plays no part.

    Parameters
    ----------
    fallback_encoding : str
        Encoding of a text file that is not UTF-8. Default: cp1250, met in files of Czech Windows.
    mapping : RunMapping
        What the user says about a table, where it does not say it. Default: nothing.

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
    return _test_of(str(path), read_content(path), fallback_encoding, mapping)


def read_positioning_with_sha256(
    path: Path | str,
    *,
    fallback_encoding: str = FALLBACK_ENCODING,
    mapping: RunMapping = NO_MAPPING,
) -> tuple[PositioningTest, str]:
    """Read a positioning run, and identify the very bytes that it was made of.

    The file is read once: a program that writes to it at the same time cannot make the run and
    the hash belong to different contents.

    Parameters
    ----------
    fallback_encoding : str
        Encoding of a text file that is not UTF-8. Default: as `read_positioning`.
    mapping : RunMapping
        As `read_positioning`.

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
    content = read_content(path)
    test = _test_of(str(path), content, fallback_encoding, mapping)
    return test, sha256(content).hexdigest()


def _test_of(
    name: str, content: bytes, fallback_encoding: str, mapping: RunMapping
) -> PositioningTest:
    if content.startswith(_WORKBOOK_STARTS):
        return _table_test(tables.workbook_table(name, content, mapping))  # imported when it is met
    source = decode_text(name, content, fallback_encoding=fallback_encoding)
    start = source.text[:_START_CHARACTERS]
    if _RTL_SECTION.search(start):
        _check_not_mapped(name, mapping, ".rtl")
        return rtl_test(source)
    if _DAT_ENTRY.search(start):
        _check_not_mapped(name, mapping, "_ISO230.dat")
        return dat_test(source)
    try:
        return _table_test(csv_table(source, mapping))
    except MeasurementFileError as error:
        code = next((code for code, form in _NO_RUNS.items() if form.search(start)), None)
        if code is None:
            raise
        message = Message(f"error-{code}", {"file": Path(name).name}, Place(name))
        raise MeasurementFileError.of(message) from error


def _table_test(table: Table) -> PositioningTest:
    """Make a positioning test from a table of either layout."""
    known = tuple(heading.text for heading in table.headings)
    for name in table.source.mapping.columns:
        if name not in known:
            raise MeasurementFileError(
                "no_such_column", name=name, known=known[:8], place=table.at()
            )
    return tidy_test(table) if table.layout is Layout.TIDY else wide_test(table)


def _check_not_mapped(name: str, mapping: RunMapping, kind: str) -> None:
    """Refuse what a user says about columns where the format says it itself."""
    for field in fields(mapping):
        if getattr(mapping, field.name) != getattr(NO_MAPPING, field.name):
            raise MeasurementFileError(
                "reading_option_unused", name=field.name, what=kind, file=name
            )
