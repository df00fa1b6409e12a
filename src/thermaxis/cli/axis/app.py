"""Open a page in the browser on which measured files are dropped.

It is served to this computer alone, at an address with a random token; files are kept in a private
folder that goes with the program. Ctrl+C, or the button of the page, ends it.
"""

import argparse
import asyncio
import sys
import webbrowser

from thermaxis.cli._arguments import adder, count

PORT = 8460
"""Usual port: its cookie is the browser's of this address and port. [1]"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("--port N", "port of this computer", count("port", 0), default=PORT)
    add("--no-browser", "print the address only, open no browser", bool)


def run(arguments: argparse.Namespace) -> int:
    """Serve until ended."""
    from thermaxis.app import serve_app  # noqa: PLC0415 - a web server, for this command alone

    def tell(address: str) -> None:
        sys.stdout.write(f"{address}\nCtrl+C ends it.\n")
        sys.stdout.flush()
        if not arguments.no_browser and not webbrowser.open(address):
            sys.stderr.write("No browser could be opened: open the address above in one.\n")

    asyncio.run(serve_app(arguments.port, tell))
    return 0
