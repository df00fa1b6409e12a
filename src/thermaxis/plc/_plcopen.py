"""Structured Text as one PLCopen XML file: its declarations as elements, its statements as text."""

import re
from collections.abc import Iterable, Iterator
from typing import Any

from thermaxis import __version__
from thermaxis.plc._library import StFlavour
from thermaxis.plc._template import rendered

# From memory of their exports: both editors write version 2.00 of the schema.
_NAMESPACE = {"iec": "tc6_0201", "twincat": "tc6_0200", "codesys": "tc6_0200"}
_POU = re.compile(
    r"((?:(?!FUNCTION_BLOCK).*\n)*)FUNCTION_BLOCK (\w+)\n((?:\(\*.*\n)*)"
    r"((?:VAR(?:.*\n)*?END_VAR\n)*)((?:.*\n)*?)END_FUNCTION_BLOCK\n"
)
_SECTION = re.compile(r"VAR(\w*)( CONSTANT)?\n((?:.*\n)*?)END_VAR\n")
_VARIABLE = re.compile(
    r"    (?:\(\* (.*) \*\)\n    )?(\w+) : (?:ARRAY\[0\.\.(\d+)\] OF )?(\w+)(?: := (\S+))?;"
    r"(?:  \(\* (.*) \*\))?\n"
)
_ELEMENTS = {"_INPUT": "inputVars", "_OUTPUT": "outputVars", "": "localVars", "_TEMP": "tempVars"}


def plcopen_xml(texts: Iterable[str], name: str, flavour: StFlavour = "iec") -> str:
    """Return Structured Text as a PLCopen XML file, which an editor imports in one step.

    Not protected: no editor has imported one. The schema asks for a date, which is the same in
    every file, so that the same text gives the same bytes.

    Parameters
    ----------
    texts : iterable of str
        Texts that `Block.st` and `SelfTest.st` return, in their order.
    name : str
        Name of the project.
    flavour : {'iec', 'twincat', 'codesys'}
        Who reads it: the last two get the namespace of version 2.00, which they write themselves.
        Default: version 2.01.

    References
    ----------
    PLCopen, technical committee 6: XML formats for IEC 61131-3, version 2.01.
    """
    values = {
        "name": name,
        "version": __version__,
        "namespace": _NAMESPACE[flavour],
        "pous": list(_pous("".join(texts))),
    }
    return rendered("plcopen.xml.j2", values)


def _pous(text: str) -> Iterator[dict[str, Any]]:
    for head, name, remark, sections, body in _POU.findall(text):
        yield {
            "name": name,
            "head": _bare(head),
            "remark": _bare(remark),
            "sections": [
                {
                    "element": _ELEMENTS[kind],
                    "constant": bool(constant),
                    "variables": _VARIABLE.findall(lines),
                }
                for kind, constant, lines in _SECTION.findall(sections)
            ],
            "body": body,
        }


def _bare(remarks: str) -> str:
    """Return remarks without their signs, line by line."""
    return "\n".join(line.removeprefix("(* ").removesuffix(" *)") for line in remarks.splitlines())
