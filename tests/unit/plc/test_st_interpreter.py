"""The interpreter of the tests: known answers for every construct, every error it must find."""

import math
import struct
from fractions import Fraction

import numpy as np
import pytest

from tests.unit.plc.st_interpreter import (
    Machine,
    StRunError,
    first_difference,
    parse_with_blark,
    same,
)
from tests.unit.plc.st_program import Value, binary32, read_program
from tests.unit.plc.st_syntax import StError

HEAD = """(* a block *)
FUNCTION_BLOCK tx_main
VAR_INPUT
  a : LREAL := 0.0;
  b : LREAL := 0.0;
  p : BOOL := FALSE;
  q : BOOL := FALSE;
  n : INT := 0;
END_VAR
VAR_OUTPUT
  y : LREAL := 0.0;
  z : BOOL := FALSE;
  m : INT := 0;
END_VAR
VAR
  x : LREAL := 2.5;
  row : ARRAY[0..2] OF LREAL;
  lag : tx_lag;
  lag_2 : tx_lag;
END_VAR
VAR_TEMP
  d : LREAL;
END_VAR
VAR CONSTANT
  k : LREAL := -1.0E-06;
  half : LREAL := 0.5;
END_VAR
"""
LAG = """FUNCTION_BLOCK tx_lag
VAR_INPUT
  u : LREAL := 7.0;
  hold : BOOL := FALSE;
END_VAR
VAR_OUTPUT
  x : LREAL := 1.0;
END_VAR
VAR
  secret : LREAL := 0.0;
END_VAR
VAR_TEMP
  d : LREAL;
END_VAR
VAR CONSTANT
  alpha : LREAL := 0.25;
END_VAR
  IF NOT hold THEN
    d := u - x;
    d := alpha * d;
    x := x + d;
  END_IF;
END_FUNCTION_BLOCK
"""
NAN, INF = math.nan, math.inf


def text(body: str, head: str = HEAD) -> str:
    return f"{LAG}{head}{body}\nEND_FUNCTION_BLOCK\n"


def ran(body: str, **inputs: Value) -> dict[str, Value]:
    given: dict[str, Value] = {"a": 0.0, "b": 0.0, "p": False, "q": False, "n": 0}
    return Machine(text(body)).start().call(**(given | inputs))


def refused(source: str) -> StError:
    with pytest.raises(StError) as caught:
        read_program(source)
    return caught.value


# ---- what it computes ---------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["LREAL", "REAL"])
def test_a_comparison_with_nan_is_false_except_that_it_differs(kind: str) -> None:
    for sign in ["<", "<=", ">", ">=", "=", "<>"]:
        machine = Machine(text(f"z := a {sign} a;").replace("LREAL", kind))
        assert machine.start().step([NAN, 0.0, False, False, 0])[1] is (sign == "<>")


def test_the_safe_question_for_finite_numbers_finds_nan_and_the_other_does_not() -> None:
    safe, unsafe = "z := NOT ((a >= k) AND (a <= half));", "z := (a < k) OR (a > half);"
    assert (ran(safe, a=NAN)["z"], ran(unsafe, a=NAN)["z"]) == (True, False)
    assert [ran(safe, a=x)["z"] for x in (0.25, INF, -INF, 0.75)] == [False, True, True, True]


@pytest.mark.parametrize(("n", "expected"), [(0, 10), (1, 11), (2, 12), (3, 13)])
def test_the_first_branch_whose_condition_holds_is_taken(n: int, expected: int) -> None:
    body = """
    IF n = 0 THEN m := 10;
    ELSIF n <= 1 THEN m := 11;
    ELSIF (n <= 2) THEN IF TRUE THEN m := 12; END_IF;
    ELSE m := 13;
    END_IF;"""
    assert ran(body, n=n)["m"] == expected


