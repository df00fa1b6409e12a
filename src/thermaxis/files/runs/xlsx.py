"""Workbooks, ``.xlsx``: a tidy or a wide table on one of their sheets."""

from pathlib import Path

from thermaxis.errors import MeasurementFileError
from thermaxis.files import table as tables
from thermaxis.files.runs.tidy_csv import tidy_test
from thermaxis.files.runs.wide_csv import wide_test
from thermaxis.files.table import Layout, Table, read_content
from thermaxis.positioning import PositioningTest


def read_xlsx(path: Path | str) -> PositioningTest:
    """Read a workbook with a tidy or a wide table.

    The first visible sheet on which the headings of a run are found is read. Headings, units,
    comments and fields above the headings are those of the CSV layouts; times may be cells with
    a date. A formula counts with its stored value.

    Parameters
    ----------
    path : Path or str
        The file.

    Returns
    -------
    PositioningTest
        As from the CSV layout of the same kind.

    Raises
    ------
    MeasurementFileError
        If the file is no workbook or a damaged one, it is too large, no sheet holds a run, or a
        cell does not hold what its column promises; the error names the sheet and the cell.
    """
    return table_test(tables.workbook_table(str(path), read_content(path)))


def table_test(table: Table) -> PositioningTest:
    """Make a positioning test from a table of either layout."""
    known = tuple(heading.text for heading in table.headings)
    for name in table.source.mapping.columns:
        if name not in known:
            raise MeasurementFileError(
                "no_such_column", name=name, known=known[:8], place=table.at()
            )
    return tidy_test(table) if table.layout is Layout.TIDY else wide_test(table)
