"""Write any measured run as tidy CSV.

The run is a Renishaw .rtl file, an _ISO230.dat file, tidy or wide CSV or an .xlsx workbook, which
is told from the content. One reading stands in a row, header and environment in lines of comment
above. Remarks go to standard error.
"""

import argparse
import sys

from thermaxis.cli._arguments import adder
from thermaxis.cli._outputs import check_outputs
from thermaxis.cli._reading import add_reading, reading_of
from thermaxis.codes import printable
from thermaxis.files import format_tidy_csv, read_positioning, write_tidy_csv
from thermaxis.messages import sentence_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the command."""
    adder(parser)("file FILE", "measured run: .rtl, CSV, _ISO230.dat, .xlsx or .xls")
    adder(parser)(
        "-o, --output FILE",
        "the tidy CSV file to write, replaced if it exists; - for standard output",
        required=True,
    )
    add_reading(parser, "a text")


def run(arguments: argparse.Namespace) -> int:
    """Convert one file."""
    check_outputs([("-o", arguments.output)], [arguments.file, arguments.map])
    test = read_positioning(arguments.file, **reading_of(arguments))
    for remark in test.remarks:
        sys.stderr.write(f"remark: {printable(sentence_of(remark), 400)}\n")
    if arguments.output == "-":
        sys.stdout.flush()
        sys.stdout.buffer.write(format_tidy_csv(test).encode())
        sys.stdout.buffer.flush()
    else:
        write_tidy_csv(test, arguments.output)
    return 0
