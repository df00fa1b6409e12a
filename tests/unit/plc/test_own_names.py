"""Two exports in one project of a PLC do not give each other their blocks."""

from dataclasses import replace

import pytest

from tests.unit.plc.plc_scenarios import random_settings
from thermaxis.plc import (
    PlcSettings,
    build_program,
    check_program,
    print_scl,
    print_st,
    with_own_names,
)
from thermaxis.plc.tree import LONGEST_NAME, is_legal


def inner(settings: PlcSettings) -> set[str]:
    program = with_own_names(build_program(settings))
    return {block.name for block in program.blocks[:-1]}


@pytest.mark.parametrize("seed", range(4))
def test_a_program_with_own_names_keeps_every_rule_and_says_the_same(seed: int) -> None:
    program = build_program(random_settings(seed))
    own = with_own_names(program)
    check_program(own)
    assert own.blocks[-1].name == program.name
    names = [block.name for block in own.blocks]
    assert len(set(names)) == len(names)
    assert all(is_legal(name) and len(name) <= LONGEST_NAME for name in names)
    plain, renamed = print_st(program), print_st(own)
    for block, other in zip(program.blocks, own.blocks, strict=True):
        renamed = renamed.replace(other.name, block.name)
    assert renamed.split() == plain.split()


def test_other_models_limits_numbers_and_cycles_have_other_blocks() -> None:
    first = random_settings(3)
    others = [
        random_settings(5),
        random_settings(3, cycle_s=10.0),
        replace(first, double=not first.double),
    ]
    for other in others:
        same_name = replace(other, name=first.name)
        assert inner(first).isdisjoint(inner(same_name))


def test_every_block_of_a_text_is_one_of_its_own() -> None:
    own = with_own_names(build_program(random_settings(3)))
    text = print_scl(own, "s7-1500")
    assert '"tx_lag"' not in text
    assert all(f'"{block.name}"' in text for block in own.blocks)
