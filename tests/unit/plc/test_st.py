"""Structured Text and SCL, run by gcc, against `cycle` in LREAL and the executed tree in REAL.

No tool of Siemens or of a control is asked: whether it takes the text is not checked here.
"""

from pathlib import Path

import numpy as np
import pytest

from tests.unit.plc.equal_parts import (
    CBlock,
    CLibrary,
    Task,
    c_library,
    compared_together,
    short_record,
    texts_of,
)
from tests.unit.plc.small_programs import small
from tests.unit.plc.st_to_c import st_as_c

BY_HAND = """(* what follows is a section, twice *)
FUNCTION_BLOCK tx_lag
VAR_INPUT
    u : LREAL := 7.0;
    hold : BOOL := FALSE;
END_VAR
VAR_OUTPUT
    x : LREAL := 1.0;
END_VAR
VAR
    d : LREAL := 0.0;
END_VAR
VAR CONSTANT
    alpha : LREAL := 0.1;
END_VAR
    IF (NOT hold) THEN
        d := (u - x);
        d := (alpha * d);
        x := (x + d);
    END_IF;
END_FUNCTION_BLOCK

FUNCTION_BLOCK tx_main
VAR_INPUT
    a : LREAL := 0.0;
    p : BOOL := FALSE;
END_VAR
VAR_OUTPUT
    y : LREAL := 0.0;
    n : INT := 0;
END_VAR
VAR
    ring : ARRAY[0..1] OF LREAL;
    place : INT := 1;
    one : tx_lag;
    other : tx_lag;
END_VAR
    one(u := a, hold := p);
    other(u := a,
            hold := FALSE);
    ring[place] := one.x;
    y := (ring[place] - other.x);
    IF ((place = 1) AND p) THEN
        n := (n + (-2));
    ELSIF (NOT (a <= y)) OR FALSE THEN
        n := 7;
    ELSE
        n := 0;
    END_IF;
END_FUNCTION_BLOCK
"""


@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_a_text_is_computed_as_python_written_by_hand_computes_it(
    kind: type[np.float64] | type[np.float32], tmp_path: Path
) -> None:
    text = BY_HAND if kind is np.float64 else BY_HAND.replace("LREAL", "REAL")
    rng = np.random.default_rng(3)
    one = other = kind(1.0)
    n, alpha, rows, wanted = 0, kind(0.1), [], []
    for call in range(400):
        a, p = kind(np.nan if call == 399 else rng.normal(0, 5)), bool(rng.random() < 0.3)
        one = one if p else one + alpha * (a - one)
        other += alpha * (a - other)
        y = one - other
        n = n - 2 if p else 7 if not a <= y else 0
        rows.append((float(a), p))
        wanted.append((float(y), n))
    block = CBlock(st_as_c(text, "tx_m"), ("a", "p"), ("y", "n"))
    ran = CLibrary(c_library({"tx_m": block}, tmp_path, "-O0"))
    got = ran.called("tx_m", rows, [call == 0 for call in range(400)], 2)
    assert np.array_equal(got, np.array(wanted), equal_nan=True)


@pytest.mark.parametrize(
    "wrong", ["one(v := a", "other.z", "lost :=", "WHILE", "ring := y;", "END_IF END_IF"]
)
def test_a_word_that_is_not_declared_or_not_of_the_language_is_no_program(
    wrong: str, tmp_path: Path
) -> None:
    right = {"one(v := a": "one(u := a", "other.z": "other.x", "lost :=": "n :=", "WHILE": "IF",
             "ring := y;": "n := 7;", "END_IF END_IF": "END_IF"}[wrong]  # fmt: skip
    text = BY_HAND.replace(right, wrong)
    assert text != BY_HAND
    with pytest.raises((ValueError, AssertionError)):
        c_library({"tx_m": CBlock(st_as_c(text, "tx_m"), ("a",), ("y",))}, tmp_path, "-O0")


@pytest.mark.parametrize("double", [True, False])
def test_every_text_says_what_must_come_out_to_the_last_bit(double: bool, tmp_path: Path) -> None:
    tasks = [Task(seed, 10.0, double, 6000.0 / 3600.0, optimised=seed == 1) for seed in range(3)]
    texts = {"-O0", "st", "s7-1500", *(() if double else ("s7-300",))}
    for comparison in compared_together(tasks, tmp_path):
        asked = texts | ({"-O2"} if comparison.task.optimised else set())
        assert comparison.differences == dict.fromkeys(asked, ""), comparison.task.label
        assert comparison.seen.calls == 600


@pytest.mark.parametrize("double", [True, False])
def test_scl_means_what_the_structured_text_means_and_a_changed_one_does_not(double: bool) -> None:
    for program in (short_record(1, double=double)[0], small(double=double)):
        texts = texts_of(program)
        meaning = {st_as_c(text, "m") for text in texts.values()}
        assert len(meaning) == 1
        changed = texts["s7-1500"].replace(" + ", " - ", 1)
        assert st_as_c(changed, "m") not in meaning
