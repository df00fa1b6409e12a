"""Structured Text, parsed and executed, against `cycle` in LREAL and the executed tree in REAL."""

import pytest

from tests.unit.plc.equal_parts import (
    Task,
    compared,
    demanded_settings,
    difference,
    recorded,
    run_st,
    shift,
    short_record,
)
from tests.unit.plc.st_interpreter import Machine
from thermaxis.plc import build_program, print_st, scenario_steps


@pytest.mark.parametrize("double", [True, False])
@pytest.mark.parametrize("seed", range(6))
def test_structured_text_says_what_must_come_out_to_the_last_bit(seed: int, double: bool) -> None:
    program, record = short_record(seed, double=double)
    assert difference(record, run_st(Machine(print_st(program)), record)) == ""


@pytest.mark.parametrize("flavour", ["twincat", "codesys"])
def test_the_text_for_an_editor_with_two_panes_computes_the_same(flavour: str) -> None:
    settings = demanded_settings(3, cycle_s=1.0, double=True)
    record = shift(settings, hours=0.1, seed=3)
    text = print_st(build_program(settings), flavour)
    assert difference(record, run_st(Machine(text), record)) == ""


def test_what_cycle_says_and_what_the_tree_says_are_two_records_of_the_same_numbers() -> None:
    settings = demanded_settings(4, cycle_s=1.0, double=True)
    steps = list(scenario_steps(settings, hours=0.2, seed=4))
    record, executed = recorded(settings, steps), recorded(settings, steps, from_steps=True)
    assert difference(record, executed.wanted) == ""


def test_a_difference_names_call_and_output_in_hexadecimal() -> None:
    settings = demanded_settings(4, cycle_s=1.0, double=True)
    record = shift(settings, hours=0.05, seed=4)
    wrong = record.wanted.copy()
    column = record.outputs.index("state")
    wrong[17, column] += 1.0
    found = difference(record, wrong)
    assert found.startswith("call 17: state is ")
    assert "(0x1." in found
    assert difference(record, wrong[:17]) == "nothing after call 17"
    assert difference(record, record.wanted) == ""


def test_a_comparison_has_every_output_of_the_block_in_it() -> None:
    for seed in range(4):
        settings = demanded_settings(seed, cycle_s=1.0, double=True)
        outputs = [v.name for v in build_program(settings).blocks[-1].outputs]
        record = shift(settings, hours=0.01, seed=seed)
        assert [name for name in outputs if not name.startswith("model_id_")] == list(
            record.outputs
        )


def test_all_texts_of_a_model_are_compared_in_one_go() -> None:
    comparison = compared(Task(7, 1.0, double=False, hours=0.1))
    assert comparison.differences == {"st": "", "s7-1500": "", "s7-300": ""}
    assert comparison.seen.calls == 360
    assert comparison.task.label == "model 7 at 1 s in REAL"
