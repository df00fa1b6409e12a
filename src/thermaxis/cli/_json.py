"""Show a described result: as text, as JSON in a file, or as JSON alone on standard output."""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from thermaxis.codes import printable
from thermaxis.report import write_bytes
from thermaxis.report.tables import Part, as_json, as_text


def write_json(results: Mapping[str, object], destination: str) -> None:
    """Write results as JSON."""
    text = json.dumps(results, indent=2, allow_nan=False) + "\n"
    if destination == "-":
        sys.stdout.write(text)
    else:
        write_bytes(Path(destination), text.encode("ascii"))


def show(
    parts: Sequence[Part],
    destination: str | None,
    written: Sequence[Path | str] = (),
    *,
    quiet: bool = False,
) -> None:
    """Write a result as JSON where that is asked for, else or beside it as text, with its files."""
    if destination is not None:
        write_json(as_json(parts), destination)
    if destination != "-" and not quiet:
        sys.stdout.write(as_text(parts))
        sys.stdout.write("".join(f"written: {printable(str(path))}\n" for path in written))
