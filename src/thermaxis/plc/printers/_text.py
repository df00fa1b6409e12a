"""What every dialect prints in the same way: expressions, lines, remarks."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import final

from thermaxis.codes import Place
from thermaxis.plc.tree import (
    Count,
    Element,
    Expression,
    Kind,
    Minus,
    Name,
    Not,
    Operation,
    OutputOf,
    Truth,
    Two,
    Variable,
    number_text,
)

LONGEST_LINE = 100
"""Longest line of a printed file. [1]"""
INDENT = "    "
"""One step of indentation."""
_CONTINUED = INDENT * 2


@final
@dataclass(frozen=True, slots=True)
class Wording:
    """How a dialect says what stands in an expression."""

    name: Callable[[str], str]
    """A variable of the block by its name."""
    output: Callable[[str, str], str]
    """An output of an instance."""
    signs: Mapping[Operation, str]
    """Signs of the operations."""
    negation: str
    """What stands before a BOOL for its opposite."""
    truths: tuple[str, str]
    """FALSE and TRUE."""


def expression_text(expression: Expression, wording: Wording) -> str:
    """Return an expression, every operation in parentheses."""
    match expression:
        case Name() | OutputOf() | Element():
            return _term_text(expression, wording)
        case Truth(value):
            return wording.truths[value]
        case Count(value):
            return f"({value})" if value < 0 else str(value)
        case Minus(of):
            return f"(-{expression_text(of, wording)})"
        case Not(of):
            return f"({wording.negation}{expression_text(of, wording)})"
        case Two(left, operation, right):
            a, b = expression_text(left, wording), expression_text(right, wording)
            return f"({a} {wording.signs[operation]} {b})"


def _term_text(term: Name | OutputOf | Element, wording: Wording) -> str:
    match term:
        case Name(name):
            return wording.name(name)
        case OutputOf(instance, output):
            return wording.output(instance, output)
        case Element(array, index):
            return f"{wording.name(array)}[{wording.name(index)}]"


def start_text(variable: Variable, *, double: bool, truths: tuple[str, str]) -> str:
    """Return the start of a variable, or the value of a constant, as a literal."""
    if variable.kind is Kind.BOOL:
        return truths[bool(variable.start)]
    if variable.kind is Kind.INT:
        return str(int(variable.start))
    return number_text(float(variable.start), double=double, place=Place(key=variable.name))


def broken(line: str) -> list[str]:
    """Return a line of a program as lines that are not too long, broken at spaces."""
    begin = line[: len(line) - len(line.lstrip())]
    lines: list[str] = []
    rest = line.rstrip()
    while len(rest) > LONGEST_LINE:
        least = len(rest) - len(rest.lstrip())
        cut = rest.rfind(" ", least, LONGEST_LINE + 1)
        if cut < 0:
            break
        lines.append(rest[:cut])
        rest = begin + _CONTINUED + rest[cut + 1 :]
    return [*lines, rest]


def remark_lines(text: str, begin: str, signs: tuple[str, str]) -> list[str]:
    """Return a remark as lines, each a remark of its own."""
    opening, closing = signs
    width = LONGEST_LINE - len(begin) - len(opening) - len(closing) - 2
    lines: list[str] = []
    rest = text.strip()
    while rest:
        piece = rest
        if len(rest) > width:
            cut = rest.rfind(" ", 0, width + 1)
            piece = rest[: cut if cut > 0 else width]
        lines.append(f"{begin}{opening} {piece.rstrip()} {closing}")
        rest = rest[len(piece) :].strip()
    return lines


def declared(line: str, text: str, signs: tuple[str, str]) -> list[str]:
    """Return a declaration with its remark: behind it, or above it where the line is too short."""
    opening, closing = signs
    whole = f"{line}  {opening} {text.strip()} {closing}"
    if text.strip() and len(whole) <= LONGEST_LINE:
        return [whole]
    begin = line[: len(line) - len(line.lstrip())]
    return [*remark_lines(text, begin, signs), *broken(line)]


def joined(lines: Iterable[str]) -> str:
    """Return lines as the text of a file."""
    return "\n".join(lines) + "\n"
