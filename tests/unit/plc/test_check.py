"""Every rule of the tree is checked, and what breaks it is said in words."""

import math
from dataclasses import replace
from random import Random
from typing import Any

import pytest

from tests.refusals import refused
from tests.unit.plc.small_programs import (
    LENGTH,
    count,
    let,
    number,
    small,
    truth,
    two,
    unused,
    when,
)
from thermaxis.errors import ThermaxisError
from thermaxis.plc import Block, Program, ProgramError, check_program, print_c, print_scl, print_st
from thermaxis.plc.tree import (
    LONGEST_ARRAY,
    LONGEST_NAME,
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
    Truth,
    Two,
    Variable,
)


def inner() -> Block:
    return Block(
        name="tx_inner",
        inputs=(number("u"), truth("go")),
        outputs=(number("y"), count("n")),
        body=(let("y", "u"), let("n", 7)),
    )


def program(*body: Any, **parts: Any) -> Program:
    """A program with variables of every kind whose main block does what is given."""
    sections: dict[str, Any] = {
        "inputs": (number("u"), truth("go"), count("k")),
        "outputs": (number("y"),),
        "states": (number("x"), truth("was"), count("i"), number("ring", length=LENGTH)),
        "temporaries": (number("t"), truth("b"), count("j")),
        "constants": (number("a", 0.5), number("zero"), count("last", LENGTH - 1)),
        "instances": (Instance("one", "tx_inner"),),
        "body": (*body, let("y", "u")),
        **parts,
    }
    main = Block(name="tx_main", **sections)
    return Program(name="tx_main", double=True, blocks=(inner(), main))


def broken(code: str, *body: Any, **parts: Any) -> ThermaxisError:
    wrong = program(*body, **parts)
    with refused(code) as caught:
        check_program(wrong)
    return caught.value


def taken(*body: Any, **parts: Any) -> None:
    check_program(program(*body, **parts))


CALL = Call("one", (("u", Name("u")), ("go", Truth(value=True))))


# ---- the whole ----------------------------------------------------------------------------------


@pytest.mark.parametrize("double", [True, False])
def test_a_program_that_keeps_every_rule_is_taken(double: bool) -> None:
    check_program(small(double=double))
    assert unused(small(double=double)) == ()
    taken()


def test_every_printer_checks_first() -> None:
    for printer in [print_st, print_scl, print_c]:
        with refused("undeclared"):
            printer(program(let("t", "nobody")))


# ---- names and texts ----------------------------------------------------------------------------


def test_a_name_that_some_target_refuses_is_refused() -> None:
    for name in [
        "",
        "Upper",
        "1st",
        "_a",
        "a_",
        "a__b",
        "a-b",
        "x" * (LONGEST_NAME + 1),
        "if",
        "step",
        "real",
        "double",
        "tx_own",
        "ü",
    ]:
        broken("name_illegal", temporaries=(number(name),))
        broken("name_illegal", instances=(Instance(name, "tx_inner"),))


def test_the_name_of_a_block_is_none_that_c_needs() -> None:
    for name in ["tx_number", "tx_step", "tx_init", "tx_main_step", "tx_main_init"]:
        whole = program()
        with refused("block_name_taken_in_c"):
            check_program(replace(whole, blocks=(*whole.blocks, replace(inner(), name=name))))


def test_remarks_have_no_sign_that_could_end_them() -> None:
    for text in ["*)", "(* nested", "/* c", "a\nb", "50 µm", "'", "{", "#", '"', ";"]:
        broken("remark_signs", Remark(text))
        broken("remark_signs", temporaries=(Variable("v", Kind.NUMBER, text),))
        broken("remark_signs", remarks=(text,))
        with refused("remark_signs"):
            check_program(replace(program(), head=(text,)))


# ---- variables ----------------------------------------------------------------------------------


def test_a_number_that_the_target_cannot_keep_is_refused_with_its_name() -> None:
    constants = (number("tiny", 1e-300),)
    taken(constants=constants)
    with refused("too_small_for_plc"):
        check_program(replace(program(constants=constants), double=False))


# ---- kinds and operations -----------------------------------------------------------------------


