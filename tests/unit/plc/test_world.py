"""The world around a block: every channel reads what is odd, whoever answers."""

import math

import pytest

from tests.unit.plc.plc_scenarios import CycleBlock, random_settings
from thermaxis.plc import BlockInstance, scenario_steps
from thermaxis.plc.vectors import ODD, SimulatedPlant, odd_values


def test_every_channel_reads_every_odd_value_alone_and_then_jumps() -> None:
    settings = random_settings(3)
    world = SimulatedPlant(settings, 1)
    seen = [step.inputs.temperatures_c for step in odd_values(world)]
    base_c = world.base_c
    assert len(base_c) > 1
    for k, rules in enumerate(settings.compensation.rules):
        alone = [row for row in seen if all(row[i] == base_c[i] for i in range(len(row)) if i != k)]
        read = {row[k] for row in alone}
        finite = {odd for odd in ODD if not math.isnan(odd)}
        assert read >= finite | {rules.lowest_c - 0.5, rules.highest_c + 0.5}
        assert any(math.isnan(value) for value in read)
        believed = rules.step_k + rules.largest_rate_k_per_s * settings.cycle_s
        jumps = [t for t in read if rules.lowest_c < t < rules.highest_c]
        assert any(abs(t - base_c[k]) > believed for t in jumps)


def test_a_scenario_led_by_cycle_is_that_of_the_tree_and_executes_no_tree(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    settings = random_settings(5)
    with monkeypatch.context() as without:
        without.delattr(BlockInstance, "step")
        steps = scenario_steps(settings, hours=0.5, seed=2, block=CycleBlock(settings))
        led = list(steps)
    assert len(led) == 1800
    executed = list(scenario_steps(settings, hours=0.5, seed=2))
    # But for the sign of a zero.
    as_text = [[repr(step).replace("-0.0", "0.0") for step in steps] for steps in (led, executed)]
    assert as_text[0] == as_text[1]