def test_an_empty_branch_is_one_semicolon() -> None:
    assert ran("IF p THEN ; ELSE m := 1; END_IF;", p=True)["m"] == 0
    assert ran("IF p THEN m := 1; ELSE ; END_IF;", p=True)["m"] == 1


def test_variables_last_from_call_to_call_and_start_once() -> None:
    execution = Machine(text("x := x + half; y := x; m := m + 1;")).start()
    assert execution.first == (0.0, False, 0)
    rows = execution.run([[0.0, 0.0, False, False, 0]] * 3)
    assert rows == [(3.0, False, 1), (3.5, False, 2), (4.0, False, 3)]
    assert execution.value("x") == 4.0


def test_every_instance_has_its_own_state() -> None:
    execution = Machine(
        text("y := lag.x; lag(u := a, hold := p); lag_2(u := b, hold := p); x := lag_2.x;")
    ).start()
    first = execution.call(a=5.0, b=-3.0, p=False, q=False, n=0)
    assert first["y"] == 1.0  # what it says before its first call
    assert (execution.value("lag.x"), execution.value("lag_2.x")) == (2.0, 0.0)
    execution.call(a=5.0, b=-3.0, p=False, q=False, n=0)
    assert (execution.value("lag.x"), execution.value("x")) == (2.75, -0.75)
    execution.call(a=9.0, b=9.0, p=True, q=False, n=0)
    assert execution.value("lag.x") == 2.75


def test_an_input_that_is_not_named_keeps_its_value() -> None:
    execution = Machine(text("IF p THEN lag(u := a); ELSE lag(hold := q); END_IF;")).start()
    execution.call(a=0.0, b=0.0, p=False, q=False, n=0)
    assert execution.value("lag.x") == 1.0 + 0.25 * (7.0 - 1.0)  # its initial value
    execution.call(a=4.0, b=0.0, p=True, q=False, n=0)
    before = execution.value("lag.x")
    execution.call(a=0.0, b=0.0, p=False, q=False, n=0)
    assert execution.value("lag.x") == before + 0.25 * (4.0 - before)


def test_another_block_than_the_last_one_can_be_run() -> None:
    machine = Machine(text("y := a;"), block="tx_lag")
    assert (machine.inputs, machine.outputs) == (("u", "hold"), ("x",))
    assert machine.start().step([5.0, False]) == (2.0,)
    with pytest.raises(StError, match="no block tx_none"):
        Machine(text("y := a;"), block="tx_none")


def whole_number(rng: np.random.Generator, depth: int) -> tuple[str, str]:
    """A random expression of INT: in Structured Text, and in Python."""
    if depth == 0 or rng.random() < 0.3:
        leaf = str(rng.choice(["n", "0", "1", "7", "(-3)"]))
        return leaf, leaf
    (a, x), (b, y) = whole_number(rng, depth - 1), whole_number(rng, depth - 1)
    sign = str(rng.choice(["+", "-", "*"]))
    return f"({a} {sign} {b})", f"({x} {sign} {y})"


def truth(rng: np.random.Generator, depth: int) -> tuple[str, str]:
    """A random expression of BOOL: in Structured Text, and in Python."""
    if depth == 0 or rng.random() < 0.2:
        leaf = str(rng.choice(["p", "q", "TRUE", "FALSE"]))
        return leaf, leaf.title() if leaf.isupper() else leaf
    if rng.random() < 0.4:
        sign = str(rng.choice(["<", "<=", ">", ">=", "=", "<>"]))
        other = {"=": "==", "<>": "!="}.get(sign, sign)
        if rng.random() < 0.5:
            (a, x), (b, y) = whole_number(rng, 2), whole_number(rng, 2)
            return f"({a} {sign} {b})", f"({x} {other} {y})"
        c, d = (str(rng.choice(["a", "b", "(-a)"])) for _ in range(2))
        return f"({c} {sign} {d})", f"({c} {other} {d})"
    (a, x), (b, y) = truth(rng, depth - 1), truth(rng, depth - 1)
    if rng.random() < 0.3:
        return f"(NOT {a})", f"(not {x})"
    word = str(rng.choice(["AND", "OR"]))
    return f"({a} {word} {b})", f"({x} {word.lower()} {y})"


