"""SCL, normalised to Structured Text and executed, against what must come out.

No tool of Siemens is asked: whether it takes the text is not checked here.
"""

import pytest

from tests.unit.plc.equal_parts import difference, run_st, short_record, texts_of
from tests.unit.plc.st_interpreter import Machine


@pytest.mark.parametrize("double", [True, False])
@pytest.mark.parametrize("seed", range(6))
def test_scl_says_what_must_come_out_to_the_last_bit(seed: int, double: bool) -> None:
    program, record = short_record(seed, double=double)
    scl = texts_of(program).scl
    assert set(scl) == ({"s7-1500"} if double else {"s7-1500", "s7-300"})
    for cpu, text in scl.items():
        assert difference(record, run_st(Machine(text), record)) == "", cpu


@pytest.mark.parametrize("double", [True, False])
def test_every_text_of_a_program_means_the_same_and_a_changed_one_does_not(double: bool) -> None:
    """Whole comparisons run texts of one meaning once; so nothing may hide in it."""
    program, _ = short_record(5, double=double)
    texts = texts_of(program)
    meaning = Machine(texts.st).meaning
    for text in texts.scl.values():
        assert Machine(text).meaning == meaning
    number = "REAL := 0.0;"
    assert number in texts.st
    for changed in (
        texts.st.replace(number, "REAL := -0.0;", 1),
        texts.st.replace(number, "REAL := 1.0E-30;", 1),
        texts.st.replace(" + ", " - ", 1),
        texts.st.replace(" <= ", " < ", 1),
        texts.st.replace("state := 1;", "state := 2;", 1),
    ):
        assert changed != texts.st
        assert Machine(changed).meaning != meaning
