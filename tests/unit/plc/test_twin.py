"""The twin of the exported block: `cycle` in LREAL bit for bit, and what REAL costs."""

import math
import time
from collections.abc import Callable  # noqa: TC003 - for who reads the types at run time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from tests.unit.plc.plc_scenarios import (
    OUTCOMES,
    QUALITIES,
    REASONS,
    SAMPLE_QUALITIES,
    STATES,
    CycleDriver,
    random_settings,
)
from thermaxis.compensation import (
    Compensation,
    CompensationModel,
    Limits,
    Outcome,
    Output,
    Part,
    Reason,
    SampleQuality,
    Section,
    SensorRules,
    SupervisorState,
)
from thermaxis.files import read_model
from thermaxis.plc import (
    PlcInputs,
    PlcOutputs,
    PlcSettings,
    Twin,
    export_settings,
    scenario,
    scenario_steps,
)
from thermaxis.plc.twin._model import LagTwin
from thermaxis.plc.twin._numbers import to_double, to_single
from thermaxis.plc.twin._twin import LAST_BEAT
from thermaxis.plc.vectors._scenario import course_steps

MODELS = Path(__file__).parents[3] / "examples" / "models"
CANNOT_OCCUR = {
    *(2 ** OUTCOMES.index(o) for o in (Outcome.CLOCK_BACKWARD, Outcome.CLOCK_STILL)),
    *(2 ** OUTCOMES.index(o) for o in (Outcome.GAP, Outcome.STATE_UNUSABLE)),
    2 ** OUTCOMES.index(Outcome.DIAMETER_UNKNOWN),
}


def first_difference(settings: PlcSettings, hours: float, seed: int) -> str:
    driver = CycleDriver(settings)
    steps = scenario_steps(settings, hours=hours, seed=seed)
    for call, (inputs, outputs) in enumerate(steps):
        said = driver.said(inputs)
        if said != outputs:
            return f"call {call}: {inputs} gives {outputs}, cycle says {said}"
    return ""


@pytest.mark.parametrize("seed", range(8))
def test_the_twin_says_what_cycle_says_bit_for_bit(seed: int) -> None:
    assert first_difference(random_settings(seed), 0.6, seed) == ""


@pytest.mark.parametrize(("seed", "cycle_s"), [(25, 10.0), (27, 10.0), (40, 0.5), (41, 0.125)])
def test_the_twin_says_what_cycle_says_at_every_cycle_that_is_exact(
    seed: int, cycle_s: float
) -> None:
    assert first_difference(random_settings(seed, cycle_s=cycle_s), 0.2 * cycle_s, seed) == ""


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
    assert outcomes == 2 ** len(OUTCOMES) - 1 - sum(CANNOT_OCCUR)
    never = {"SPARE", "OLD", "NO_TIME_STAMP", "DISAGREES"}
    assert qualities == {k for k, q in enumerate(SAMPLE_QUALITIES) if q.name not in never}
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


def test_an_offset_outside_its_total_stays_and_lets_nobody_enable() -> None:
    settings = random_settings(2)
    calm = calm_inputs(settings)
    twin = Twin(settings)
    large = (2.0 * settings.compensation.bounds[0].total_um,)
    twin.step(calm._replace(read_um=large))
    said = twin.step(calm._replace(read_um=large, enable=True))
    assert (said.correction_um, said.state, said.refused) == (large, 0, True)
    for _ in range(50):
        said = twin.step(calm._replace(read_um=large, enable=True))
    assert (said.correction_um, said.state) == (large, 0)


def test_an_offset_that_was_changed_in_off_is_taken_over_before_the_requests_of_a_call() -> None:
    settings = random_settings(2)
    calm = calm_inputs(settings)
    twin, driver = Twin(settings), CycleDriver(settings)
    large = (2.0 * settings.compensation.bounds[0].total_um,)
    there, gone = calm._replace(read_um=large), calm._replace(read_um=(0.0,))
    small = calm._replace(read_um=(2.0,))
    steps = [
        (there, large, False),
        (there._replace(enable=True), large, True),
        (gone._replace(read_ok=False), large, False),
        (gone._replace(connected=False), large, False),
        (gone, (0.0,), False),
        (there, large, False),
        (small._replace(reset=True), (2.0,), False),
        (gone._replace(reset=True), (0.0,), False),
        (there, large, False),
        (small._replace(enable=True), (2.0,), False),
    ]
    for call, (inputs, correction_um, refused) in enumerate(steps):
        said = twin.step(inputs)
        assert (said.correction_um, said.refused) == (correction_um, refused), call
        assert driver.said(inputs) == said
    states = {twin.step(small._replace(enable=True)).state for _ in range(10)}
    assert STATES.index(SupervisorState.ACTIVE) in states


