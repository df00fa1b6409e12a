"""Names of inner blocks that belong to one export: a PLC has one block of a name.

Two exports in one project would otherwise give each other their models: the block that was
imported last would stand behind both, without a word.
"""

from dataclasses import replace
from hashlib import sha256

from thermaxis.plc.tree._check import BLOCK_PREFIX
from thermaxis.plc.tree._tree import LONGEST_NAME, Program

MARK_DIGITS = 4
"""Digits of the mark in a name: one of 65 536. [1]"""
_LONGEST_STEM = 4


def with_own_names(program: Program) -> Program:
    """Return a program whose inner blocks have names that only it has.

    A name is made of the begin of the program's own name, of a mark that follows from everything
    that the blocks compute, and of what the block is: ``tx_lath_3f2a_lag``.

    Parameters
    ----------
    program : Program
        The program, with the names of `build_program`.

    Returns
    -------
    Program
        The same with other names of its inner blocks.
    """
    content = f"{program.name} {program.double} {program.blocks!r}"
    mark = sha256(content.encode()).hexdigest()[:MARK_DIGITS]
    stem = program.name.removeprefix(BLOCK_PREFIX)[:_LONGEST_STEM].strip("_")
    own: dict[str, str] = {program.name: program.name}
    for block in program.blocks:
        short = block.name.removeprefix(BLOCK_PREFIX)
        own.setdefault(block.name, f"{BLOCK_PREFIX}{stem}_{mark}_{short}"[:LONGEST_NAME])
    blocks = tuple(
        replace(
            block,
            name=own[block.name],
            instances=tuple(replace(one, block=own[one.block]) for one in block.instances),
        )
        for block in program.blocks
    )
    return replace(program, blocks=blocks)
