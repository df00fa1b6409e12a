"""The executed block: what the scenarios reach, and the numbers of REAL."""

import math
from collections.abc import Callable  # noqa: TC003 - for who reads the types at run time

import numpy as np
from hypothesis import given, strategies as st

from tests.unit.plc.plc_scenarios import CycleDriver, MoodPlant, random_settings
from thermaxis.plc import BlockInstance, CallSequence
from thermaxis.plc.tree import to_single


def test_both_magnitudes_and_both_rates_are_reached() -> None:
    settings = random_settings(0)
    bounds = settings.compensation.bounds[0]
    step_um = bounds.largest_rate_um_per_s * settings.cycle_s
    before, seen = 0.0, set[str]()
    for _, said in CallSequence(settings, seed=1).steps():
        c = said.correction_um[0]
        seen.update({f"clamp {c:+.0e}"} if abs(c) == bounds.largest_um else ())
        change = c - before
        if math.isclose(abs(change), step_um, rel_tol=1e-9):
            seen.add("up" if change > 0.0 else "down")
        before = c
    assert {"up", "down"} <= seen
    assert len(seen) == 4, seen


def test_a_trim_that_is_no_number_is_refused_in_every_call() -> None:
    settings = random_settings(2)
    block, driver = BlockInstance(settings), CycleDriver(settings)
    calm = next(iter(CallSequence(settings, seed=0).steps())).inputs
    calm = calm._replace(cycle_time_s=settings.cycle_s, enable=False)
    odd = calm._replace(trims_um=(math.nan,) * len(calm.trims_um))
    refused: list[bool] = []
    for inputs in (calm, odd, odd, odd, calm):
        said = block.step(inputs)
        assert driver.said(inputs) == said
        refused.append(said.refused)
    assert refused == [False, True, True, True, False]


def test_a_restart_forgets_everything() -> None:
    settings = random_settings(5)
    steps = list(MoodPlant(settings, 5).steps(BlockInstance(settings), 600))
    inputs = [step.inputs._replace(restart=False) for step in steps]
    block = BlockInstance(settings)
    first = [block.step(i) for i in inputs]
    assert [block.step(i) for i in (inputs[0]._replace(restart=True), *inputs[1:])] == first


@given(st.floats(width=32), st.floats(width=32), st.sampled_from("+-*/"))
def test_an_operation_rounded_from_binary64_is_that_of_binary32(
    one: float, other: float, sign: str
) -> None:
    if sign == "/" and other == 0.0:
        return
    plain: dict[str, Callable[[float, float], float]] = {
        "+": lambda a, b: a + b,
        "-": lambda a, b: a - b,
        "*": lambda a, b: a * b,
        "/": lambda a, b: a / b,
    }
    with np.errstate(all="ignore"):
        wanted = float(plain[sign](np.float32(one), np.float32(other)))
    made = to_single(plain[sign](one, other))
    assert made == wanted or (math.isnan(made) and math.isnan(wanted))


def test_every_number_of_a_block_in_real_is_one_of_binary32() -> None:
    settings = random_settings(11, double=False)
    for _, said in MoodPlant(settings, 1).steps(BlockInstance(settings), 720):
        numbers = (*said.correction_um, *said.model_um, *said.wanted_um, *said.weight)
        for number in (*numbers, *said.parts_um):
            assert number == to_single(number)
