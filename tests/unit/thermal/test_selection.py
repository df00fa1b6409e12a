"""Choice of temperatures and lags: laws, known answers and sensors that cannot be trusted."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from tests.refusals import refused
from thermaxis.codes import Message
from thermaxis.thermal import (
    Experiment,
    InputDefinition,
    ModalPart,
    SelectionOptions,
    SelectionResult,
    ThermalLog,
    ThermalModel,
    faulty_candidates,
    select,
    sensor_noise_k,
    simulate_modal,
)
from thermaxis.thermal.selection._bank import banks_of, record_parts
from thermaxis.thermal.selection._validation import Split, Structure, splits_of, validation_of

Array = NDArray[np.float64]
STEP_S = 30.0
ROWS = 2880
"""One day."""
NAMES = ("spindle", "bearing", "column", "bed", "hall")
EXACT = SelectionOptions(sensor_uncertainties_k=(1e-7,), lag_sets_s=((1200.0,),))
TRUTH = ThermalModel(
    tuple(
        ModalPart(name, direct, np.array([gain]), np.array([1200.0]))
        for name, direct, gain in zip(
            NAMES, (2.0, -1.0, 0.5, 0.0, 3.0), (4.0, 6.0, -2.0, 1.0, 0.5), strict=True
        )
    )
)


def temperatures(seed: int, noise_k: float = 0.0, rows: int = ROWS) -> Array:
    """Return five warm-ups and cool-downs that start at rest."""
    rng = np.random.default_rng(seed)
    found = []
    for lag_s in (900.0, 1500.0, 4000.0, 8000.0, 15000.0):
        power = np.repeat(rng.uniform(0.0, 10.0, rows // 120 + 1), 120)[:rows]
        alpha = -np.expm1(-STEP_S / lag_s)
        found.append(lfilter([0.0, alpha], [1.0, alpha - 1.0], power))
    return np.column_stack(found) + noise_k * rng.normal(size=(rows, 5))


def experiment(seed: int = 1, noise_um: float = 0.0, noise_k: float = 0.0) -> Experiment:
    u = temperatures(seed)
    y = simulate_modal(TRUTH, STEP_S, u)
    rng = np.random.default_rng(seed + 1000)
    return Experiment(
        STEP_S,
        u + noise_k * rng.normal(size=u.shape),
        y + noise_um * rng.normal(size=y.size),
        f"day {seed}",
    )


def gains_of(result: SelectionResult, output: str = "displacement") -> dict[str, Array]:
    return {
        part.input_name: np.concatenate([[part.direct_gain], part.gains])
        for part in result.outputs[output].model.parts
    }


def assert_same_gains(a: dict[str, Array], b: dict[str, Array], rtol: float = 1e-9) -> None:
    assert set(a) == set(b)
    for name, gains in a.items():
        np.testing.assert_allclose(gains, b[name], rtol=rtol, atol=rtol)


TRUE_GAINS = {p.input_name: np.array([p.direct_gain, *p.gains]) for p in TRUTH.parts}


def test_a_record_without_noise_gives_the_model_back() -> None:
    result = select([experiment()], candidate_names=NAMES, options=EXACT)
    assert_same_gains(gains_of(result), TRUE_GAINS, 1e-6)
    assert result.time_constants_s == (1200.0,)
    assert result.stable


def test_the_default_search_follows_another_day() -> None:
    result = select([experiment(1, 0.3, 0.02)], candidate_names=NAMES)
    other = experiment(2)
    columns = [NAMES.index(part.input_name) for part in result.model.parts]
    error = other.y - simulate_modal(result.model, STEP_S, other.u[:, columns])
    assert float(np.mean(np.abs(error))) < 0.05 * float(np.std(other.y))


def test_gains_are_those_of_least_squares_with_the_uncertainty_as_further_rows() -> None:
    own = experiment(3, 0.5)
    uncertainty_k, rows = 0.2, 10
    options = SelectionOptions(
        sensor_uncertainties_k=(uncertainty_k,), lag_sets_s=((600.0,),), mean_s=rows * STEP_S
    )
    result = select([own], candidate_names=NAMES, options=options)
    lagged = np.column_stack(
        [
            lfilter([0.0, a := -np.expm1(-STEP_S / 600.0)], [1.0, a - 1.0], u - u[0]) + u[0]
            for u in own.u.T
        ]
    )
    regressors = np.hstack([own.u, lagged]).reshape(-1, rows, 10).mean(axis=1)
    displacement = own.y.reshape(-1, rows).mean(axis=1)
    noise = np.concatenate([sensor_noise_k([own]), np.zeros(5)])
    price = np.diag(np.sqrt(regressors.shape[0] * (uncertainty_k**2 + noise**2)))
    gains, *_ = np.linalg.lstsq(
        np.vstack([regressors, price]), np.concatenate([displacement, np.zeros(10)])
    )
    expected = {name: gains[[i, i + 5]] for i, name in enumerate(NAMES)}
    assert_same_gains(gains_of(result), expected, 1e-7)


def test_errors_on_parts_held_out_are_those_of_models_fitted_without_them() -> None:
    own = experiment(4, 0.5)
    parts = record_parts([own], 4)
    banks = banks_of({"z": [own]}, range(5), np.array([600.0, 2400.0]), 300.0, parts)
    validation = validation_of(banks, 4, np.zeros(5), np.array([0.1, 0.3]))
    errors = validation.errors(Structure(lags=(1,), channels=(0, 2), offset=True))
    bank = banks[0]
    chosen = bank.regressors[:, [0, 2, 10, 12, 15]]
    for j, split in enumerate(splits_of(4)):
        learn = np.isin(bank.part, split.learn)
        judge = bank.part == split.judge
        for i, uncertainty in enumerate((0.1, 0.3)):
            price = np.diag(np.sqrt(learn.sum()) * np.array([uncertainty] * 4 + [0.0]))
            gains, *_ = np.linalg.lstsq(
                np.vstack([chosen[learn], price]),
                np.concatenate([bank.displacement[learn, 0], np.zeros(5)]),
            )
            residual = chosen[judge] @ gains - bank.displacement[judge, 0]
            assert errors[i, j, 0] == pytest.approx(float(np.mean(np.abs(residual))), rel=1e-8)


def test_each_part_is_held_out_and_the_later_half_also_from_the_past_alone() -> None:
    found = splits_of(5)
    assert found[:5] == tuple(Split(tuple(j for j in range(5) if j != i), i) for i in range(5))
    assert found[5:] == (Split((0, 1), 2), Split((0, 1, 2), 3), Split((0, 1, 2, 3), 4))


def test_the_average_is_the_weighted_sum_of_the_models_it_is_made_of() -> None:
    own = experiment(5, 1.0, 0.03)
    whole = select([own], candidate_names=NAMES)
    total = {name: np.zeros(1 + len(whole.time_constants_s)) for name in NAMES}
    for structure in whole.structures:
        single = select(
            [own],
            candidate_names=NAMES,
            options=SelectionOptions(
                lag_sets_s=(structure.time_constants_s,),
                sensor_uncertainties_k=(structure.sensor_uncertainty_k,),
            ),
        )
        places = [0] + [1 + whole.time_constants_s.index(t) for t in structure.time_constants_s]
        for name, gains in gains_of(single).items():
            total[name][places] += structure.weight * gains
    assert_same_gains(gains_of(whole), total)


def test_weights_are_scores_to_the_power_of_minus_the_parts() -> None:
    result = select([experiment(6, 2.0, 0.05)], candidate_names=NAMES)
    kept = [s for s in result.structures if s.weight > 0]
    assert len(kept) > 1
    assert sum(s.weight for s in kept) == pytest.approx(1.0)
    for s in kept[1:]:
        ratio = (s.score / kept[0].score) ** -5.0
        assert s.weight / kept[0].weight == pytest.approx(ratio, rel=1e-9)
    assert min(s.excess for s in result.structures) == 0.0


def test_unit_clock_and_order_change_the_gains_as_they_must_and_nothing_else() -> None:
    own = experiment(7, 0.5, 0.02)
    plain = select([own], candidate_names=NAMES)
    scaled = select([Experiment(STEP_S, own.u, 1e3 * own.y)], candidate_names=NAMES)
    assert_same_gains({k: 1e3 * v for k, v in gains_of(plain).items()}, gains_of(scaled), 1e-7)
    slow = select(
        [Experiment(10.0 * STEP_S, own.u, own.y)],
        candidate_names=NAMES,
        options=SelectionOptions(shortest_lag_s=3000.0, mean_s=3000.0),
    )
    np.testing.assert_allclose(slow.time_constants_s, 10.0 * np.array(plain.time_constants_s))
    assert_same_gains(gains_of(plain), gains_of(slow), 1e-7)
    order = [3, 0, 4, 1, 2]
    turned = select(
        [Experiment(STEP_S, own.u[:, order], own.y)], candidate_names=[NAMES[i] for i in order]
    )
    assert_same_gains(gains_of(plain), gains_of(turned), 1e-7)
    assert plain.channels == scaled.channels == slow.channels == turned.channels


def test_outputs_of_one_call_share_time_constants_and_have_their_own_gains() -> None:
    first, second = experiment(10, 0.5), experiment(10, 0.5)
    other = Experiment(STEP_S, second.u, -3.0 * second.y)
    both = select({"z": [first], "x": [other]}, candidate_names=NAMES)
    assert list(both.outputs) == ["z", "x"]
    z, x = gains_of(both, "z"), gains_of(both, "x")
    assert_same_gains({k: -3.0 * v for k, v in z.items()}, x, 1e-7)
    with refused("several_outputs"):
        _ = both.model


def test_outputs_measured_in_other_rows_are_learned_from_their_own_rows() -> None:
    own = experiment(12)
    seldom = own.y.copy()
    seldom[np.arange(ROWS) % 37 != 0] = np.nan
    outputs = {"z": [own], "x": [Experiment(STEP_S, own.u, seldom)]}
    both = select(outputs, candidate_names=NAMES, options=EXACT)
    for name in outputs:
        assert_same_gains(gains_of(both, name), TRUE_GAINS, 1e-5)


def test_missing_temperatures_are_bridged() -> None:
    own = experiment(13)
    u = own.u.copy()
    u[np.random.default_rng(1).random(u.shape) < 0.05] = np.nan
    result = select([Experiment(STEP_S, u, own.y)], candidate_names=NAMES, options=EXACT)
    for part in TRUTH.parts:
        assert gains_of(result)[part.input_name].sum() == pytest.approx(part.dc_gain, abs=0.05)


def test_several_days_are_learned_from_at_once() -> None:
    days = [experiment(seed) for seed in (14, 15, 16)]
    result = select(days, candidate_names=NAMES, options=EXACT)
    assert {part.experiment for part in result.parts} == {0, 1, 2}
    assert_same_gains(gains_of(result), TRUE_GAINS, 1e-6)


def test_an_experiment_shorter_than_a_part_is_a_part_of_its_own() -> None:
    long = experiment(17)
    short = Experiment(STEP_S, long.u[:200], long.y[:200])
    parts = record_parts([long, short], 5)
    assert [p.experiment for p in parts] == [0, 0, 0, 0, 0, 1]
    assert parts[-1].duration_s == pytest.approx(200 * STEP_S)
    assert sum(p.duration_s for p in parts) == pytest.approx(long.duration_s + 200 * STEP_S)


def test_repeating_the_last_displacement_is_judged_on_the_same_parts() -> None:
    y = np.arange(ROWS, dtype=np.float64)
    own = Experiment(STEP_S, temperatures(18), y)
    result = select([own], candidate_names=NAMES, options=SelectionOptions(mean_s=STEP_S))
    part = ROWS // 5
    first, later = np.mean(y[:part]), (part + 1) / 2
    expected = (first + 4 * later + 3 * later) / 8
    hold = result.outputs["displacement"].baseline_mae_um["hold"]
    assert hold == pytest.approx(float(expected))


def test_a_static_machine_gets_no_lags_worth_speaking_of() -> None:
    u = temperatures(19)
    rng = np.random.default_rng(19)
    own = Experiment(STEP_S, u, u @ [3.0, 0.0, -2.0, 1.0, 4.0] + 0.1 * rng.normal(size=ROWS))
    result = select([own], candidate_names=NAMES)
    for part, direct in zip(
        sorted(result.model.parts, key=lambda p: NAMES.index(p.input_name)),
        (3.0, 0.0, -2.0, 1.0, 4.0),
        strict=True,
    ):
        assert part.dc_gain == pytest.approx(direct, abs=0.3)
        assert float(np.sum(np.abs(part.gains))) < 0.6
    output = result.outputs["displacement"]
    assert output.validation_mae_um < 2.0 * output.baseline_mae_um["static"]


def test_the_most_useful_channels_come_first_and_the_fewest_can_be_asked_for() -> None:
    u = temperatures(20, 0.02)
    rng = np.random.default_rng(20)
    own = Experiment(STEP_S, u, u @ [0.0, 8.0, 0.0, 5.0, 0.0] + 0.5 * rng.normal(size=ROWS))
    every = select([own], candidate_names=NAMES)
    assert set(every.channels) == set(NAMES)
    assert set(every.curve[1].channels) == {"bearing", "bed"}
    assert [len(point.channels) for point in every.curve] == [1, 2, 3, 4, 5]
    fewest = select([own], candidate_names=NAMES, options=SelectionOptions(fewest_channels=True))
    assert set(fewest.channels) >= {"bearing", "bed"}
    assert len(fewest.channels) < 5
    two = select([own], candidate_names=NAMES, options=SelectionOptions(most_channels=2))
    assert set(two.channels) == {"bearing", "bed"}
    assert [p.input_name for p in two.model.parts] == list(two.channels)
    kept = Message("rule-some_kept", {"kept": 2, "healthy": 5})
    assert two.rule.values["channels"] == kept


def frozen(u: Array, column: int, rows: slice) -> Array:
    broken = u.copy()
    broken[rows, column] = broken[rows.start, column]
    return broken


def faulty(u: Array) -> tuple[str, ...]:
    columns = {f"{name}_c": 20.0 + u[:, k] for k, name in enumerate(NAMES)}
    log = ThermalLog.from_columns(columns, sample_time_s=STEP_S)
    return faulty_candidates([log], [InputDefinition(name, f"{name}_C") for name in NAMES])


def test_a_candidate_frozen_in_the_middle_is_found_and_left_out() -> None:
    own = experiment(21, 0.3, 0.01)
    for column, name in enumerate(NAMES):
        assert faulty(frozen(own.u, column, slice(1000, 1800))) == (name,)
    options = SelectionOptions(faulty=(NAMES[-1],))
    result = select([own], candidate_names=NAMES, options=options)
    assert set(result.channels) == set(NAMES[:-1])
    assert {part.input_name for part in result.model.parts} == set(NAMES[:-1])


def test_a_coarse_sensor_that_comes_back_with_a_jump_was_stuck() -> None:
    u = np.round(temperatures(22, 0.02), 1)
    assert abs(u[1800, 0] - u[1000, 0]) > 0.3
    assert faulty(frozen(u, 0, slice(1000, 1800))) == ("spindle",)


def test_coarse_sensors_single_spikes_and_jumps_all_the_time_are_no_faults() -> None:
    rng = np.random.default_rng(37)
    spikes = temperatures(29, 0.01)
    spikes[700, 0] += 3.0
    spikes[700, 3] -= 3.0
    jumps = np.repeat(rng.normal(0.0, 2.0, (ROWS // 40, 5)), 40, axis=0)
    jumps += 0.01 * rng.normal(size=jumps.shape)
    coarse = np.round(temperatures(24, 0.01), 1)
    for u in (coarse, temperatures(25, 0.05), spikes, jumps):
        assert faulty(u) == ()


def test_channels_that_never_change_or_are_mostly_missing_are_no_candidates() -> None:
    u = temperatures(26, 0.01)
    u[:, 2] = 4.5
    u[500:1500, 3] = np.nan
    assert faulty(u) == ("column", "bed")


def test_a_channel_that_rests_in_one_log_of_two_is_a_candidate() -> None:
    moving, resting = (
        ThermalLog.from_columns({"spindle_c": v}, sample_time_s=STEP_S)
        for v in (temperatures(27, 0.01)[:, 0], np.full(ROWS, 20.0))
    )
    candidate = [InputDefinition("spindle", "spindle_c")]
    assert faulty_candidates([moving, resting], candidate) == ()
    assert faulty_candidates([resting, resting], candidate) == ("spindle",)


def test_two_exchanged_sensors_are_both_found() -> None:
    u = temperatures(28, 0.01)
    row = int(np.argmax(np.abs(u[500:2500, 0] - u[500:2500, 3]))) + 500
    u[row:, [0, 3]] = u[row:, [3, 0]]
    assert faulty(u) == ("spindle", "bed")


def test_a_noisy_sensor_stays_but_its_direct_gain_is_held_back() -> None:
    rng = np.random.default_rng(30)
    clean = temperatures(30, 0.005)
    y = temperatures(30) @ np.full(5, 3.0) + 0.1 * rng.normal(size=ROWS)
    noisy = clean.copy()
    noisy[:, 1] += 2.0 * rng.normal(size=ROWS)
    options = SelectionOptions(lag_sets_s=((1200.0,),), sensor_uncertainties_k=(0.05,))
    a = select([Experiment(STEP_S, clean, y)], candidate_names=NAMES, options=options)
    b = select([Experiment(STEP_S, noisy, y)], candidate_names=NAMES, options=options)
    assert faulty(noisy) == ()
    assert abs(gains_of(b)["bearing"][0]) < 0.5 * abs(gains_of(a)["bearing"][0])


def test_the_noise_of_a_sensor_is_found_beside_its_changes() -> None:
    for noise_k in (0.005, 0.05, 0.3):
        own = Experiment(STEP_S, temperatures(31, noise_k), np.arange(ROWS, dtype=np.float64))
        np.testing.assert_allclose(sensor_noise_k([own]), noise_k, rtol=0.1)


def test_channels_that_move_together_and_act_against_each_other_are_flagged() -> None:
    u = temperatures(32, 0.0)
    twin = u[:, 0] + 0.05 * u[:, 1]
    both = np.column_stack([u[:, 0], twin, u[:, 2]])
    options = SelectionOptions(sensor_uncertainties_k=(1e-4,), lag_sets_s=((),))
    own = Experiment(STEP_S, both, both @ [9.0, -8.0, 1.0])
    result = select([own], candidate_names=("a", "twin", "c"), options=options)
    flags = {flag.code: flag for flag in result.outputs["displacement"].flags}
    flag = flags["warning-inputs_opposed"]
    assert {flag.values["first"], flag.values["second"]} == {"a", "twin"}
    held = SelectionOptions(sensor_uncertainties_k=(0.8,), lag_sets_s=((),))
    calm = select([own], candidate_names=("a", "twin", "c"), options=held)
    strongest = [
        max(abs(p.dc_gain) for p in r.model.parts if p.input_name != "c") for r in (result, calm)
    ]
    assert strongest[1] < 0.5 * strongest[0]


def test_temperatures_that_explain_nothing_are_said_to() -> None:
    walk = np.cumsum(np.random.default_rng(33).normal(size=ROWS)) * 0.5
    result = select([Experiment(STEP_S, temperatures(33, 0.01), walk)], candidate_names=NAMES)
    own = result.outputs["displacement"]
    small = "warning-gains_held_small" in {w.code for w in result.warnings}
    assert small or own.baseline_mae_um["hold"] < own.validation_mae_um


def test_a_short_record_says_that_slow_things_were_not_judged() -> None:
    own = experiment(34, 0.1, 0.01)
    short = Experiment(STEP_S, own.u[:240], own.y[:240])
    result = select([short], candidate_names=NAMES)
    assert Message("warning-parts_short", {"duration_min": 24.0}) in result.warnings
    assert 0 < max(result.time_constants_s) <= short.duration_s / 8


def wrong_calls() -> Sequence[tuple[str, Callable[[], object]]]:
    own = experiment(35, 0.1, 0.01)
    none_left = SelectionOptions(faulty=NAMES)
    flat = Experiment(STEP_S, own.u, np.full(ROWS, 2.0))
    other = Experiment(STEP_S, own.u + 1.0, own.y)
    once = own.y.copy()
    once[100:] = np.nan
    return (
        ("no_healthy_candidate", lambda: select([own], candidate_names=NAMES, options=none_left)),
        ("displacement_constant", lambda: select([flat], candidate_names=NAMES)),
        ("count_not_inputs", lambda: select([own], candidate_names=("a",) * 5)),
        ("count_not_inputs", lambda: select([own], candidate_names=NAMES[:4])),
        ("inputs_not_shared", lambda: select({"z": [own], "x": [other]}, candidate_names=NAMES)),
        ("no_output", lambda: select({}, candidate_names=NAMES)),
        ("no_log", lambda: select([], candidate_names=NAMES)),
        (
            "measured_in_one_part",
            lambda: select([Experiment(STEP_S, own.u, once)], candidate_names=NAMES),
        ),
    )


def test_what_cannot_be_selected_from_is_refused_with_the_reason() -> None:
    for words, call in wrong_calls():
        with refused(words):
            call()


def test_options_out_of_range_are_refused() -> None:
    for code, options in (
        ("not_positive", {"sensor_uncertainties_k": ()}),
        ("not_positive", {"sensor_uncertainties_k": (0.0,)}),
        ("too_few_parts", {"parts": 1}),
        ("not_positive", {"mean_s": 0.0}),
        ("not_positive", {"shortest_lag_s": -1.0}),
        ("not_positive", {"most_channels": 0}),
        ("no_lag_sets", {"lag_sets_s": ()}),
        ("no_lag_sets", {"lag_sets_s": ((0.0,),)}),
    ):
        with refused(code):
            SelectionOptions(**options)


def test_a_displacement_at_the_reference_is_learned_only_on_request() -> None:
    own = experiment(36)
    shifted = Experiment(STEP_S, own.u, own.y + 7.0)
    options = SelectionOptions(sensor_uncertainties_k=(1e-6,), lag_sets_s=((1200.0,),), offset=True)
    result = select([shifted], candidate_names=NAMES, options=options)
    assert result.model.offset_um == pytest.approx(7.0, abs=1e-4)
    assert select([shifted], candidate_names=NAMES).model.offset_um == 0.0