def test_kinds_are_never_mixed() -> None:
    for statement in [
        let("x", "go"),
        let("x", "k"),
        let("x", 1),
        let("x", True),
        let("was", "u"),
        let("was", 0),
        let("i", "u"),
        let("x", two("u", "+", "k")),
        let("x", two("go", "+", "go")),
        let("was", two("u", "AND", "go")),
        let("was", two("k", "OR", "k")),
        let("was", two("go", "<", "go")),
        let("was", two("go", "=", "was")),
        let("was", two("u", "<", "k")),
        let("was", two("u", "<", 1)),
        let("was", Not(Name("u"))),
        let("x", Minus(Name("go"))),
        let("i", Minus(Name("k"))),
        let("i", two("k", "/", "last")),
        let("i", 32768),
        let("i", -32769),
        when("u", let("x", "u")),
        when(two("k", "+", 1), let("x", "u")),
    ]:
        with pytest.raises(ProgramError):
            check_program(program(statement))


def test_a_number_is_computed_alone() -> None:
    for statement in [
        let("x", two("u", "*", two("u", "+", "x"))),
        let("x", two(two("u", "*", "x"), "+", "x")),
        let("was", two(two("u", "-", "x"), ">", "a")),
        when(two("a", "<", two("u", "+", "x")), let("x", "u")),
        let("was", two("go", "AND", two(two("u", "*", "a"), "<", "x"))),
        let(Element("ring", "i"), two(two("u", "*", "a"), "+", "x")),
    ]:
        with pytest.raises(ProgramError) as caught:
            check_program(program(statement))
        assert caught.value.code in {"two_computations", "computation_not_alone"}


def test_only_a_constant_that_is_not_zero_divides() -> None:
    for divisor in ["zero", "u", "x", Minus(Name("a"))]:
        broken("divisor_not_constant", let("x", two("u", "/", divisor)))
        taken(let("x", two("u", "/", "a")))


def test_every_other_refusal_is_reached_by_its_mistake() -> None:
    """Each guards a program that goes into a machine against a mistake of what makes it."""
    u, go, array = ("u", Name("u")), ("go", Name("go")), number("other", length=3)
    for code, body, parts in [
        ("stated_twice", (), {"temporaries": (number("u"),)}),
        ("stated_twice", (), {"instances": (Instance("one", "tx_inner"),) * 2}),
        ("wrong_start", (), {"temporaries": (Variable("v", Kind.BOOL, "v", 1),)}),
        ("wrong_start", (), {"temporaries": (Variable("v", Kind.INT, "v", 32768),)}),
        ("wrong_start", (), {"temporaries": (Variable("v", Kind.NUMBER, "v", math.nan),)}),
        ("array_no_state", (), {"inputs": (array,)}),
        ("array_with_start", (), {"states": (number("other", 1.0, length=3),)}),
        ("outside_count", (), {"states": (number("other", length=LONGEST_ARRAY + 1),)}),
        ("block_without_output", (), {"outputs": (), "body": ()}),
        ("instance_of_later_block", (), {"instances": (Instance("one", "tx_main"),)}),
        ("unknown_instance", (Call("two", (u, go)),), {}),
        ("call_inputs_differ", (Call("one", (u,)),), {}),
        ("call_inputs_differ", (Call("one", (go, u)),), {}),
        ("wrong_kind", (Call("one", (("u", Name("go")), go)),), {}),
        ("call_input_computed", (Call("one", (u, ("go", Not(Name("go"))))),), {}),
        ("unknown_instance", (let("x", OutputOf("two", "y")),), {}),
        ("unknown_output", (let("x", OutputOf("one", "u")),), {}),
        ("computed_number_compared", (let("was", two(Minus(Name("u")), "=", "x")),), {}),
        ("written_though_constant", (let("u", "x"),), {}),
        ("written_though_constant", (let("a", "x"),), {}),
        ("array_without_index", (let("x", "ring"),), {}),
        ("array_without_index", (let("ring", "x"),), {}),
        ("index_without_array", (let("x", Element("u", "i")),), {}),
        ("wrong_kind", (let("x", Element("ring", "u")),), {}),
        ("if_without_branch", (If(()),), {}),
        ("branch_empty", (when("go", Remark("later")),), {}),
    ]:
        broken(code, *body, **parts)
    whole, main = program(CALL), program().blocks[1]
    taken(CALL, let("was", two(two("u", "<", Minus(Name("a"))), "OR", Not(two("x", "=", "u")))))
    for code, wrong in [
        ("stated_twice", replace(whole, blocks=(inner(), *whole.blocks))),
        ("instance_of_later_block", replace(whole, blocks=whole.blocks[::-1])),
        ("last_block_not_main", replace(whole, name="tx_inner")),
        ("last_block_not_main", replace(whole, blocks=())),
        ("block_name_illegal", replace(whole, blocks=(replace(main, name="main", instances=()),))),
    ]:
        with refused(code):
            check_program(wrong)
    error = broken("undeclared", let("t", "u"), when("go", let("x", "u"), let("t", "lost")))
    assert error.place.key == "block tx_main, statement 2, branch 1, statement 2"


