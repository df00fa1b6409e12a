"""SCL, normalised to Structured Text and executed, against what must come out.

No tool of Siemens is asked: whether it takes the text is not checked here.
"""

import pytest

from tests.unit.plc.equal_parts import difference, run_st, short_record, texts_of
from tests.unit.plc.st_interpreter import Machine


@pytest.mark.parametrize("double", [True, False])
@pytest.mark.parametrize("seed", range(12))
def test_scl_says_what_must_come_out_to_the_last_bit(seed: int, double: bool) -> None:
    program, record = short_record(seed, double=double)
    scl = texts_of(program).scl
    assert set(scl) == ({"s7-1500"} if double else {"s7-1500", "s7-300"})
    for cpu, text in scl.items():
        assert difference(record, run_st(Machine(text), record)) == "", cpu
