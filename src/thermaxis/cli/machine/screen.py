"""``thermaxis screen``: serve the operator's and the engineer's pages of a running loop."""

import argparse
import asyncio
import logging
import sys
from pathlib import Path

from thermaxis.cli._arguments import adder
from thermaxis.runtime import SystemClock, read_machine
from thermaxis.screen import serve

_DESCRIPTION = """\
Serve the pages of a machine: for the operator state, correction, alarms and interventions; for the
engineer model, sensors, history, probe and positioning runs. The pages read the loop's status
server, and ask it under the name of whoever has logged in. It is a program of its own: the loop
does not notice whether it lives. Ended by Ctrl+C or SIGTERM.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    parser.description = _DESCRIPTION
    add = adder(parser)
    add("configuration MACHINE.toml", "the machine (TOML)", Path)
    add(
        "--quiet",
        "print errors only, not the address (default: the address is printed once the pages"
        " can be opened)",
        bool,
    )


def run(arguments: argparse.Namespace) -> int:
    """Serve the pages."""
    logging.getLogger("asyncua").setLevel(logging.CRITICAL)  # at DEBUG it writes passwords
    configuration = read_machine(arguments.configuration)

    def tell(address: str) -> None:
        if not arguments.quiet:
            sys.stdout.write(f"screen: {address}\n")
            sys.stdout.flush()

    asyncio.run(serve(configuration, SystemClock(), tell))
    return 0
