"""The executed block: what the scenarios reach, and the numbers of REAL."""

import math
from collections.abc import Callable  # noqa: TC003 - for who reads the types at run time

import numpy as np
from hypothesis import given, strategies as st

from tests.unit.plc.plc_scenarios import (
    NEVER,
    NEVER_SAMPLE,
    OUTCOMES,
    QUALITIES,
    REASONS,
    SAMPLE_QUALITIES,
    STATES,
    CycleDriver,
    random_settings,
)
from thermaxis.compensation import Reason
from thermaxis.plc import BlockInstance, course_steps, scenario, scenario_steps
from thermaxis.plc.tree import to_single


def test_the_scenarios_reach_whatever_the_block_can_reach() -> None:
    states, reasons, outcomes, qualities, model = set[int](), 0, 0, set[int](), set[int]()
    refused = restarts = 0
    for seed in range(8):
        for inputs, said in scenario_steps(random_settings(seed), hours=0.6, seed=seed):
            states.add(said.state)
            reasons |= said.fault_word
            outcomes |= said.outcome_word
            qualities.update(said.qualities)
            model.add(said.model_quality)
            refused += said.refused
            restarts += inputs.restart
    assert states == set(range(len(STATES)))
    # An offset outside its total is a fault only where it stands there after a lost connection:
    # here it may, where a display rounds up a correction at its total.
    outside = 2 ** REASONS.index(Reason.OFFSET_OUTSIDE)
    assert reasons | outside == 2 ** len(REASONS) - 1
    assert outcomes == 2 ** len(OUTCOMES) - 1 - sum(2 ** OUTCOMES.index(o) for o in NEVER)
    assert qualities == {k for k, q in enumerate(SAMPLE_QUALITIES) if q not in NEVER_SAMPLE}
    assert model == set(range(len(QUALITIES)))
    assert refused
    assert restarts >= 8


def test_both_magnitudes_and_both_rates_are_reached() -> None:
    settings = random_settings(0)
    bounds = settings.compensation.bounds[0]
    step_um = bounds.largest_rate_um_per_s * settings.cycle_s
    before, seen = 0.0, set[str]()
    for _, said in course_steps(settings, seed=1):
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
    calm = next(iter(course_steps(settings, seed=0))).inputs
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
    inputs = list(scenario(settings, 0.3, 5))
    block = BlockInstance(settings)
    first = [block.step(i) for i in inputs]
    assert [block.step(i) for i in (inputs[0]._replace(restart=True), *inputs[1:])] == first


def test_the_same_seed_gives_the_same_scenario_and_another_one_does_not() -> None:
    settings = random_settings(3)
    assert repr(list(scenario(settings, 0.6, 5))) == repr(list(scenario(settings, 0.6, 5)))
    assert repr(list(scenario(settings, 0.6, 5))) != repr(list(scenario(settings, 0.6, 6)))


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
    for _, said in scenario_steps(random_settings(11, double=False), hours=0.2, seed=1):
        numbers = (*said.correction_um, *said.model_um, *said.wanted_um, *said.weight)
        for number in (*numbers, *said.parts_um):
            assert number == to_single(number)