@pytest.mark.parametrize("kind", ["LREAL", "REAL"])
def test_random_expressions_are_worth_what_python_says(kind: str) -> None:
    rng = np.random.default_rng(11)
    seen: set[bool] = set()
    for _ in range(60):
        (bool_text, bool_python), (int_text, int_python) = truth(rng, 5), whole_number(rng, 3)
        source = text(f"z := {bool_text};\nm := {int_text};").replace("LREAL", kind)
        execution = Machine(source).start()
        for _ in range(5):
            row = [
                float(rng.choice([-1.5, 0.0, 1.5, NAN, INF])),
                float(rng.choice([-1.5, 0.0, 1.5])),
                bool(rng.random() < 0.5),
                bool(rng.random() < 0.5),
                int(rng.integers(-3, 4)),
            ]
            known = dict(zip("abpqn", row, strict=True))
            _, z, m = execution.step(row)
            assert z is eval(bool_python, {}, known), bool_text  # noqa: S307 - made above
            assert m == eval(int_python, {}, known), int_text  # noqa: S307 - made above
            seen.add(bool(z))
    assert seen == {True, False}


# ---- the arithmetic of REAL ---------------------------------------------------------------------


def nearest(value: Fraction) -> float:
    """The binary32 nearest to a number, by its definition: the second way of every test below."""
    if value == 0:
        return 0.0
    exponent = math.floor(math.log2(abs(value)))
    while Fraction(2) ** exponent > abs(value):
        exponent -= 1
    while Fraction(2) ** (exponent + 1) <= abs(value):
        exponent += 1
    unit = Fraction(2) ** (max(exponent, -126) - 23)
    return float(round(value / unit) * unit)  # round() of a Fraction takes the even one


def test_real_is_rounded_after_every_operation() -> None:
    rng = np.random.default_rng(8)
    bodies = {"+": "y := a + b;", "-": "y := a - b;", "*": "y := a * b;", "/": "y := a / b;"}
    runs = {s: Machine(text(b).replace("LREAL", "REAL")).start() for s, b in bodies.items()}
    for _ in range(300):
        a, b = (rng.uniform(-1, 1) * 10.0 ** int(rng.integers(-19, 18)) for _ in range(2))
        x, y = nearest(Fraction(a)), nearest(Fraction(b))
        exact = {
            "+": Fraction(x) + Fraction(y),
            "-": Fraction(x) - Fraction(y),
            "*": Fraction(x) * Fraction(y),
            "/": Fraction(x) / Fraction(y),
        }
        for sign, value in exact.items():
            if abs(value) < 3e38:
                got = runs[sign].step([a, b, False, False, 0])[0]
                assert got == nearest(value), (sign, a, b)
                assert type(got) is float


def test_inputs_of_real_are_rounded_as_they_come_even_beyond_its_range() -> None:
    run = Machine(text("y := a; z := a > b;").replace("LREAL", "REAL")).start()
    assert run.step([0.1, 0.0, False, False, 0])[0] == struct.unpack("f", struct.pack("f", 0.1))[0]
    assert run.step([1e300, 3e38, False, False, 0])[:2] == (INF, True)
    assert math.isnan(run.step([NAN, 0.0, False, False, 0])[0])


def test_a_literal_is_rounded_once_and_the_tie_goes_to_the_even_one() -> None:
    assert binary32("16777217.0") == 16777216.0
    assert binary32("16777219.0") == 16777220.0
    # Just above a tie: rounding to double first would give the tie, and then the lower one.
    assert binary32("16777217.0000000001") == 16777218.0
    assert float(np.float32(float("16777217.0000000001"))) == 16777216.0
    assert binary32("1.0E-45") == 2.0**-149
    assert binary32("3.5E+38") == INF
    assert binary32("-3.4028236E+38") == -INF
    assert binary32("-3.4028235E+38") == -float(np.finfo(np.float32).max)


