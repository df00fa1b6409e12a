"""Structured Text and SCL as C, word by word, so that gcc runs what was printed.

It knows nothing of the tree: a word that is neither declared in the text nor one of the language
is an error, here or of gcc. Every variable lasts from call to call, as it does in a function block.
"""

import re
from typing import NamedTuple

from thermaxis.plc import CText

_TYPES = {"LREAL": "double", "REAL": "float", "BOOL": "bool", "INT": "int16_t"}
_WORDS = {
    "IF": "if (",
    "THEN": ") {",
    "ELSIF": "} else if (",
    "ELSE": "} else {",
    "END_IF": "}",
    "AND": "&",
    "OR": "|",
    "NOT": "!",
    "TRUE": "true",
    "FALSE": "false",
    ":=": "=",
    "=": "==",
}
_SAME = frozenset(["<", "<=", ">", ">=", "+", "-", "*", "/", "(", ")", "[", "]", ";", "."])
_CALL = ("STEP",)
_TOKEN = re.compile(r"\s*(:=|<=|>=|\d+|[A-Za-z]\w*|\S)")
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


class Declared(NamedTuple):
    """A variable or an instance of a block."""

    name: str
    kind: str
    """Type of C, or name of a block."""
    length: int
    start: str


def bare(text: str) -> str:
    """Take off remarks, and what only SCL has."""
    code = re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL)
    lines = _SCL_ONLY.sub("", code.replace('"', "").replace("#", "")).splitlines()
    return "".join(line.rstrip() + "\n" for line in lines if line.strip())


def st_as_c(text: str, name: str) -> CText:
    """Return a text as C with another name of its main block, and what the C is made of."""
    blocks = _BLOCK.findall(bare(text))
    names = {block: f"{name}_{block}" for block, _ in blocks} | {blocks[-1][0]: name}
    number = "double" if re.search(r"\bLREAL\b", text) else "float"
    once = f"TX_NUMBER_IS_{number.upper()}"
    header = ["#include <stdbool.h>", "#include <stdint.h>", f"#ifndef {once}", f"#define {once}"]
    header += [f"typedef {number} tx_number;", "#endif"]
    source = [f'#include "{name}.h"']
    for block, content in blocks:
        # In an order of its own: that of the declarations differs between dialects.
        declared = sorted(d for _, lines in _SECTION.findall(content) for d in _declared(lines))
        body = content[[*_SECTION.finditer(content)][-1].end() :]
        c_name = names[block]
        members = [
            f"  {names.get(d.kind, d.kind)} {d.name}{f'[{d.length}]' * bool(d.length)};"
            for d in declared
        ]
        header += [f"typedef struct {c_name} {{", *members, f"}} {c_name};"]
        source += [f"void {c_name}_init({c_name} *b);", f"void {c_name}_init({c_name} *b) {{"]
        source += [_begun(d, names) for d in declared if not d.length]
        source += ["}", f"void {c_name}_step({c_name} *b);", f"void {c_name}_step({c_name} *b) {{"]
        source += [_statements(body, declared, names), "}"]
    header += [f"void {name}_init({name} *b);", f"void {name}_step({name} *b);"]
    return CText("\n".join(header) + "\n", "\n".join(source) + "\n")


def _declared(lines: str) -> list[Declared]:
    made: list[Declared] = []
    for line in lines.splitlines():
        found = _DECLARED.fullmatch(line.strip())
        if found is None:
            raise ValueError(line)
        name, last, kind, start = found.groups(default="")
        # Constants of the old class of CPU have no type but that of their literal.
        kind = kind or ("BOOL" if start.isalpha() else "REAL" if "." in start else "INT")
        value = f"{start}f" if kind == "REAL" else start.lower() if kind == "BOOL" else start
        made.append(Declared(name, _TYPES.get(kind, kind), int(last or -1) + 1, value))
    return made


def _begun(declared: Declared, names: dict[str, str]) -> str:
    if declared.kind in names:
        return f"{names[declared.kind]}_init(&b->{declared.name});"
    return f"b->{declared.name} = {declared.start};"


def _statements(body: str, declared: list[Declared], names: dict[str, str]) -> str:
    kinds = {d.name: d.kind for d in declared}

    def called(call: re.Match[str]) -> str:
        instance, given = call.groups()
        values = given.split(",")
        return "".join(f"{instance}.{v.strip()}; " for v in values) + f"{_CALL[0]} {instance};"

    body = re.sub(r"^\s*(\w+)\(([^;]*:=[^;]*)\);", called, body, flags=re.MULTILINE)
    words: list[str] = []
    for token in _TOKEN.findall(body):
        before = words[-1] if words else ""
        if before in _CALL:
            words[-1] = f"{names[kinds[token]]}_step(&b->{token})"
        elif token in _WORDS:
            words.append(_WORDS[token])
        elif token in kinds and before != ".":
            words.append(f"b->{token}")
        elif token in _SAME or token.isdigit() or token in _CALL or before == ".":
            words.append(token)
        else:
            raise ValueError(token)
    return " ".join(words).replace(";", ";\n").replace("{", "{\n")
