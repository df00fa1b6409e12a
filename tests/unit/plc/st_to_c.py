"""Structured Text and SCL as C, word by word, so that gcc runs what was exported.

It knows nothing of the exporter: a word that is neither declared in the text nor one of the
language is an error, here or of gcc. Every variable lasts from call to call, as it does in a
function block, but for those of VAR_TEMP: they begin every call with what nobody has written.
What stands outside an array is one element of its own behind it.
"""

import re
from collections.abc import Iterable
from typing import NamedTuple

_TYPES = {"LREAL": "double", "REAL": "float", "BOOL": "bool", "INT": "int16_t"}
_UNWRITTEN = {
    "double": "7.7e33",
    "float": "7.7e33f",
    "bool": "(tick_++ & 2) != 0",
    "int16_t": "21845",
}
_WORDS = {
    "IF": "if (",
    "THEN": ") {",
    "ELSIF": "} else if (",
    "ELSE": "} else {",
    "END_IF": "}",
    "WHILE": "while (",
    "DO": ") {",
    "END_FOR": "}",
    "END_WHILE": "}",
    "AND": "&",
    "OR": "|",
    "NOT": "!",
    "ABS": "fabs",
    "SQRT": "sqrt",
    "TRUE": "true",
    "FALSE": "false",
    ":=": "=",
    "=": "==",
}
_SAME = frozenset(["<", "<=", ">", ">=", "+", "-", "*", "/", "(", ")", "[", "]", ";", "."])
_CALL = ("STEP",)
_TOKEN = re.compile(r"\s*(:=|<=|>=|\d+\.\d+(?:E[-+]\d+)?|\d+|[A-Za-z]\w*|\S)")
_BLOCK = re.compile(r"^FUNCTION_BLOCK (\w+)\n(.*?)^END_FUNCTION_BLOCK$", re.MULTILINE | re.DOTALL)
_SECTION = re.compile(
    r"^(VAR\w*(?: CONSTANT)?|CONST)\n(.*?)^END_(?:VAR|CONST)$", re.MULTILINE | re.DOTALL
)
_DECLARED = re.compile(
    r"(\w+)(?: : (?:ARRAY\[0\.\.(\d+)\] OF )?(\w+))?(?: := (TRUE|FALSE|[-+.\dE]+))?;"
)
_SCL_ONLY = re.compile(
    r"^(?:\{ S7_Optimized_Access := 'TRUE' \}|VERSION : .*|TITLE = .*|BEGIN)$", re.MULTILINE
)


class CText(NamedTuple):
    """A header and a source."""

    header: str
    source: str


class Declared(NamedTuple):
    """A variable or an instance of a block."""

    name: str
    kind: str
    """Type of C, or name of a block."""
    length: int
    start: str
    temporary: bool


def bare(text: str) -> str:
    """Take off remarks, and what only SCL has."""
    code = re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL)
    lines = _SCL_ONLY.sub("", code.replace('"', "").replace("#", "")).splitlines()
    return "".join(line.rstrip() + "\n" for line in lines if line.strip())


def st_as_c(texts: Iterable[str], name: str, *, apart: bool = False) -> CText:
    """Return texts as one C, with another name of the last block.

    Names of all others, and also of the last one where they stand `apart`, begin with it.
    """
    text = "\n".join(texts)
    blocks = _BLOCK.findall(bare(text))
    names = {block: f"{name}_{block}" for block, _ in blocks}
    if not apart:
        names[blocks[-1][0]] = name
    number = "double" if re.search(r"\bLREAL\b", text) else "float"
    header = ["#pragma once", "#include <math.h>", "#include <stdbool.h>"]
    header += ["#include <stdint.h>"]
    header += ["#define at_(k, n) ((k) >= 0 && (k) < (n) ? (k) : (n))"]
    source = [f'#include "{name}.h"']
    for block, content in blocks:
        # In an order of its own: that of the declarations differs between dialects.
        declared = sorted(
            d for section, lines in _SECTION.findall(content) for d in _declared(section, lines)
        )
        body = content[[*_SECTION.finditer(content)][-1].end() :]
        c_name = names[block]
        lasting = [d for d in declared if not d.temporary]
        members = [
            f"  {names.get(d.kind, d.kind)} {d.name}{f'[{d.length + 1}]' * bool(d.length)};"
            for d in lasting
        ]
        header += [f"typedef struct {c_name} {{", *members, f"}} {c_name};"]
        header += [f"void {c_name}_init({c_name} *b);", f"void {c_name}_step({c_name} *b);"]
        source += [f"void {c_name}_init({c_name} *b) {{"]
        source += [_begun(d, names) for d in lasting if not d.length]
        source += ["}", f"void {c_name}_step({c_name} *b) {{"]
        source += ["static unsigned tick_; (void)tick_;"]
        source += [
            f"{d.kind} {d.name} = {_UNWRITTEN[d.kind]}; (void){d.name};"
            for d in declared
            if d.temporary
        ]
        source += [_statements(body, declared, names, number), "}"]
    return CText("\n".join(header) + "\n", "\n".join(source) + "\n")


def _declared(section: str, lines: str) -> list[Declared]:
    made: list[Declared] = []
    for line in lines.splitlines():
        found = _DECLARED.fullmatch(line.strip())
        if found is None:
            raise ValueError(line)
        name, last, kind, start = found.groups(default="")
        # Constants of the old class of CPU have no type but that of their literal.
        kind = kind or ("BOOL" if start.isalpha() else "REAL" if "." in start else "INT")
        value = f"{start}f" if kind == "REAL" else start.lower() if kind == "BOOL" else start
        length, temporary = int(last or -1) + 1, section == "VAR_TEMP"
        made.append(Declared(name, _TYPES.get(kind, kind), length, value, temporary))
    return made


def _begun(declared: Declared, names: dict[str, str]) -> str:
    if declared.kind in names:
        return f"{names[declared.kind]}_init(&b->{declared.name});"
    return f"b->{declared.name} = {declared.start};"


def _statements(body: str, declared: list[Declared], names: dict[str, str], number: str) -> str:
    kinds = {d.name: d.kind for d in declared}
    members = {d.name for d in declared if not d.temporary}
    lengths, length = {f"b->{d.name}": d.length for d in declared}, 0

    def called(call: re.Match[str]) -> str:
        instance, given = call.groups()
        values = given.split(",")
        return "".join(f"{instance}.{v.strip()}; " for v in values) + f"{_CALL[0]} {instance};"

    body = re.sub(r"^\s*(\w+)\(([^;]*:=[^;]*)\);", called, body, flags=re.MULTILINE)
    loop = r"\1 := \2 - 1; WHILE \1 < \3 DO \1 := \1 + 1;"
    body = re.sub(r"FOR (\w+) := (\d+) TO ([\w.]+) DO", loop, body)
    words: list[str] = []
    for token in _TOKEN.findall(body):
        before = words[-1] if words else ""
        if before in _CALL:
            words[-1] = f"{names[kinds[token]]}_step(&b->{token})"
        elif token in {"[", "]"}:
            length = lengths.get(before) or length
            words.append("[at_(" if "[" in token else f", {length})]")
        elif token in _WORDS:
            words.append(_WORDS[token])
        elif token in kinds and before != ".":
            words.append(f"b->{token}" if token in members else token)
        elif token in _SAME or token.isdigit() or token in _CALL or before == ".":
            words.append(token)
        elif token[0].isdigit():
            words.append(token + "f" * (number == "float"))
        else:
            raise ValueError(token)
    return " ".join(words).replace(";", ";\n").replace("{", "{\n")
