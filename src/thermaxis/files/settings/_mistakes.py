"""What pydantic finds wrong in settings, and the schema of what is right."""

import ast
import inspect
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import is_dataclass
from functools import cache
from itertools import pairwise
from textwrap import dedent
from typing import Any, Final, cast, get_args, get_type_hints

from pydantic import ValidationError
from pydantic.json_schema import PydanticJsonSchemaWarning
from pydantic_core import ErrorDetails

from thermaxis.codes import Message, Value, printable
from thermaxis.files.settings._adapter import adapter_of
from thermaxis.files.settings._problems import DEEP, placed, problem, unknown

_CODES: Final[Mapping[str, str]] = {
    "dict_type": "not_a_table",
    "mapping_type": "not_a_table",
    "dataclass_type": "not_a_table",
    "float_type": "no_number",
    "finite_number": "not_finite",
    "int_type": "no_whole_number",
    "int_from_float": "no_whole_number",
    "string_type": "not_a_text",
    "bool_type": "no_boolean",
    "tuple_type": "not_a_list",
    "scale_zero": "scale_zero",
    "control_character": "control_character",
}
"""What is wrong, by pydantic's name of the error."""
_BOUNDS: Final[Mapping[str, tuple[str, str]]] = {
    "greater_than_equal": ("below_bound", "ge"),
    "less_than_equal": ("above_bound", "le"),
    "greater_than": ("not_above_bound", "gt"),
    "less_than": ("not_below_bound", "lt"),
    "string_too_short": ("text_short", "min_length"),
    "string_too_long": ("text_long", "max_length"),
}
"""The same for what has a bound, and pydantic's name of the bound."""


# ---- what pydantic says, as codes ---------------------------------------------------------------


def explained(error: ValidationError, kind: type) -> list[Message]:
    """Say what is wrong, table by table.

    Unknown keys stand first in their table, as a key that is missing may be one that is misspelt.
    """
    details = error.errors(include_url=False)
    tables = [detail["loc"][:-1] for detail in details]
    unknown_ones = ("unexpected_keyword_argument", "extra_forbidden", "secret_in_file")
    details.sort(key=lambda d: (tables.index(d["loc"][:-1]), d["type"] not in unknown_ones))
    return [_problem(detail, schema_of(kind), unknown_ones) for detail in details]


def _problem(detail: ErrorDetails, schema: Any, unknown_ones: Sequence[str]) -> Message:
    loc = [part for part in detail["loc"][1:] if not str(part).endswith("[key]")]
    kind, key, name = detail["type"], "", str(loc[-1]) if loc else ""
    for part in loc:
        key += f"[{part}]" if isinstance(part, int) else f".{part}" if key else part
    key = printable(key)
    context = cast("Mapping[str, Any]", detail.get("ctx", {}))
    if kind == "refused":
        return placed(context["message"], key)
    if kind in unknown_ones:
        return unknown(name, key, _node(schema, loc[:-1]).get("properties", {}))
    if kind == "json_invalid":  # what is nested in hundreds
        return problem("not_toml", "", cause=DEEP)
    if kind in _CODES:
        return problem(_CODES[kind], key)
    if kind in {"literal_error", "enum"}:
        return problem("value_unknown", key, known=str(context["expected"]))
    meaning = re.split(r" Default: | Without it: | \[", _node(schema, loc).get("description", ""))
    values: dict[str, Value] = {"meaning": meaning[0].rstrip(".")}
    code, bound = _BOUNDS.get(kind, ("key_needed" if kind == "missing" else "value_refused", ""))
    if bound:
        values["bound"] = context[bound]
    elif not meaning[0]:
        code = "missing_key" if kind == "missing" else "impossible_value"
        values = {} if kind == "missing" else {"text": printable(str(detail["input"]), 60)}
    elif kind == "missing":
        values["name"] = name
    else:
        values["said"] = detail["msg"]
    return problem(code, key, **values)


# ---- the schema ---------------------------------------------------------------------------------


@cache
def schema_of(kind: type) -> dict[str, Any]:
    """Return the JSON schema of a file: every key with its kind, range, default and meaning."""
    with warnings.catch_warnings(action="ignore", category=PydanticJsonSchemaWarning):
        found = adapter_of(kind).json_schema()
    names = {one.__name__: _meanings(one) for one in _tables_in(kind)}
    tables = found.get("$defs", {})
    for name, table in tables.items():
        for key, entry in table.get("properties", {}).items():
            entry.pop("title", None)
            if meaning := names.get(name, {}).get(key):
                entry["description"] = meaning
    (root,) = found["prefixItems"]
    root = tables.pop(root["$ref"].rpartition("/")[2]) if "$ref" in root else root
    schema = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": schema, **root, "$defs": tables}


def _tables_in(kind: Any) -> Iterator[type]:
    if is_dataclass(kind):
        yield cast("type", kind)
        for hint in get_type_hints(kind).values():
            yield from _tables_in(hint)
    for part in get_args(kind):
        yield from _tables_in(part)


def _meanings(kind: type) -> dict[str, str]:
    """Return what stands below each attribute, by its key."""
    found: dict[str, str] = {}
    for base in (one for one in reversed(kind.__mro__) if is_dataclass(one)):
        (declared,) = ast.parse(dedent(inspect.getsource(base))).body
        for entry, text in pairwise(cast("ast.ClassDef", declared).body):
            if isinstance(entry, ast.AnnAssign) and isinstance(text, ast.Expr):
                alias = re.search(r"alias='(\w+)'", ast.unparse(entry.annotation))
                name = alias[1] if alias else cast("ast.Name", entry.target).id
                found[name] = " ".join(str(ast.literal_eval(text.value)).split())
    return found


def _node(schema: Any, loc: Sequence[int | str]) -> Any:
    """Return what a schema says of a place."""
    node = schema
    for part in (*loc, ""):
        node = next((one for one in node.get("anyOf", ()) if "$ref" in one), node)
        if "$ref" in node:
            about = {key: node[key] for key in ("description",) if key in node}
            node = schema["$defs"][node["$ref"].rpartition("/")[2]] | about
        if part != "":
            inside: Any = node.get("additionalProperties") or node.get("items") or {}
            node = node.get("properties", {}).get(part, inside)
    return node
