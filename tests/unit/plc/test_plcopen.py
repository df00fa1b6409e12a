"""PLCopen XML: a reader of its own puts the Structured Text back together, sign by sign."""

import pytest
from lxml import etree

from tests.unit.plc.plc_scenarios import random_settings
from tests.unit.plc.st_to_c import st_as_c
from tests.unit.plc.test_library import EVERY
from thermaxis.plc import Block, StFlavour, plcopen_xml, self_test_of

SPACES = {None: "http://www.plcopen.org/xml/tc6_0201", "x": "http://www.w3.org/1999/xhtml"}
SECTIONS = {
    "inputVars": "VAR_INPUT",
    "outputVars": "VAR_OUTPUT",
    "localVars": "VAR",
    "tempVars": "VAR_TEMP",
}


def text_of(file: str) -> str:
    """Return what a file says as Structured Text."""
    pous = etree.fromstring(file.encode()).findall("types/pous/pou", SPACES)
    return "".join(map(pou_text, pous))


def pou_text(pou: etree._Element) -> str:
    assert pou.get("pouType") == "functionBlock"
    (face,) = pou.findall("interface", SPACES)
    text = remarks(pou) or "\n"
    text += f"FUNCTION_BLOCK {pou.get('name')}\n{remarks(face)}"
    for section in face:
        kind = section.tag.partition("}")[2]
        if kind in SECTIONS:
            text += SECTIONS[kind] + " CONSTANT" * (section.get("constant") == "true") + "\n"
            text += "".join(map(declaration, section)) + "END_VAR\n"
    return text + str(pou.findtext("body/ST/x:xhtml", "", SPACES)) + "END_FUNCTION_BLOCK\n"


def remarks(element: etree._Element) -> str:
    text = element.findtext("documentation/x:xhtml", "", SPACES)
    return "".join(f"(* {line} *)\n" if line else "\n" for line in text.split("\n") if text)


def declaration(variable: etree._Element) -> str:
    (kind,) = variable.findall("type/*", SPACES)
    text = f"    {variable.get('name')} : "
    last = variable.find("type/array/dimension", SPACES)
    if last is not None:
        assert last.get("lower") == "0"
        text += f"ARRAY[0..{last.get('upper')}] OF "
        (kind,) = variable.findall("type/array/baseType/*", SPACES)
    text += kind.get("name") or kind.tag.partition("}")[2]
    start = variable.find("initialValue/simpleValue", SPACES)
    text += f" := {start.get('value')};" if start is not None else ";"
    remark = variable.findtext("documentation/x:xhtml", "", SPACES)
    line = f"{text}  (* {remark} *)\n" if remark else f"{text}\n"
    return line if len(line) <= 101 else f"    (* {remark} *)\n{text}\n"


@pytest.mark.parametrize("block", EVERY)
def test_a_reader_puts_the_text_back_together(block: Block) -> None:
    texts = block.st()
    back = text_of(plcopen_xml(texts.values(), block.name))
    assert back == "".join(texts.values())


def test_library_block_and_self_test_are_one_file_that_runs_as_the_texts_do() -> None:
    block = Block(settings=random_settings(3))
    texts = {**block.st(), **self_test_of(block).st()}
    file = plcopen_xml(texts.values(), block.name)
    assert st_as_c([text_of(file)], "t") == st_as_c(texts.values(), "t")
    assert file.count("<pou ") == 12
    flavours: tuple[StFlavour, ...] = ("twincat", "codesys")
    for flavour in flavours:
        other = plcopen_xml(texts.values(), block.name, flavour)
        assert other == file.replace("tc6_0201", "tc6_0200")