# ---- written before read ------------------------------------------------------------------------


def test_a_temporary_is_written_before_it_is_read_on_every_path() -> None:
    broken("read_before_written", let("x", "t"))
    broken("read_before_written", let("x", two("a", "*", "t")), let("t", "u"))
    broken("read_before_written", when("b", let("x", "u")))
    broken("read_before_written", let("was", two("go", "OR", Not(Name("b")))))
    broken("read_before_written", let("x", Element("ring", "j")))
    broken("read_before_written", let(Element("ring", "j"), "u"))
    broken("read_before_written", Call("one", (("u", Name("t")), ("go", Name("go")))))
    broken("read_before_written", when("go", let("t", "u")), let("x", "t"))
    broken(
        "read_before_written",
        If(((Name("go"), (let("t", "u"),)), (Name("was"), (let("t", "u"),)))),
        let("x", "t"),
    )
    broken(
        "read_before_written",
        If(((Name("go"), (let("t", "u"),)),), (let("b", True),)),
        let("x", "t"),
    )
    taken(If(((Name("go"), (let("t", "u"),)),), (let("t", "a"),)), let("x", "t"))
    taken(when("go", let("t", "u"), let("x", "t")))


def test_an_output_is_written_on_every_path_and_not_read_before() -> None:
    broken("output_not_written", body=())
    broken("output_not_written", body=(when("go", let("y", "u")),))
    broken("read_before_written", let("x", "y"))
    taken(body=(If(((Name("go"), (let("y", "u"),)),), (let("y", "x"),)), let("x", "y")))


# ---- whole numbers and indices ------------------------------------------------------------------


def turn(limit: Any, *, sign: str = ">=") -> tuple[Any, ...]:
    """Count a place on and set it back."""
    return (
        let(Element("ring", "i"), "u"),
        let("i", two("i", "+", 1)),
        when(two("i", sign, limit), let("i", 0)),
    )


def test_an_index_that_is_set_back_in_time_is_taken() -> None:
    taken(*turn(LENGTH))
    taken(*turn("last", sign=">"))
    taken(*turn(LENGTH - 2))
    taken(
        If(
            ((two("i", "<", "last"), (let("i", two("i", "+", 1)),)),),
            (let("i", 0),),
        ),
        let("x", Element("ring", "i")),
    )
    taken(
        when(
            two(two("k", ">=", 0), "AND", two("k", "<", LENGTH)),
            let("x", Element("ring", "k")),
        )
    )
    taken(
        If(
            ((two(two("k", "<", 0), "OR", two("k", ">", "last")), (let("x", "u"),)),),
            (let("x", Element("ring", "k")),),
        )
    )
    taken(when(Not(two(two("k", "<", 0), "OR", two(4, "<", "k"))), let("x", Element("ring", "k"))))
    taken(when(two("k", "=", 3), let("x", Element("ring", "k"))))
    taken(let("x", Element("ring", "last")))
    for low, high in (
        (two("k", ">", -1), two(LENGTH, ">", "k")),
        (two(-1, "<", "k"), two("last", ">=", "k")),
        (two(0, "<=", "k"), two("k", "<=", "last")),
    ):
        taken(when(two(low, "AND", high), let("x", Element("ring", "k"))))


def test_an_index_that_may_leave_its_array_is_refused() -> None:
    broken("index_outside_array", *turn(LENGTH + 1))
    broken("index_outside_array", *turn(LENGTH, sign=">"))
    broken("index_outside_array", let("x", Element("ring", "k")))
    broken("index_outside_array", when(two("k", "<", 5), let("x", Element("ring", "k"))))
    broken(
        "index_outside_array",
        when(two(two("k", ">=", 0), "OR", two("k", "<", 5)), let("x", Element("ring", "k"))),
    )
    broken(
        "index_outside_array",
        let("i", -1),
        let("x", Element("ring", "i")),
    )
    broken("index_outside_array", states=(count("i", 5), number("ring", length=5)),
            body=(let("y", Element("ring", "i")),))  # fmt: skip


def test_a_condition_beside_an_element_does_not_guard_it_because_both_sides_are_evaluated() -> None:
    inside = two(two("k", ">=", 0), "AND", two("k", "<", LENGTH))
    broken(
        "index_outside_array",
        let("was", two(inside, "AND", two(Element("ring", "k"), ">", "a"))),
    )


