"""What both courses live through stands once, and both lead every channel and output through it."""

import math
from collections.abc import Callable, Iterator

import pytest

from tests.unit.plc.plc_scenarios import CycleBlock, random_settings
from thermaxis.plc import BlockInstance, PlcSettings, PlcStep, course_steps, scenario_steps
from thermaxis.plc.vectors import _course, _scenario, _world
from thermaxis.plc.vectors._world import (
    ODD,
    World,
    changed_in_off,
    odd_start,
    odd_values,
    other_offsets,
    second_compensation,
    trims_and_hold,
    wrong_cycle_times,
)

SHARED = (
    changed_in_off,
    odd_start,
    odd_values,
    other_offsets,
    second_compensation,
    trims_and_hold,
    wrong_cycle_times,
)


def course_of(settings: PlcSettings) -> Iterator[PlcStep]:
    return course_steps(settings, seed=1)


def scenario_of(settings: PlcSettings) -> Iterator[PlcStep]:
    return scenario_steps(settings, hours=1.5, seed=1)


def test_every_channel_reads_every_odd_value_alone_and_then_jumps() -> None:
    settings = random_settings(3)
    world = World(settings, 1)
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


@pytest.mark.parametrize("phase", SHARED)
@pytest.mark.parametrize(("module", "steps"), [(_course, course_of), (_scenario, scenario_of)])
def test_both_courses_lead_through_what_stands_once(
    module: object,
    steps: Callable[[PlcSettings], Iterator[PlcStep]],
    phase: Callable[[World], Iterator[PlcStep]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert getattr(module, phase.__name__) is getattr(_world, phase.__name__)
    through: list[int] = []

    def watched(world: World) -> Iterator[PlcStep]:
        begun = len(through)
        for step in phase(world):
            through.append(begun)
            yield step

    # The scenario keeps its phases in a list that is made when it runs, the course names them.
    monkeypatch.setattr(module, phase.__name__, watched)
    settings = random_settings(3)
    for step in steps(settings):
        if len(through) >= 6:
            break
        assert isinstance(step, PlcStep)
    assert len(through) >= 6


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
