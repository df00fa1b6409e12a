"""Write the tables of docs/machine-toml.md from the keys of the program.

``python tests/docs/refresh_machine_toml.py`` after a change of a key; what stands between the
tables is written by hand.
"""

import json
import re
from pathlib import Path
from typing import Any

from thermaxis.files.settings import schema_of
from thermaxis.runtime.config import MachineFile

PAGE = Path(__file__).resolve().parents[2] / "docs" / "machine-toml.md"
HEAD = "| key | meaning | unit | default | origin of the default |\n|---|---|---|---|---|\n"
PARTS = re.compile(
    r"(?P<meaning>.*?)\.?(?: Default: (?P<origin>.*?)\.?)?(?: Without it: (?P<absent>.*?)\.?)?"
    r"(?: \[(?P<unit>degC|[^\]. ]+)\])?"
)
"""What a description says of a key."""
ROWS = re.compile(r"\| key .*\n(?:\|.*\n)*")


def parts_of(entry: Any) -> list[str]:
    """Return meaning, origin, what follows without the key, and unit."""
    parts = PARTS.fullmatch(entry["description"])
    assert parts is not None, entry
    meaning, origin, absent, unit = (text or "" for text in parts.groups())
    return [meaning, origin, absent, unit.replace("degC", "°C")]


def tables() -> dict[str, Any]:
    """Return the schema of every table by its heading."""
    schema = schema_of(MachineFile)
    found: dict[str, Any] = {}
    for name, entry in schema["properties"].items():
        (ref,) = re.findall(r'"#/\$defs/(\w+)"', json.dumps(entry))
        several = "additionalProperties" in entry
        found[f"{name}.NAME" if several else name] = schema["$defs"][ref]
    return found


def rows_of(table: Any) -> str:
    """Return the rows of one table."""
    rows: list[str] = []
    for key, entry in table["properties"].items():
        meaning, origin, absent, unit = parts_of(entry)
        default = entry.get("default")
        if key in table.get("required", ()):
            shown = "required"
        elif absent or default is None or default == "":
            shown = absent or "none"
        else:
            shown = f"`{default if isinstance(default, str) else json.dumps(default)}`"
        first = meaning[0].lower() if meaning[1:2] != "A" else meaning[0]
        row = f"| `{key}` | {first}{meaning[1:]} | {unit} | {shown} | {origin} |\n"
        rows.append(row.replace("|  |", "| |").replace("|  |", "| |"))
    return HEAD + "".join(rows)


def refreshed(text: str) -> str:
    """Return the page with its tables as the program has them."""
    for name, table in tables().items():
        head, heading, rest = text.partition(f"## `[{name}]`\n")
        assert heading, f"the page has no part [{name}]"
        text = head + heading + ROWS.sub(lambda _, t=table: rows_of(t), rest, count=1)
    return text


if __name__ == "__main__":
    PAGE.write_text(refreshed(PAGE.read_text("utf-8")), "utf-8")
