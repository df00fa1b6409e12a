"""Print what a bug report needs: versions, platform, extras, encodings, time zone.

Nothing is imported but the standard library, so that it also runs where an installation is broken;
no name of a person, computer or folder is printed.
"""

import argparse
import locale
import os
import platform
import re
import shutil
import sys
import textwrap
import time
from collections.abc import Iterable, Iterator
from importlib import metadata

from thermaxis import __version__

_NAME = re.compile(r"[\w.-]+")
_EXTRA = re.compile(r"""extra\s*==\s*["']([\w-]+)["']""")
_SHOWN = ("machine", "fleet", "postgresql", "flir", "mat73", "tdms")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare no arguments."""


def run(_: argparse.Namespace) -> int:
    """Print the report; code 1 if a package of the core is missing."""
    needed, extras = _required()
    missing = [name for name in needed if _version(name) is None]
    sys.stdout.write("".join(f"{line}\n" for line in _lines(needed, extras)))
    return 1 if missing else 0


def _lines(needed: list[str], extras: dict[str, list[str]]) -> Iterator[str]:
    bits = "64" if sys.maxsize > 2**32 else "32"
    yield f"thermaxis   {__version__}"
    yield f"python      {platform.python_version()} {platform.python_implementation()}, {bits} bit"
    yield f"system      {platform.system()} {platform.release()}, {platform.machine()}"
    libc = " ".join(platform.libc_ver()) or "-"
    yield f"            {os.cpu_count()} processors, libc {libc}"
    yield from _wrapped("packages", (f"{name} {_version(name) or 'MISSING'}" for name in needed))
    for extra in (one for one in _SHOWN if one in extras):
        lacking = [name for name in extras[extra] if _version(name) is None]
        there = (f"{name} {_version(name)}" for name in extras[extra])
        yield from _wrapped(extra, ["without " + ", ".join(lacking)] if lacking else there)
    out = sys.stdout.encoding, sys.getfilesystemencoding(), locale.getencoding()
    yield f"encoding    output {out[0]}, file names {out[1]}, texts {out[2]}"
    yield f"language    {' '.join(filter(None, locale.getlocale())) or 'none'}"
    yield f"time        UTC{time.strftime('%z')}, {', '.join(time.tzname)}"
    size = shutil.get_terminal_size()
    yield f"terminal    {size.columns} x {size.lines}, {'yes' if sys.stdout.isatty() else 'no'} tty"


def _wrapped(title: str, items: Iterable[str]) -> list[str]:
    return textwrap.wrap(
        ", ".join(items), 90, initial_indent=f"{title:<12}", subsequent_indent=" " * 12
    )


def _required() -> tuple[list[str], dict[str, list[str]]]:
    """Return the packages of the core, and those of each extra without what it contains."""
    core: list[str] = []
    extras: dict[str, list[str]] = {}
    for line in metadata.requires("thermaxis") or ():
        requirement, _, marker = line.partition(";")
        name, extra = _NAME.match(requirement.strip()), _EXTRA.search(marker)
        if name is not None and name[0] != "thermaxis":
            (core if extra is None else extras.setdefault(extra[1], [])).append(name[0])
    return core, extras


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None
