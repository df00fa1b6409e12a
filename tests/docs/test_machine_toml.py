"""docs/machine-toml.md lists every key of machine.toml with its default, and no other."""

import re
import tomllib
from dataclasses import MISSING, fields
from pathlib import Path

from pydantic import BaseModel

from thermaxis.compensation import Compensation
from thermaxis.runtime.config import SECTIONS, MachineFile

PAGE = Path(__file__).parents[2] / "docs" / "machine-toml.md"
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
WORKED_OUT = {"total_um", "soft_um", "watchdog_s"}
"""Defaults that follow from other values; the class says 0 for them."""
ELSEWHERE = {"margin_k": "validity_margin_k", "lowest_weight": "lowest_weight"}


def rows_of(table: str) -> dict[str, list[str]]:
    text = PAGE.read_text(encoding="utf-8")
    section = text.split(f"## `[{table}]`")[1].split("\n## ")[0]
    rows: dict[str, list[str]] = {}
    for line in section.splitlines():
        match = re.match(r"\| `(\w+)` \|", line)
        if match:
            cells = [cell.strip() for cell in line.strip("|").split("|")]
            assert len(cells) == 5, line
            assert match[1] not in rows, line
            rows[match[1]] = cells
    return rows


def default_of(table: str, key: str) -> object:
    """Return what the program takes where the key is left out; MISSING where it must be there."""
    model, rules = SECTIONS[table]
    field = model.model_fields[key]
    if field.is_required():
        return MISSING
    if field.default is not None:
        return field.default
    known = Compensation if key in ELSEWHERE else rules
    if known is None:
        return None
    name = ELSEWHERE.get(key, key)
    return next((entry.default for entry in fields(known) if entry.name == name), None)


def test_the_page_has_exactly_the_keys_of_the_program():
    written = {table: list(rows_of(table)) for table in SECTIONS}
    assert written == {table: list(model.model_fields) for table, (model, _) in SECTIONS.items()}


def stated(cell: str, default: object) -> object:
    """Return the default that a cell states, as TOML has it."""
    value = re.fullmatch(r"`([^`]*)`", cell)
    assert value is not None, cell
    text = value[1] if not isinstance(default, str) else f'"{value[1]}"'
    return tomllib.loads(f"x = {text}")["x"]


def test_the_page_states_the_defaults_and_units_of_the_program():
    for table in SECTIONS:
        for key, cells in rows_of(table).items():
            default, cell = default_of(table, key), cells[3]
            if default is MISSING:
                assert cell == "required", (table, key)
            elif default is None or default == "" or key in WORKED_OUT:
                assert cell not in {"", "required"}, (table, key)
                assert not re.fullmatch(r"`[^`]*`", cell), (table, key)
            else:
                read = stated(cell, default)
                assert (read, type(read)) == (default, type(default)), (table, key)
            suffix = next((s for s in UNITS if key.endswith(s)), None)
            if suffix is not None:
                assert cells[2] == UNITS[suffix], (table, key)


def test_every_number_of_the_page_has_an_origin_of_its_default():
    for table in SECTIONS:
        for key, cells in rows_of(table).items():
            if re.fullmatch(r"`[\d.]+`", cells[3]) and key != "port":
                assert cells[4], key


def test_every_table_of_the_file_is_on_the_page_and_every_key_has_a_meaning():
    tables = {name.partition(".")[0] for name in SECTIONS}
    assert tables == set(MachineFile.model_fields)
    headings = re.findall(r"^## `\[(.+)\]`$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert headings == list(SECTIONS)
    for name, (model, _) in SECTIONS.items():
        assert issubclass(model, BaseModel)
        for key, cells in rows_of(name).items():
            assert len(cells[1]) > 5, key


def test_words_that_may_stand_in_a_key_are_on_the_page():
    for name, (model, _) in SECTIONS.items():
        for key, schema in model.model_json_schema()["properties"].items():
            for word in schema.get("enum", ()):
                assert f"`{word}`" in " ".join(rows_of(name)[key]), f"{key}: {word}"
