"""``thermaxis convert``: get readings out of any file as tidy CSV."""

import argparse
import sys
from pathlib import Path

from thermaxis.codes import printable
from thermaxis.errors import ConfigurationError
from thermaxis.files import FALLBACK_ENCODING, format_tidy_csv, read_positioning, write_tidy_csv

_DESCRIPTION = """\
Read a positioning run from a Renishaw .rtl file, an _ISO230.dat file, a tidy or wide CSV file or an
.xlsx workbook, and write it as tidy CSV: one reading per row, header and environment in lines of
comment above. The format is told from the content. Remarks go to standard error.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    parser.description = _DESCRIPTION
    parser.add_argument(
        "file", metavar="FILE", help="measured run: .rtl, CSV, _ISO230.dat or .xlsx"
    )
    parser.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        required=True,
        help="the tidy CSV file to write, replaced if it exists; - for standard output",
    )
    parser.add_argument(
        "--encoding",
        metavar="NAME",
        default=None,
        help="encoding of a text file that is not UTF-8 (default: cp1250)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Convert one file."""
    _check_output(arguments.file, arguments.output)
    encoding = FALLBACK_ENCODING if arguments.encoding is None else arguments.encoding
    test = read_positioning(arguments.file, fallback_encoding=encoding)
    for remark in test.remarks:
        sys.stderr.write(f"remark: {printable(remark, 400)}\n")
    if arguments.output == "-":
        sys.stdout.flush()
        sys.stdout.buffer.write(format_tidy_csv(test).encode())
        sys.stdout.buffer.flush()
    else:
        write_tidy_csv(test, arguments.output)
    return 0


def _check_output(file: str, output: str) -> None:
    if output == "-":
        return
    try:
        same = Path(output).samefile(file)
    except (OSError, ValueError):  # one of them does not exist: reading or writing says so
        same = False
    if same:
        raise ConfigurationError(
            "the output would replace the measurement itself",
            where=output,
            remedy="Name another file",
        )
