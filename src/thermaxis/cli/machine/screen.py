"""Serve the pages of a machine for the operator and for the engineer.

The operator sees state, correction, alarms and interventions; the engineer model, sensors, history,
probe and positioning runs. The pages read the loop's status server, and ask it under the name of
whoever has logged in. It is a program of its own: the loop does not notice whether it lives. Ended
by Ctrl+C or SIGTERM.
"""

import argparse
import asyncio
import logging
import sys
from pathlib import Path

from thermaxis.cli._arguments import adder
from thermaxis.runtime import SystemClock, read_machine
from thermaxis.screen import serve


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
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