def test_nine_digits_bring_every_real_back() -> None:
    rng = np.random.default_rng(4)
    for bits in rng.integers(1, 0x7F7FFFFF, 300, dtype=np.uint32):
        value = float(bits.view(np.float32))
        assert binary32(f"{value:.8e}") == value == nearest(Fraction(value))


def test_constants_and_initial_values_of_real_are_rounded() -> None:
    head = HEAD.replace("half : LREAL := 0.5", "half : LREAL := 0.1").replace("2.5", "0.3")
    source = text("y := x - half;", head).replace("LREAL", "REAL")
    expected = nearest(Fraction(nearest(Fraction("0.3"))) - Fraction(nearest(Fraction("0.1"))))
    assert Machine(source).start().step([0.0, 0.0, False, False, 0])[0] == expected


# ---- what is an error while it runs -------------------------------------------------------------


@pytest.mark.parametrize("kind", ["LREAL", "REAL"])
@pytest.mark.parametrize(
    ("body", "inputs"),
    [
        ("y := a * a;", {"a": 1e200}),
        ("y := a + a;", {"a": 1.7e308}),
        ("y := a / b;", {"a": 1.0, "b": 0.0}),
        ("y := a / b;", {"a": 0.0, "b": 0.0}),
        ("y := a - b;", {"a": INF, "b": INF}),
        ("y := row[n];", {"n": 1}),
        ("row[n] := a;", {"n": -1}),
        ("row[n] := a;", {"n": 3}),
        ("row[0] := a; z := p AND (row[n] > a);", {"n": -1}),
        ("row[0] := a; z := TRUE OR (row[n] > a);", {"n": 7}),
        ("m := n + 1;", {"n": 32767}),
        ("m := n - 1;", {"n": -32768}),
        ("m := n * n;", {"n": 182}),
        ("z := TRUE OR ((n + 1) > 0);", {"n": 32767}),
    ],
)
def test_what_a_plc_must_not_do_is_an_error_with_its_line(
    kind: str, body: str, inputs: dict[str, float | int]
) -> None:
    source = text("y := half;\n" + body).replace("LREAL", kind)
    if kind == "REAL":
        inputs = {
            k: 3e38 if isinstance(v, float) and 1e100 < v < INF else v for k, v in inputs.items()
        }
    line = source.splitlines().index(body) + 1
    given: dict[str, Value] = {"a": 0.0, "b": 0.0, "p": False, "q": False, "n": 0}
    execution = Machine(source).start()
    with pytest.raises(StRunError) as caught:
        execution.call(**(given | inputs))
    assert caught.value.line == line
    with pytest.raises(StRunError, match="stopped"):
        execution.call(**given)


@pytest.mark.parametrize("kind", ["LREAL", "REAL"])
def test_nan_and_infinity_that_came_in_may_pass(kind: str) -> None:
    execution = Machine(text("x := a + b; y := a * half;").replace("LREAL", kind)).start()
    for bad in (NAN, INF, -INF):
        assert same(execution.step([bad, 1.0, False, False, 0])[0], bad)


def test_an_error_in_an_inner_block_has_the_line_of_that_block() -> None:
    source = text("lag(u := a, hold := FALSE);")
    execution = Machine(source).start()
    execution.step([1.7e308, 0.0, False, False, 0])
    with pytest.raises(StRunError) as caught:
        execution.step([-1.7e308, 0.0, False, False, 0])
    assert caught.value.line == source.splitlines().index("    d := u - x;") + 1