def test_a_count_that_is_held_or_set_back_is_taken_and_one_that_grows_is_refused() -> None:
    taken(when(two("i", "<", 32767), let("i", two("i", "+", 1))))
    taken(If(((two("i", ">=", 32767), (let("i", 0),)),), (let("i", two("i", "+", 1)),)))
    broken("whole_number_overflow", let("i", two("i", "+", 1)))
    broken("whole_number_overflow", let("i", two("i", "-", 1)))
    broken("whole_number_overflow", let("i", two("k", "+", 1)))
    broken("whole_number_overflow", let("i", two("k", "*", -2)))
    broken("whole_number_overflow", when(two(two("k", "+", 1), ">", 3), let("x", "u")))


def test_a_branch_that_cannot_be_reached_harms_nothing() -> None:
    taken(when(two(1, ">", 2), let("x", Element("ring", "k"))))
    taken(when(Truth(value=False), let("x", Element("ring", "k"))))


def whole_numbers(random: Random) -> tuple[Any, ...]:
    """Statements on whole numbers and an array, right or wrong."""

    def term_of() -> Any:
        return random.choice(("i", "k", "last", random.randint(-3, 8)))

    def condition() -> Any:
        compared = two(term_of(), random.choice(("<", "<=", ">", ">=", "=")), term_of())
        kind = random.random()
        if kind < 0.5:
            return compared
        return (
            Not(compared)
            if kind < 0.65
            else two(compared, random.choice(("AND", "OR")), condition())
        )

    def statement(depth: int) -> Any:
        kind = random.random()
        if kind < 0.3 and depth < 3:
            branches = tuple((condition(), body(depth + 1)) for _ in range(random.randint(1, 2)))
            return If(branches, body(depth + 1) if random.random() < 0.5 else ())
        if kind < 0.6:
            return let("i", two(term_of(), random.choice(("+", "-", "*")), term_of()))
        if kind < 0.8:
            return let("i", term_of())
        return let(Element("ring", random.choice(("i", "last"))), "u")

    def body(depth: int) -> tuple[Any, ...]:
        return tuple(statement(depth) for _ in range(random.randint(1, 3)))

    return body(0)


def carried_out(statements: tuple[Any, ...], values: dict[str, int]) -> None:
    """Carry out statements on whole numbers; what leaves its range fails."""

    def of(expression: Any) -> int:
        match expression:
            case Count(value):
                return value
            case Name(name):
                return values[name]
            case Not(inside):
                return not of(inside)
            case _:
                pass
        a, b = of(expression.left), of(expression.right)
        got = {
            "+": a + b, "-": a - b, "*": a * b, "<": a < b, "<=": a <= b, ">": a > b, ">=": a >= b,
            "=": a == b, "AND": a and b, "OR": a or b,
        }[expression.operation.value]  # fmt: skip
        assert -32768 <= got <= 32767
        return got

    for statement in statements:
        if isinstance(statement, If):
            chosen = [body for condition, body in statement.branches if of(condition)]
            carried_out(chosen[0] if chosen else statement.otherwise, values)
        elif isinstance(statement.target, Element):
            assert 0 <= values[statement.target.index] < LENGTH
        else:
            values[statement.target.name] = of(statement.value)


def test_what_is_taken_never_overflows_and_never_leaves_an_array() -> None:
    random = Random(8)  # noqa: S311 - programs for a test
    accepted = reached = 0
    for _ in range(1500):
        statements = whole_numbers(random)
        try:
            check_program(program(*statements))
        except ProgramError:
            continue
        accepted += 1
        values = {"i": 0, "last": LENGTH - 1}
        seen: set[int] = set()
        for _ in range(40):
            values["k"] = random.choice((-32768, 32767, 0, random.randint(-9, 9)))
            carried_out(statements, values)
            seen.add(values["i"])
        reached += len(seen) > 2
    assert accepted > 150
    assert reached > 25


# ---- what is never used -------------------------------------------------------------------------


def test_what_is_never_used_is_listed() -> None:
    whole = program(let("was", True), let("t", "a"))
    whole = replace(whole, blocks=(replace(inner(), name="tx_spare"), *whole.blocks))
    names = ("x", "was", "i", "ring", "t", "b", "j", "zero", "last", "one")
    assert set(unused(whole)) == {"tx_spare", *(f"tx_main.{name}" for name in names)}


def test_a_condition_that_nests_deeply_is_checked_in_a_moment() -> None:
    deep: Expression = Truth(value=True)
    for _ in range(200):
        deep = Two(deep, Operation.AND, Truth(value=True))
    block = Block(
        name="tx_deep",
        outputs=(Variable("done", Kind.BOOL, "Whether it is.", start=False),),
        body=(Assign(Name("done"), deep),),
    )
    check_program(Program(name="tx_deep", double=True, blocks=(block,)))
