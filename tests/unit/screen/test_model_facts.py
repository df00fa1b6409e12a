"""Numbers of the model's page against the model itself, run in its own steps."""

import json

import pytest
from hypothesis import given, strategies as st

from tests.unit.screen.engineer_bench import told_by_a_loop
from tests.unit.screen.stand import lathe
from thermaxis.compensation import (
    STATED,
    CompensationModel,
    GainPoint,
    Output,
    Part,
    Provenance,
    Reading,
    Section,
    TrainingLog,
    gain_of,
    initial_state,
    model_step,
)
from thermaxis.screen.pages.model._facts import (
    MOST_RECORDS,
    charts_of,
    is_held,
    longest_record_s,
    step_of,
    step_response_um_per_k,
)

GAINS = st.floats(-50.0, 50.0)
SECTIONS = st.lists(st.builds(Section, GAINS, st.floats(1.0, 2e4)), max_size=5)


def model_of(
    part: Part, filter_s: float = 0.0, logs: tuple[TrainingLog, ...] = ()
) -> CompensationModel:
    return CompensationModel(
        outputs=(Output("Z_um", (part,)),),
        reference=STATED,
        reference_c={"t": 20.0},
        input_filter_s=filter_s,
        provenance=Provenance(logs=logs),
    )


def run_step(model: CompensationModel, step_s: float, count: int) -> list[tuple[float, float]]:
    """Run the model itself: at rest, then one kelvin more for good."""
    state, _ = model_step(model, initial_state(model), Reading(-step_s, {"t": 20.0}))
    found: list[tuple[float, float]] = []
    for k in range(count):
        state, output = model_step(model, state, Reading(k * step_s, {"t": 21.0}))
        found.append((k * step_s, output.model_um[0]))
    return found


@given(direct=GAINS, sections=SECTIONS, step_s=st.floats(0.5, 600.0))
def test_the_closed_form_is_what_the_models_own_steps_say(
    direct: float, sections: list[Section], step_s: float
) -> None:
    part = Part("p", "t", "", direct, tuple(sections))
    for time_s, said in run_step(model_of(part), step_s, 25):
        assert step_response_um_per_k(part, time_s) == pytest.approx(said, abs=1e-9)


@given(sections=SECTIONS, direct=GAINS, delayed=st.integers(1, 12))
def test_nothing_is_said_before_the_delay_and_the_same_later_behind_it(
    sections: list[Section], direct: float, delayed: int
) -> None:
    part = Part("p", "t", "", direct, tuple(sections), delay_s=10.0 * delayed)
    for k, (time_s, said) in enumerate(run_step(model_of(part), 10.0, 30)):
        found = step_response_um_per_k(part, time_s)
        assert found == pytest.approx(said, abs=1e-9)
        if k < delayed:
            assert found == 0.0


@pytest.mark.parametrize("tau_s", [50.0, 200.0, 200.0000001, 900.0])
def test_a_filter_of_the_inputs_is_in_the_step_also_where_its_time_constant_is_a_sections(
    tau_s: float,
) -> None:
    part = Part("p", "t", "", 3.0, (Section(10.0, tau_s), Section(-4.0, 3000.0)))
    said = run_step(model_of(part, 200.0), 0.25, 8000)
    for time_s, value in said[::400]:
        found = step_response_um_per_k(part, time_s, 200.0)
        assert found == pytest.approx(value, abs=0.01)  # the model holds its input for a quarter s


@given(sections=SECTIONS, direct=GAINS)
def test_the_dc_gain_is_the_end_of_the_step_and_the_steady_state_of_the_model(
    sections: list[Section], direct: float
) -> None:
    part = Part("p", "t", "", direct, tuple(sections))
    _, steady = model_step(model_of(part), initial_state(model_of(part)), Reading(0.0, {"t": 21.0}))
    shown = charts_of(model_of(part), None)
    gain = shown["outputs"][0]["parts"][0]["dc_gain_um_per_k"]
    assert gain == pytest.approx(steady.model_um[0], abs=1e-9)
    assert step_response_um_per_k(part, 1e7) == pytest.approx(gain, abs=1e-9)