@pytest.mark.parametrize(
    "row",
    [
        [1, 0.0, False, False, 0],
        [0.0, None, False, False, 0],
        [0.0, 0.0, 0, False, 0],
        [0.0, 0.0, False, False, True],
        [0.0, 0.0, False, False, 0.0],
        [0.0, 0.0, False, False, 40000],
        [0.0, 0.0, False, False],
    ],
)
def test_inputs_of_another_kind_are_refused(row: list[float]) -> None:
    with pytest.raises(StRunError):
        Machine(text("y := a;")).start().step(row)


def test_inputs_by_name_are_all_stated() -> None:
    with pytest.raises(StRunError, match="the inputs are a, b, p, q, n"):
        Machine(text("y := a;")).start().call(a=0.0)
    with pytest.raises(StRunError, match="no variable"):
        Machine(text("y := a;")).start().value("lag.nothing")


# ---- what is no program of the subset -----------------------------------------------------------


@pytest.mark.parametrize(
    ("body", "what"),
    [
        ("y := c;", "c is not declared"),
        ("a := b;", "a cannot be assigned"),
        ("k := b;", "k cannot be assigned"),
        ("y := lag.secret;", "secret is no output"),
        ("y := lag_3.x;", "lag_3 is no instance"),
        ("y := row;", "has no index"),
        ("y := a[n];", "no array"),
        ("y := row[a];", "NUMBER stands where INT must"),
        ("row[0] := a; y := row[3];", "outside of 0 to 2"),
        ("y := p;", "BOOL stands where NUMBER must"),
        ("z := a;", "NUMBER stands where BOOL must"),
        ("y := a + n;", "INT stands where NUMBER must"),
        ("z := a < n;", "INT stands where NUMBER must"),
        ("z := a AND b;", "AND of NUMBER"),
        ("z := p = q;", "= of BOOL"),
        ("m := n / n;", "/ of INT"),
        ("y := -n;", "INT stands where NUMBER must"),
        ("z := NOT a;", "NUMBER stands where BOOL must"),
        ("z := NOT a < b;", "parentheses are missing"),
        ("z := p AND q OR p;", "parentheses are missing"),
        ("y := a - -b;", "parentheses are missing"),
        ("y := (a * b) + a;", "more than once"),
        ("z := (a * b) < a;", "not stored before"),
        ("IF (a * b) < a THEN z := p; END_IF;", "not stored before"),
        ("y := 1.0;", "literal number"),
        ("y := 1E-6;", "literal number"),
        ("m := 32768;", "beyond the range of INT"),
        ("IF n THEN m := 1; END_IF;", "INT stands where BOOL must"),
        ("IF p THEN END_IF;", "no statement"),
        ("IF p THEN m := 1; ELSE END_IF;", "no statement"),
        ("IF p THEN m := 1; END_IF m := 2;", "semicolon is missing"),
        ("m := 2; IF p THEN m := 1; END_IF", "semicolon is missing"),
        ("lag(v := a);", "v is no input"),
        ("lag(x := a);", "x is no input"),
        ("lag(u := p);", "BOOL stands where NUMBER must"),
        ("y := d;", "d is read before"),
        ("IF p THEN d := a; END_IF; y := d;", "d is read before"),
        ("IF p THEN d := a; ELSIF q THEN m := 1; ELSE d := b; END_IF; y := d;", "d is read"),
        ("z := p OR (NOT (d > a));", "d is read before"),
        ("y := a; // remark", "comment of another form"),
        ("y := a; (* one (* two *)", "comment in a comment"),
        ("y := a; (* \N{DEGREE SIGN}C *)", "not in every code page"),
        ("", "no statement"),
    ],
)
def test_what_is_not_in_the_subset_is_refused(body: str, what: str) -> None:
    source = text("  " + body)
    error = refused(source)
    assert what in error.what
    # Where the end of something is missing, that is seen at the next word.
    first = source.splitlines().index("  " + body) + 1
    assert first <= error.line <= first + 1
    assert error.column >= 1


