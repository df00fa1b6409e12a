"""Write results as JSON, to a file or alone on standard output."""

import json
import sys
from collections.abc import Mapping
from pathlib import Path


def write_json(results: Mapping[str, object], destination: str) -> None:
    """Write results as JSON.

    Parameters
    ----------
    results : Mapping
        Strings, numbers, lists, mappings and None; a number that is not finite is a defect.
    destination : str
        File, or ``-`` for standard output.
    """
    text = json.dumps(results, indent=2, allow_nan=False) + "\n"
    if destination == "-":
        sys.stdout.write(text)
    else:
        Path(destination).write_text(text, encoding="ascii", newline="\n")
