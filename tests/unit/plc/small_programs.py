"""Small programs of the tree, made by hand, and what they compute, written without the tree."""

import struct
from collections.abc import Iterator
from random import Random
from typing import NamedTuple

from thermaxis.plc import Block, Program
from thermaxis.plc.tree import (
    Assign,
    Call,
    Count,
    Element,
    Expression,
    If,
    Instance,
    Kind,
    Minus,
    Name,
    Not,
    Operation,
    OutputOf,
    Remark,
    Statement,
    Truth,
    Two,
    Variable,
    names_read,
    reachable,
    walk,
)

ALPHA = 1.0 / 7.0
LARGEST_UM = 12.5
LENGTH = 5

_SIGNS = {operation.value: operation for operation in Operation}


def number(name: str, start: float = 0.0, text: str = "a number [um]", length: int = 0) -> Variable:
    return Variable(name, Kind.NUMBER, text, start, length)


def truth(name: str, *, start: bool = False) -> Variable:
    return Variable(name, Kind.BOOL, "a truth", start)


def count(name: str, start: int = 0) -> Variable:
    return Variable(name, Kind.INT, "a whole number [1]", start)


def term(of: Expression | str | int | bool) -> Expression:
    match of:
        case bool():
            return Truth(of)
        case int():
            return Count(of)
        case str():
            instance, point, output = of.partition(".")
            return OutputOf(instance, output) if point else Name(instance)
        case _:
            return of


def two(left: Expression | str | int, sign: str, right: Expression | str | int) -> Two:
    return Two(term(left), _SIGNS[sign], term(right))


def let(target: str | Element, value: Expression | str | int | bool) -> Assign:
    return Assign(Name(target) if isinstance(target, str) else target, term(value))


def when(condition: Expression | str, *body: Statement) -> If:
    return If(((term(condition), body),))


def lag(*, double: bool) -> Block:
    """One section, in REAL with the part that rounding takes."""
    more = [let("d", two("alpha", "*", "d"))]
    if double:
        more.append(let("x", two("x", "+", "d")))
    else:
        more += [
            let("d", two("d", "-", "c")),
            let("t", two("x", "+", "d")),
            let("c", two("t", "-", "x")),
            let("c", two("c", "-", "d")),
            let("x", "t"),
        ]
    return Block(
        name="tx_lag",
        remarks=("One section.",),
        inputs=(number("u"), truth("start")),
        outputs=(number("y"),),
        states=(number("x"), *(() if double else (number("c"),))),
        temporaries=(number("d"), *(() if double else (number("t"),))),
        constants=(
            number("alpha", ALPHA, "share of a cycle [1]"),
            *(() if double else (number("zero"),)),
        ),
        body=(
            If(
                ((term("start"), (let("x", "u"), *(() if double else (let("c", "zero"),)))),),
                (let("d", two("u", "-", "x")), *more),
            ),
            let("y", "x"),
        ),
    )