def test_a_temporary_that_every_branch_writes_may_be_read() -> None:
    body = "IF p THEN d := a; ELSIF q THEN d := b; ELSE d := half; END_IF; y := d;"
    assert [ran(body, a=1.0, b=2.0, p=p, q=True)["y"] for p in (True, False)] == [1.0, 2.0]


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("c : LREAL;", "no initial value"),
        ("c : LREAL := 1;", "no number with a point"),
        ("c : LREAL := 1E-6;", "no number with a point between digits"),
        ("c : LREAL := 1.0E+400;", "beyond the range"),
        ("c : LREAL := TRUE;", "no number with a point"),
        ("c : BOOL := 0;", "not TRUE or FALSE"),
        ("c : INT := 1.0;", "no whole number"),
        ("c : INT := 40000;", "beyond the range of INT"),
        ("c : REAL := 1.0;", "REAL in a file of LREAL"),
        ("c : ARRAY[2..1] OF LREAL;", "without elements"),
        ("c : ARRAY[0..1] OF LREAL := [0.0, 0.0];", "no initial value"),
        ("c : tx_none;", "tx_none is not declared"),
        ("X : LREAL := 1.0;", "x is declared twice"),
        ("tx_lag : LREAL := 1.0;", "tx_lag is declared twice"),
        ("two__lines : LREAL := 1.0;", "no name"),
        ("limit : LREAL := 1.0;", "no name"),
        ("a234567890123456789012345 : LREAL := 1.0;", "no name"),
    ],
)
def test_a_declaration_that_some_compiler_refuses_is_refused(line: str, what: str) -> None:
    error = refused(
        text("y := a;", HEAD.replace("  x : LREAL := 2.5;", f"  x : LREAL := 2.5;\n{line}"))
    )
    assert what in error.what


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("VAR_TEMP\n  d : LREAL;", "VAR_TEMP\n  d : LREAL := 0.0;", "temporary has no initial"),
        ("VAR_TEMP\n", "VAR_TEMP\n  e : tx_lag;\n", "an instance stands in VAR"),
        ("VAR_TEMP\n", "VAR_TEMP\n  e : ARRAY[0..1] OF LREAL;\n", "an array stands in VAR"),
        ("VAR CONSTANT", "VAR", "same heading"),
        ("END_VAR\nVAR_OUTPUT", "END_VAR\nVAR_INPUT", "same heading"),
        ("FUNCTION_BLOCK tx_main", "FUNCTION_BLOCK tx_lag", "tx_lag is declared twice"),
    ],
)
def test_a_block_of_another_form_is_refused(old: str, new: str, what: str) -> None:
    assert old in HEAD
    assert what in refused(text("y := a;", HEAD.replace(old, new))).what


@pytest.mark.parametrize(
    "source",
    [
        "",
        "(* nothing *)",
        "y := x;",
        text("y := a;").rsplit("END_FUNCTION_BLOCK", 1)[0],
        text("y := a;").replace("END_VAR", "", 1),
        "(" * 3_000_000,
    ],
)
def test_a_file_without_a_block_of_ours_is_refused(source: str) -> None:
    refused(source)


def test_a_block_stands_before_the_one_that_calls_it() -> None:
    body = text("y := a;")
    swapped = body[len(LAG) :] + LAG
    assert "tx_lag is not declared before" in refused(swapped).what


def test_the_place_of_an_error_is_where_it_stands() -> None:
    error = refused(
        "FUNCTION_BLOCK f\nVAR\n  x : LREAL := 1.0;\nEND_VAR\n  x := x + yy;\nEND_FUNCTION_BLOCK"
    )
    assert (error.line, error.column) == (5, 12)
    assert str(error) == "line 5, column 12: yy is not declared, or is no variable"


# ---- comparison, second grammar, mutants --------------------------------------------------------


