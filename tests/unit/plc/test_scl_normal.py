"""SCL is stripped to Structured Text: only what is known, and nothing is lost on the way."""

import re

import pytest

from tests.unit.plc.scl_normal import Cpu, scl_normal
from tests.unit.plc.st_interpreter import Machine, StRunError
from tests.unit.plc.st_program import read_program
from tests.unit.plc.st_syntax import StError

PORTAL = """(* head: "quoted", #marked, {braced} *)

(* over two
   lines: BEGIN *)
FUNCTION_BLOCK "tx_lag"
{ S7_Optimized_Access := 'TRUE' }
VERSION : 0.1
VAR_INPUT
    u : LREAL := 0.0;  (* input [K] *)
    go : BOOL := FALSE;
END_VAR
VAR_OUTPUT
    x : LREAL := 0.0;
END_VAR
VAR
    d : LREAL := 0.0;
END_VAR
VAR CONSTANT
    alpha : LREAL := 0.25;
END_VAR
BEGIN
    IF (NOT #go) THEN  (* "no" #d *)
        #d := (#u - #x);
        #d := (#alpha * #d);
        #x := (#x + #d);
    END_IF;
END_FUNCTION_BLOCK

FUNCTION_BLOCK "tx_main"
{ S7_Optimized_Access := 'TRUE' }
VERSION : 0.1
VAR_INPUT
    u : LREAL := 0.0;
    n : INT := 0;
END_VAR
VAR_OUTPUT
    y : LREAL := 0.0;
    many : BOOL := FALSE;
END_VAR
VAR
    ring : ARRAY[0..2] OF LREAL;
    lag : "tx_lag";
END_VAR
VAR CONSTANT
    few : INT := -2;
    yes : BOOL := TRUE;
END_VAR
BEGIN
    #lag(u := #u,
            go :=
            #many, );
    #ring[#n] := #lag.x;
    #y := #ring[#n];
    #many := ((#n > #few) AND
            (NOT #yes));
END_FUNCTION_BLOCK
""".replace("#many, );", "#many);")

CLASSIC = (
    PORTAL.replace("LREAL", "REAL")
    .replace("{ S7_Optimized_Access := 'TRUE' }\nVERSION : 0.1", "TITLE = 'x'\nVERSION : '0.1'")
    .replace("#", "")
    .replace(
        "VAR CONSTANT\n    alpha : REAL := 0.25;\nEND_VAR", "CONST\n    alpha := 0.25;\nEND_CONST"
    )
    .replace(
        "VAR CONSTANT\n    few : INT := -2;\n    yes : BOOL := TRUE;\nEND_VAR",
        "CONST\n    (* a remark *)\n    few := -2;  (* how many *)\n    yes := TRUE;\nEND_CONST",
    )
)
TEXTS: dict[Cpu, str] = {"s7-1500": PORTAL, "s7-300": CLASSIC}


def refused(text: str, cpu: Cpu = "s7-1500") -> StError:
    """The error of a text, of the stripping or of the reading behind it."""
    with pytest.raises(StError) as caught:
        read_program(scl_normal(text, cpu))
    return caught.value


@pytest.mark.parametrize("cpu", ["s7-1500", "s7-300"])
def test_scl_is_executed_like_the_text_that_it_says(cpu: Cpu) -> None:
    execution = Machine(scl_normal(TEXTS[cpu], cpu)).start()
    assert execution.run([[8.0, 0], [8.0, 2]]) == [(2.0, False), (3.5, False)]
    assert Machine(scl_normal(TEXTS[cpu], cpu)).program.double is (cpu == "s7-1500")


def words(text: str) -> list[str]:
    """What is left of a text without its remarks."""
    return re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL).split()


def test_nothing_but_dialect_is_stripped() -> None:
    plain = PORTAL
    for gone in ("{ S7_Optimized_Access := 'TRUE' }", "VERSION : 0.1", "\nBEGIN\n", '"', "#"):
        assert gone in plain
        plain = plain.replace(gone, "\n")
    assert words(scl_normal(PORTAL)) == words(plain)
    classic = "".join(words(scl_normal(CLASSIC, "s7-300")))
    assert classic == "".join(words(plain.replace("LREAL", "REAL")))