def small(*, double: bool = True) -> Program:
    """A delay, two lags in a row, a limit, a heartbeat and a word."""
    main = Block(
        name="tx_small",
        remarks=("Limits what two lags in a row make of a delayed input.",),
        inputs=(number("u_um"), truth("reset"), count("offset")),
        outputs=(
            number("y_um", 0.25),
            truth("at_limit", start=True),
            count("beat", -3),
            count("sum_word"),
        ),
        states=(number("ring", length=LENGTH), count("place"), truth("runs"), count("beats", -1)),
        temporaries=(number("past"), number("low"), truth("beyond")),
        constants=(
            number("largest_um", LARGEST_UM, "largest magnitude [um]"),
            number("half", 0.5, "a half [1]"),
            truth("yes", start=True),
            count("last", LENGTH - 1),
        ),
        instances=(Instance("one", "tx_lag"), Instance("other", "tx_lag")),
        body=(
            Remark("The oldest number is read, then written over."),
            let("past", "u_um"),
            when("runs", let("past", Element("ring", "place"))),
            let(Element("ring", "place"), "u_um"),
            If(
                ((two("place", ">=", "last"), (let("place", 0), let("runs", True))),),
                (let("place", two("place", "+", 1)),),
            ),
            Call("one", (("u", Name("past")), ("start", Name("reset")))),
            let("low", "one.y"),
            Call("other", (("u", Name("low")), ("start", Truth(value=False)))),
            let("y_um", "other.y"),
            let("low", Minus(Name("largest_um"))),
            let("beyond", two(two("y_um", "<", "low"), "OR", two("y_um", ">", "largest_um"))),
            let("at_limit", two("beyond", "AND", two(Not(Name("reset")), "AND", "yes"))),
            If(
                (
                    (two("y_um", ">", "largest_um"), (let("y_um", "largest_um"),)),
                    (two("y_um", "<", "low"), (let("y_um", "low"),)),
                    (term("reset"), (let("y_um", two("half", "/", "largest_um")),)),
                ),
            ),
            let("sum_word", 0),
            when("beyond", let("sum_word", two("sum_word", "+", 1))),
            when("reset", let("sum_word", two("sum_word", "+", 2))),
            when(two("offset", "=", -7), let("sum_word", two("sum_word", "+", 4))),
            If(
                ((two("beats", ">=", 3), (let("beats", 0),)),),
                (let("beats", two("beats", "+", 1)),),
            ),
            let("beat", two("beats", "+", 2)),
        ),
    )
    return Program(
        name="tx_small",
        double=double,
        head=("A program for tests: lengths in um, cycle 1 s.",),
        blocks=(lag(double=double), main),
    )


def unused(program: Program) -> tuple[str, ...]:
    """Return what is declared and never used: not wrong, but nothing that it should have."""
    found: list[str] = []
    for block in program.blocks:
        read = names_read(block)
        called = {s.instance for s, _ in walk(block.body, "") if isinstance(s, Call)}
        declared = (*block.states, *block.temporaries, *block.constants)
        found += [f"{block.name}.{v.name}" for v in declared if v.name not in read]
        found += [f"{block.name}.{i.name}" for i in block.instances if i.name not in called]
    needed = reachable(program)
    return (*found, *(b.name for b in program.blocks if b.name not in needed))


class Asked(NamedTuple):
    """Inputs of a call."""

    u_um: float
    reset: bool
    offset: int


class Said(NamedTuple):
    """Outputs of a call."""

    y_um: float
    at_limit: bool
    beat: int
    sum_word: int


def asked(calls: int, seed: int = 1) -> list[Asked]:
    """Return inputs that reach every branch."""
    random = Random(seed)  # noqa: S311 - numbers for a test
    level = 0.0
    rows: list[Asked] = []
    for _ in range(calls):
        level = 0.98 * level + random.gauss(0.0, 4.0)
        rows.append(Asked(level, random.random() < 0.05, random.choice((-7, 0, 12))))
    return rows


def said(rows: list[Asked], *, double: bool) -> Iterator[Said]:
    """Yield what the small program says, in plain Python."""

    def r(value: float) -> float:
        return value if double else struct.unpack("<f", struct.pack("<f", value))[0]

    ring: list[float] = []
    states, lost = [0.0, 0.0], [0.0, 0.0]
    alpha, largest, beats = r(ALPHA), r(LARGEST_UM), -1

    def section(k: int, u: float, *, start: bool) -> float:
        if start:
            states[k], lost[k] = u, 0.0
        elif double:
            states[k] += alpha * (u - states[k])
        else:
            step = r(r(alpha * r(u - states[k])) - lost[k])
            after = r(states[k] + step)
            lost[k] = r(r(after - states[k]) - step)
            states[k] = after
        return states[k]

    for row in rows:
        u = r(row.u_um)
        past = ring[-LENGTH] if len(ring) >= LENGTH else u
        ring.append(u)
        y = section(1, section(0, past, start=row.reset), start=False)
        far = abs(y) > largest
        limit = largest if y > 0 else -largest
        rest = r(0.5 / largest) if row.reset else y
        beats = 0 if beats >= 3 else beats + 1
        word = far + 2 * row.reset + 4 * (row.offset == -7)
        yield Said(limit if far else rest, far and not row.reset, beats + 2, word)