def test_the_first_difference_is_told_in_hexadecimal() -> None:
    expected = [(1.0, NAN, 0.0, True), (0.1, 2.0, 3.0, False)]
    assert first_difference("abcd", expected, [(1.0, NAN, -0.0, True), expected[1]]) is None
    wrong = [(1.0, NAN, 0.0, True), (0.1, math.nextafter(2.0, 3.0), 3.0, False)]
    told = first_difference("abcd", expected, wrong)
    assert told is not None
    assert told.startswith("step 1: b is 2.0000000000000004 (0x1.0000000000001p+1) instead of 2.0")
    assert "d is 1 instead of True" in str(
        first_difference("abcd", expected, [(1.0, NAN, 0.0, 1), expected[1]])
    )
    assert "d is 0 instead of False" in str(
        first_difference("abcd", expected[1:], [(0.1, 2.0, 3.0, 0)])
    )
    assert "step 1: nothing is there" in str(first_difference("abcd", expected, expected[:1]))
    assert "step 1: nothing is exp" in str(first_difference("abcd", expected[:1], expected))
    assert "3 values" in str(first_difference("abcd", expected[1:], [(0.1, 2.0, 3.0)]))
    assert "of 3" in str(first_difference("abc", expected[1:], expected[1:]))


def test_another_grammar_reads_what_this_one_does() -> None:
    parse_with_blark(text("y := a; IF (NOT p) OR (a < b) THEN ; ELSE row[n] := a; END_IF;"))
    with pytest.raises(StError, match="blark") as caught:
        parse_with_blark(text("y := ;"))
    assert caught.value.line == text("y := ;").splitlines().index("y := ;") + 1


def outcome(source: str) -> object:
    """What a program says to a fixed random input, or how it fails."""
    rng = np.random.default_rng(3)
    try:
        execution = Machine(source).start()
        rows = [
            [float(rng.normal(0, 5)), float(rng.normal(0, 5)), bool(rng.random() < 0.3), False, 0]
            for _ in range(400)
        ]
        return execution.run(rows)
    except (StError, StRunError) as error:
        return str(error)


def test_a_program_is_computed_as_python_written_by_hand_computes_it() -> None:
    rng = np.random.default_rng(3)
    lag, lag_2 = 1.0, 1.0
    expected: list[tuple[float, bool, int]] = []
    for _ in range(400):
        a, b, p = float(rng.normal(0, 5)), float(rng.normal(0, 5)), bool(rng.random() < 0.3)
        if not p:
            lag = lag + 0.25 * (a - lag)
        lag_2 = lag_2 + 0.25 * (b - lag_2)
        y = lag - lag_2
        expected.append((y, y > 0.5, 0))
    assert outcome(text(BANK)) == expected


BANK = """
  lag(u := a, hold := p);
  lag_2(u := b, hold := FALSE);
  y := lag.x - lag_2.x;
  z := (y > half);"""


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("d := u - x;", "d := x - u;"),
        ("d := alpha * d;", "d := d * d;"),
        ("alpha : LREAL := 0.25", "alpha : LREAL := 0.25000000000000006"),
        ("x := x + d;", "x := x - d;"),
        ("x := x + d;", "secret := x + d;"),
        ("IF NOT hold", "IF hold"),
        ("x : LREAL := 1.0", "x : LREAL := 1.5"),
        ("hold := p", "hold := FALSE"),
        ("u := b", "u := a"),
        ("lag.x - lag_2.x", "lag_2.x - lag.x"),
        ("lag.x - lag_2.x", "lag.x - lag.x"),
        ("(y > half)", "(y < half)"),
        ("  z := (y > half);", ""),
        ("half : LREAL := 0.5", "half : LREAL := 0.9"),
    ],
)
def test_a_mutation_of_the_text_is_seen(old: str, new: str) -> None:
    source = text(BANK)
    assert source.count(old) >= 1
    assert outcome(source.replace(old, new)) != outcome(source)