def test_who_steps_along_with_the_twin_can_ask_whether_it_takes_an_offset_over() -> None:
    settings = random_settings(2)
    calm = calm_inputs(settings)
    pressed, twin = calm._replace(reset=True), Twin(settings)
    for nothing in ({"connected": False}, {"read_ok": False}, {"read_um": (math.nan,)}):
        for _ in range(2):
            unread = calm._replace(**nothing)
            assert not twin.takes_over(unread)
            assert not twin.step(unread).linked
            assert twin.takes_over(calm)
            assert twin.step(calm).linked  # in Off it is read in every call
    assert twin.takes_over(calm._replace(restart=True))
    twin.step(calm._replace(enable=True))
    assert not twin.takes_over(calm)
    assert not twin.takes_over(pressed)
    assert not twin.step(calm._replace(enable=True, connected=False)).linked
    assert not twin.takes_over(pressed._replace(connected=False))
    assert twin.takes_over(calm)


def calm_inputs(settings: PlcSettings) -> PlcInputs:
    first = next(iter(course_steps(settings, seed=0))).inputs
    return first._replace(cycle_time_s=settings.cycle_s, enable=False)


def test_the_heartbeat_counts_on_and_begins_again() -> None:
    settings = one_lag_settings(0.0, 1.0, 10.0, double=True)
    twin, calm = Twin(settings), calm_inputs(settings)
    beats = [twin.step(calm).heartbeat for _ in range(LAST_BEAT + 3)]
    assert beats == [*range(1, LAST_BEAT + 1), 0, 1, 2]


def test_a_trim_that_is_no_number_is_refused_in_every_call() -> None:
    settings = one_lag_settings(0.0, 1.0, 10.0, double=True)
    twin, calm = Twin(settings), calm_inputs(settings)
    assert not twin.step(calm).refused
    odd = calm._replace(trims_um=(math.nan,))
    assert [twin.step(odd).refused for _ in range(3)] == [True] * 3
    assert not twin.step(calm).refused


def test_the_same_seed_gives_the_same_scenario_and_another_one_does_not() -> None:
    settings = random_settings(3)
    assert repr(list(scenario(settings, 0.6, 5))) == repr(list(scenario(settings, 0.6, 5)))
    assert repr(list(scenario(settings, 0.6, 5))) != repr(list(scenario(settings, 0.6, 6)))


# ---- REAL ---------------------------------------------------------------------------------------


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


def test_every_number_of_the_twin_in_real_is_one_of_binary32() -> None:
    for _, said in scenario_steps(random_settings(11, double=False), hours=0.2, seed=1):
        numbers = (*said.correction_um, *said.model_um, *said.wanted_um, *said.weight)
        for number in (*numbers, *said.parts_um):
            assert number == to_single(number)


@pytest.mark.parametrize("tau_s", [7200.0, 36_000.0])
def test_a_plain_increment_in_real_stalls_where_the_law_says(tau_s: float) -> None:
    alpha = -math.expm1(-1.0 / tau_s)
    lag = LagTwin(1.0, tau_s, to_single, compensated=False)
    lag.begin(9.0)
    before = -1.0
    while lag.x != before:
        before = lag.x
        lag.advance(10.0)
    stall_k = float(np.spacing(np.float32(lag.x))) / (2.0 * alpha)
    assert 10.0 - lag.x == pytest.approx(stall_k, rel=0.01)


def test_the_slow_section_of_the_paper_would_rest_a_fifth_of_a_micrometre_early() -> None:
    section = paper_model("eps2").layout.parts[0].sections[0]
    rest_um: list[float] = []
    for compensated in (False, True):
        lag = LagTwin(1.0, section.time_constant_s, to_single, compensated=compensated)
        lag.begin(8.9)
        for _ in range(400_000):
            lag.advance(9.0)
        rest_um.append(abs(section.gain_um_per_k * (9.0 - lag.x)))
    print(f"eps2 at 9 K: plain {rest_um[0]:.3f} um, compensated {rest_um[1]:.1e} um")
    assert rest_um[0] == pytest.approx(0.22, abs=0.02)
    assert rest_um[1] < 2e-5


@pytest.mark.parametrize("tau_s", [7200.0, 36_000.0])
def test_a_compensated_increment_in_real_does_not_stall(tau_s: float) -> None:
    single = LagTwin(1.0, tau_s, to_single, compensated=True)
    double = LagTwin(1.0, tau_s, to_double, compensated=False)
    single.begin(9.0)
    double.begin(9.0)
    largest_k = 0.0
    for _ in range(60_000):
        single.advance(10.0)
        double.advance(10.0)
        largest_k = max(largest_k, abs(single.x - double.x))
    assert largest_k < 1.5e-6


def one_lag_settings(
    direct: float, gain: float, tau_s: float, *, double: bool, reference_c: float | None = None
) -> PlcSettings:
    part = Part("spindle", "s", "", direct, (Section(gain, tau_s),))
    model = CompensationModel(outputs=(Output("Z_um", (part,)),))
    return wide(model, double=double)


def wide(model: CompensationModel, *, double: bool) -> PlcSettings:
    """Limits that the course never meets, so that the correction is minus the model."""
    compensation = Compensation(
        model=model,
        sensors={c: SensorRules(lowest_c=1.0, highest_c=80.0) for c in model.channels},
        limits={o.name: Limits(5000.0, 500.0) for o in model.outputs},
        interlocks=("plc",),
    )
    return export_settings(compensation, cycle_s=1.0, name="axis", double=double)