@pytest.mark.parametrize("cpu", ["s7-1500", "s7-300"])
def test_lines_keep_their_numbers_and_remarks_their_text(cpu: Cpu) -> None:
    text, normal = TEXTS[cpu], scl_normal(TEXTS[cpu], cpu)
    remark = re.compile(r"\(\*.*?\*\)", re.DOTALL)
    assert remark.findall(normal) == remark.findall(text)
    assert len(remark.findall(text)) >= 4
    pairs = list(zip(text.split("\n"), normal.split("\n"), strict=True))
    assert all(
        set(words(after)) - set(words(before))
        <= {"VAR", "CONSTANT", "END_VAR", ":", "REAL", "INT", "BOOL"}
        for before, after in pairs
        if '"' not in before and "#" not in before
    )


def test_an_error_is_where_it_stands_in_the_scl() -> None:
    text = PORTAL.replace("#d := (#u - #x);", "#d := (#u - #none);")
    error = refused(text)
    line = next(k for k, row in enumerate(text.splitlines(), 1) if "#none" in row)
    assert (error.line, error.column) == (line, text.splitlines()[line - 1].index("none") + 1)
    execution = Machine(scl_normal(PORTAL)).start()
    with pytest.raises(StRunError) as caught:
        execution.step([8.0, 3])
    assert PORTAL.splitlines()[caught.value.line - 1].strip() == "#ring[#n] := #lag.x;"


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("{ S7_Optimized_Access := 'TRUE' }\n", ""),
        ("{ S7_Optimized_Access := 'TRUE' }\n", "{ S7_optimized_access := 'TRUE' }\n"),
        ("VERSION : 0.1\n", ""),
        ("VERSION : 0.1\n", "VERSION : '0.1'\n"),
        ('FUNCTION_BLOCK "tx_lag"', "FUNCTION_BLOCK tx_lag"),
        ('lag : "tx_lag";', "lag : 'tx_lag';"),
        ('lag : "tx_lag";', 'lag : "tx_none";'),
        ("u : LREAL := 0.0;", '"u" : LREAL := 0.0;'),
        ("u : LREAL := 0.0;", "#u : LREAL := 0.0;"),
        ("BEGIN\n", ""),
        ("BEGIN\n", "BEGIN\nBEGIN\n"),
        ("#d := (#u - #x);", "d := (#u - #x);"),
        ("#d := (#u - #x);", "#d := (u - #x);"),
        ("#d := (#u - #x);", "#d := (#u - x);"),
        ("#d := (#u - #x);", '#d := ("u" - #x);'),
        ("#d := (#u - #x);", "#d := (#u - #x)"),
        ("#d := (#u - #x);", "#d := (#u - #x); // remark"),
        ("#lag.x", "lag.x"),
        ("#lag(u", "lag(u"),
        ("#lag(u", "#lag(#u"),
        ("#ring[#n] := #lag", "#ring[n] := #lag"),
        ("(#n > #few)", "(#n > few)"),
        ("END_FUNCTION_BLOCK\n", ""),
        ("VAR CONSTANT", "CONST"),
        ("input [K]", "input (* nested *) [K]"),
        ("input [K]", "input [\N{DEGREE SIGN}C]"),
    ],
)
def test_scl_of_another_form_is_refused(old: str, new: str) -> None:
    assert old in PORTAL
    refused(PORTAL.replace(old, new, 1))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("TITLE = 'x'\n", ""),
        ("TITLE = 'x'\n", "{ S7_Optimized_Access := 'TRUE' }\n"),
        ("VERSION : '0.1'", "VERSION : 0.1"),
        ("VERSION : '0.1'", "VERSION : '0.1'\nAUTHOR : longer_than_eight"),
        ("d := (u - x);", "#d := (u - x);"),
        ("REAL", "LREAL"),
        (
            "CONST\n    alpha := 0.25;\nEND_CONST",
            "VAR CONSTANT\n    alpha : REAL := 0.25;\nEND_VAR",
        ),
        ("alpha := 0.25;", "alpha : REAL := 0.25;"),
        ("alpha := 0.25;", "alpha := 0.25"),
        ("alpha := 0.25;", "alpha := 1E-3;"),
        ("    few := -2;", "    few := -2.0;"),
    ],
)
def test_scl_of_the_old_class_of_another_form_is_refused(old: str, new: str) -> None:
    assert old in CLASSIC
    refused(CLASSIC.replace(old, new, 1), "s7-300")


def test_the_old_class_may_say_author_family_and_name_in_this_order() -> None:
    more = "VERSION : '0.1'\nAUTHOR : abc\nFAMILY : heat\nNAME : lag"
    text = CLASSIC.replace("VERSION : '0.1'", more)
    assert list(read_program(scl_normal(text, "s7-300")).blocks) == ["tx_lag", "tx_main"]


def test_one_class_is_not_taken_for_the_other() -> None:
    refused(PORTAL, "s7-300")
    refused(CLASSIC, "s7-1500")
