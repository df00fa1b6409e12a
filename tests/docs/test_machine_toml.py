"""The tables of docs/machine-toml.md are those of the program, and so is the schema for editors."""

import json
import re
import subprocess
import sys
import tomllib

import pytest

from tests.docs.refresh_machine_toml import PAGE, parts_of, refreshed, tables
from thermaxis.files.settings import schema_of
from thermaxis.runtime.config import MachineFile

UNITS = {
    "_um_per_s2": "µm/s²",
    "_um_per_s": "µm/s",
    "_k_per_s": "K/s",
    "_um": "µm",
    "_mm": "mm",
    "_c": "°C",
    "_k": "K",
    "_s": "s",
    "_days": "d",
    "_bytes": "byte",
}


def test_the_page_has_every_key_with_its_meaning_unit_default_and_origin() -> None:
    page = PAGE.read_text("utf-8")
    assert page == refreshed(page), "run tests/docs/refresh_machine_toml.py"
    assert re.findall(r"^## `\[(.+)\]`$", page, re.MULTILINE) == list(tables())


def test_every_key_says_what_it_means_its_unit_and_where_its_default_comes_from() -> None:
    for name, table in tables().items():
        for key, entry in table["properties"].items():
            meaning, origin, absent, unit = parts_of(entry)
            default = entry.get("default")
            assert len(meaning) > 5, (name, key)
            suffix = next((s for s in UNITS if key.endswith(s)), "")
            assert unit == UNITS.get(suffix, unit), (name, key)
            if isinstance(default, float | int) and not isinstance(default, bool | None):
                assert origin or absent or key == "port", (name, key)
            for word in entry.get("enum", ()):
                assert f"`{word}`" in meaning, (name, key, word)


@pytest.mark.proof
def test_the_schema_for_editors_knows_every_key_of_the_example_and_needs_no_other() -> None:
    command = [sys.executable, "-m", "thermaxis", "check", "--schema"]
    printed = subprocess.run(command, check=True, capture_output=True).stdout
    schema = json.loads(printed)
    assert schema == schema_of(MachineFile)
    example = tomllib.loads((PAGE.parents[1] / "examples/machine/lathe.toml").read_text("utf-8"))
    assert set(schema["required"]) <= set(example) <= set(schema["properties"])
    for name, table in tables().items():
        first, _, several = name.partition(".")
        found = example.get(first, {})
        for stated in found.values() if several else [found] if found else []:
            assert set(table.get("required", ())) <= set(stated) <= set(table["properties"])
            assert not table["additionalProperties"]