def test_times_rise_and_have_the_end_of_the_record_and_both_sides_of_a_delay() -> None:
    part = Part("p", "t", "", 1.0, (Section(2.0, 500.0),), delay_s=120.0)
    model = model_of(part, logs=(TrainingLog("a", "", 900), TrainingLog("b", "", 700)))
    step = step_of(model, model.outputs[0])
    assert longest_record_s(model) == 900.0
    assert all(a < b for a, b in zip(step.time_s, step.time_s[1:], strict=False))
    assert step.time_s[0] == 0.0
    assert step.time_s[step.known - 1] == 900.0
    assert step.time_s[-1] == pytest.approx(120.0 + 5 * 500.0)
    at = step.time_s.index(120.0)
    assert step.response_um_per_k["p"][at - 1] == 0.0
    assert step.response_um_per_k["p"][at] == 1.0


def test_a_step_that_nobody_has_measured_for_so_long_is_cut() -> None:
    part = Part("p", "t", "", 1.0, (Section(2.0, 1e6),))
    model = model_of(part, logs=(TrainingLog("a", "", 1000),))
    assert step_of(model, model.outputs[0]).time_s[-1] == MOST_RECORDS * 1000.0


def test_without_a_record_every_point_counts_as_known() -> None:
    model = model_of(Part("p", "t", "", 1.0, (Section(2.0, 100.0),)))
    step = step_of(model, model.outputs[0])
    assert longest_record_s(model) is None
    assert step.known == len(step.time_s)


def test_a_part_without_sections_has_a_step_too() -> None:
    model = model_of(Part("p", "t", "", 1.5))
    assert set(step_of(model, model.outputs[0]).response_um_per_k["p"]) == {1.5}


@pytest.mark.parametrize(
    ("diameter_mm", "gain", "held"),
    [
        (None, 0.9, False),
        (100.0, 2.0, False),
        (150.0, 3.0, False),
        (50.0, 2.0, True),
        (500.0, 4.0, True),
    ],
)
def test_the_factor_in_force_is_linear_and_says_where_it_is_held(
    diameter_mm: float | None, gain: float, held: bool
) -> None:
    points = (GainPoint(100.0, 2.0), GainPoint(200.0, 4.0))
    part = Part("p", "t", "", 1.0, gain_by_diameter=points, tool_gain=0.9)
    assert (gain_of(part, diameter_mm), is_held(part, diameter_mm)) == (gain, held)


def test_what_is_drawn_of_the_examples_model_goes_into_json() -> None:
    model = lathe().model.model
    shown = json.loads(json.dumps(charts_of(model, 1200.0), allow_nan=False))
    parts = {part["name"]: part for part in shown["outputs"][0]["parts"]}
    spindle = parts["spindle"]
    summed = spindle["direct_gain_um_per_k"] + sum(s["gain_um_per_k"] for s in spindle["sections"])
    assert spindle["dc_gain_um_per_k"] == pytest.approx(summed)
    assert shown["record_s"] == 855 * 60.0
    points = [tuple(point.values()) for point in parts["table"]["gain_by_diameter"][:2]]
    assert points == [(0.0, pytest.approx(0.98454, 1e-5)), (1500.0, pytest.approx(1.59101, 1e-5))]


def test_the_loop_tells_the_references_from_which_the_page_finds_the_loops_own_weight() -> None:
    configuration = lathe()
    end_c = {"T_spindle_C": 36.0, "T_table_C": 22.0, "T_column_C": 21.0}
    status = told_by_a_loop(configuration, end_c)
    outside_k = 0.0
    for part in configuration.model.model.outputs[0].parts:
        plus, minus = status["inputs"][part.plus], status["inputs"][part.minus]
        value_k = (plus["value_c"] - plus["reference_c"]) - (
            minus["value_c"] - minus["reference_c"]
        )
        assert part.lowest_k is not None
        assert part.highest_k is not None
        outside_k = max(outside_k, part.lowest_k - value_k, value_k - part.highest_k)
    assert outside_k == pytest.approx(1.15)
    weight = 1.0 - outside_k / configuration.compensation.validity_margin_k
    assert status["outputs"]["Z_um"]["weight"] == pytest.approx(weight)
    assert status["outputs"]["Z_um"]["weight"] == pytest.approx(0.77)
