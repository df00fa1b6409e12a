"""Write results as JSON, to a file or alone on standard output."""

import json
import sys
from collections.abc import Mapping
from pathlib import Path

from thermaxis.report import write_bytes


def write_json(results: Mapping[str, object], destination: str) -> None:
    """Write results as JSON."""
    text = json.dumps(results, indent=2, allow_nan=False) + "\n"
    if destination == "-":
        sys.stdout.write(text)
        return

    write_bytes(Path(destination), text.encode("ascii"))