def largest_difference_um(model: CompensationModel, *, compensated: bool) -> tuple[float, float]:
    """Return how far REAL is from LREAL in 8 h at 1 s, and the span of the correction."""
    single = Twin(wide(model, double=False))
    if not compensated:
        make_plain(single)
    largest_um = highest_um = lowest_um = 0.0
    steps = scenario_steps(wide(model, double=True), hours=8.0, seed=1, faults=False)
    active = 0
    for inputs, wanted in steps:
        said = single.step(inputs)
        assert said[7:] == wanted[7:]
        active += wanted.state == 2
        largest_um = max(largest_um, abs(said.correction_um[0] - wanted.correction_um[0]))
        highest_um = max(highest_um, wanted.correction_um[0])
        lowest_um = min(lowest_um, wanted.correction_um[0])
    assert active > 28_000
    return largest_um, highest_um - lowest_um


@pytest.mark.parametrize("name", ["eps1", "eps2"])
def test_real_stays_within_two_nanometres_of_lreal_for_the_models_of_the_paper(name: str) -> None:
    model = paper_model(name)
    assert [len(part.sections) for part in model.layout.parts] == [1]
    largest_um, span_um = largest_difference_um(model, compensated=True)
    plain_um, _ = largest_difference_um(model, compensated=False)
    print(f"{name}: {largest_um:.2e} um of {span_um:.1f} um, plain {plain_um:.2e} um")
    assert span_um > 10.0
    assert 0.0 < largest_um < 0.002


@pytest.mark.parametrize(("name", "plain_um"), [("eps1", 0.02), ("eps2", 0.0001)])
def test_at_constant_temperatures_only_the_compensated_section_in_real_reaches_its_end(
    name: str, plain_um: float
) -> None:
    model = paper_model(name)
    kept, plain = (largest_after_a_step_um(model, compensated=c) for c in (True, False))
    print(f"{name}: compensated {kept:.2e} um, plain {plain:.2e} um, eight hours after a step")
    assert kept < 0.0002
    assert plain > plain_um


def largest_after_a_step_um(model: CompensationModel, *, compensated: bool) -> float:
    """Return how far REAL is from LREAL while one temperature rises by 9 K and then stands."""
    single, double = (Twin(wide(model, double=kind)) for kind in (False, True))
    if not compensated:
        make_plain(single)
    calm = calm_inputs(wide(model, double=True))
    largest_um = 0.0
    for call in range(28_800):
        rise_k = 0.09 * min(call, 100)
        # A count of the sensor to and fro: a value that does not change at all is not believed.
        count_k = 0.005 * (call // 7200 % 2)
        temperatures_c = (20.0 + rise_k + count_k, 20.0)
        inputs = calm._replace(temperatures_c=temperatures_c, enable=call > 0)
        pair = [twin.step(inputs).model_um[0] for twin in (single, double)]
        largest_um = max(largest_um, abs(pair[0] - pair[1]))
    return largest_um


def make_plain(twin: Twin) -> None:
    for part in twin._model._parts:
        for section in part.sections:
            section._compensated = False


def paper_model(name: str) -> CompensationModel:
    return read_model(MODELS / f"{name}.json")


@pytest.mark.parametrize("double", [True, False])
def test_a_shift_of_a_model_of_eight_sections_takes_less_than_ten_seconds(double: bool) -> None:
    sections = tuple(Section(2.0 + k, 30.0 * 3.0**k) for k in range(8))
    part = Part("spindle", "s", "", 1.0, sections)
    settings = wide(CompensationModel(outputs=(Output("Z_um", (part,)),)), double=double)
    twin, calm = Twin(settings), calm_inputs(settings)
    begin_s = time.process_time()
    for _ in range(2880):
        twin.step(calm)
    assert 10.0 * (time.process_time() - begin_s) < 10.0


def test_the_outputs_tell_apart_a_compensation_that_differs_in_one_number() -> None:
    settings = random_settings(4)
    compensation = settings.compensation
    name = compensation.model.outputs[0].name
    limits = dict(compensation.limits)
    limits[name] = replace(limits[name], largest_rate_um_per_s=0.3)
    other = replace(settings, compensation=replace(compensation, limits=limits))
    twin = Twin(other)
    said: list[PlcOutputs] = [twin.step(i) for i in scenario(settings, 0.3, 1)]
    wanted = [step.outputs for step in scenario_steps(settings, hours=0.3, seed=1)]
    assert said != wanted


def test_the_judgement_of_a_sensor_forgets_what_was_frozen_when_it_is_acknowledged() -> None:
    settings = random_settings(25, cycle_s=10.0)
    frozen = SAMPLE_QUALITIES.index(SampleQuality.FROZEN)
    twin, calm = Twin(settings), calm_inputs(settings)
    seen = [twin.step(calm).qualities for _ in range(60)]
    assert any(frozen in qualities for qualities in seen)
    assert frozen not in twin.step(calm._replace(reset=True)).qualities
