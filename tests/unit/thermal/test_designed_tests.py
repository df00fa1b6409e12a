"""Thermal tests that are designed: closed forms, a second way, the optimum of a tiny problem."""

from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

from thermaxis.compensation import CompensationModel, Output, Part, Section
from thermaxis.errors import ConfigurationError
from thermaxis.thermal import (
    Experiment,
    FloatArray,
    HeatingConditions,
    HeatSource,
    KnownModel,
    LagRange,
    ReadingNoise,
    SourceSwitch,
    SwitchKind,
    UseSpectrum,
    Wanted,
    best_places,
    planned,
    prior_of,
    reached,
)
from thermaxis.thermal.design import (
    CustomaryTest,
    GainsPrior,
    allowed,
    by_duration_um,
    customary,
    customary_um,
    designed,
    exchanged,
    foresight,
    foresight_of,
    noise_covariance,
    pulses,
    random_sequence,
    spectra_of_use,
)

TWO = HeatingConditions(sources={"spindle": HeatSource(), "table": HeatSource()})
SHORT = replace(
    TWO,
    sources={name: HeatSource(rise_min=(10.0, 10.0)) for name in ("spindle", "table")},
    use=UseSpectrum(hours=2.0),
)


def one_gain(place: int, tau_s: float = 1200.0, std_um: float = 5.0) -> GainsPrior:
    """A source of which the direct gain alone, or that of one lag, is not known."""
    factor = np.zeros((2, 1))
    factor[place] = std_um
    return GainsPrior(np.array([tau_s]), np.zeros(2), factor)


@pytest.mark.parametrize("place", [0, 1])
def test_the_information_of_one_gain_is_its_closed_form(place: int) -> None:
    heat, block_s, rows, white = np.array([[1.0], [0.0], [1.0]]), 1800.0, 6, 0.3**2
    prior = one_gain(place)
    found = foresight_of(
        prior, white * np.eye(18), (np.ones((1, 1)),), np.zeros((1, 1)), (3, block_s, rows)
    )
    edges = np.arange(19) * block_s / rows

    def integral(since_s: float) -> FloatArray:  # of 1 - exp(-t / T), T = 1200 s
        t = np.maximum(edges - since_s, 0.0)
        return t if place == 0 else t + 1200.0 * np.expm1(-t / 1200.0)

    answer = integral(0.0) - integral(1800.0) + integral(3600.0)
    means = np.diff(answer) / (block_s / rows)
    expected = 1.0 + 25.0 * float(means @ means) / white
    assert found.informations(heat[None])[0][0, 0, 0] == pytest.approx(expected, rel=1e-9)
    assert found.foreseen_um(heat) == pytest.approx(expected**-0.5, rel=1e-9)
    assert found.settled_um(heat)[0] == pytest.approx(5.0 * expected**-0.5, rel=1e-9)


@pytest.mark.parametrize(("tau_s", "rise_s"), [(700.0, 0.0), (700.0, 900.0), (9000.0, 300.0)])
def test_pulses_are_what_the_differential_equations_say(tau_s: float, rise_s: float) -> None:
    block_s, rows, step_s = 1800.0, 3, 600.0
    found = pulses(3, block_s, rows, np.array([tau_s]), rise_s)
    rise = 1.0 / (rise_s or 1e-3)
    a = np.zeros((5, 5))  # input, lag, their integrals, and what is on
    a[0, [0, 4]], a[1, [0, 1]] = (-rise, rise), (1.0 / tau_s, -1.0 / tau_s)
    a[2, 0] = a[3, 1] = 1.0
    move, state = expm(step_s * a), np.zeros(5)
    for row in range(9):
        state[2:4], state[4] = 0.0, float(3 <= row < 6)
        state = move @ state
        assert found[1, row] == pytest.approx(state[2:4] / step_s, abs=2e-6)


def test_noise_is_relative_to_the_zero_and_the_drift_to_its_begin() -> None:
    times_s = np.array([0.0, 3600.0, 1e7])
    found = noise_covariance(times_s, 0.1, 0.0, 4.0, 3600.0)
    assert found[0, 0] == pytest.approx(0.1)  # it has not drifted yet
    assert found[1, 1] == pytest.approx(0.1 + 8.0 * (1.0 - np.exp(-1.0)))
    assert found[2, 2] == pytest.approx(0.1 + 8.0)
    assert found[1, 2] == pytest.approx(4.0 * (1.0 - np.exp(-1.0)))


def test_what_is_foreseen_is_the_error_of_linear_prediction() -> None:
    prior, blocks, rng = prior_of(SHORT), 6, np.random.default_rng(4)
    found = foresight(SHORT, prior, blocks)
    heat = SHORT.heat(random_sequence(SHORT, blocks, rng))
    f = np.einsum("bs,sbng->nsg", heat, found.whitened[0]).reshape(blocks * 6, -1)
    gains = prior.factor_um @ rng.standard_normal((prior.factor_um.shape[1], 4000))
    y = f @ gains + rng.standard_normal((len(f), 4000))  # whitened
    covariance = prior.factor_um @ prior.factor_um.T
    left = covariance @ f.T @ np.linalg.solve(f @ covariance @ f.T + np.eye(len(f)), y) - gains
    u = spectra_of_use(SHORT, 2)
    used = [pulses(u.shape[1], 300.0, 1, prior.time_constants_s, 600.0)] * 2
    rows = np.concatenate(
        [np.einsum("cb,bng->cng", u[:, :, s], used[s]).reshape(-1, 13) for s in (0, 1)], axis=1
    )
    error = float(np.sqrt(np.mean(np.square(rows @ left))))
    assert found.foreseen_um(heat) == pytest.approx(error, rel=0.03)


def test_more_blocks_never_leave_more() -> None:
    found = foresight(SHORT, prior_of(SHORT), 6)
    heat = SHORT.heat(customary(SHORT, 6)[CustomaryTest.HEAT_AND_COOL])
    course = by_duration_um(found, heat)
    assert np.all(np.diff(course) <= 1e-9)
    assert course[-1] == pytest.approx(found.foreseen_um(heat))


def test_an_exchange_never_worsens() -> None:
    found, rng = foresight(SHORT, prior_of(SHORT), 6), np.random.default_rng(1)
    for _ in range(5):
        begin = random_sequence(SHORT, 6, rng)
        _, value = exchanged(SHORT, found, begin)
        assert value <= found.variances_um2(SHORT.heat(begin)[None])[0]


@pytest.mark.parametrize("limits", [{}, {"cool_min": 30.0}, {"most_at_once": 1}])
def test_the_best_of_all_sequences_of_a_tiny_problem_is_found(limits: dict[str, Any]) -> None:
    conditions = replace(SHORT, **limits)
    found = foresight(conditions, prior_of(conditions), 4)
    every = [np.array(one).reshape(4, 2) for one in product((0, 1), repeat=8)]
    kept = np.stack([one for one in every if allowed(conditions, one)])
    least = float(found.variances_um2(conditions.heat(kept)).min())
    best = designed(conditions, found, 4)
    value = float(found.variances_um2(conditions.heat(best)[None])[0])
    assert value == pytest.approx(least, rel=1e-9)
    assert value < float(np.median(found.variances_um2(conditions.heat(kept))))


def test_limits_are_kept_and_reached() -> None:
    bound = HeatSource(shortest_on_min=60.0, shortest_off_min=60.0, longest_on_min=90.0)
    three = HeatSource(levels=(0.0, 1000.0, 3000.0))
    conditions = replace(
        SHORT, sources={"a": bound, "b": three}, cool_min=60.0, most_at_once=1, block_min=30.0
    )
    found = foresight(conditions, prior_of(conditions), 12)
    best = designed(conditions, found, 12, starts=2)
    assert allowed(conditions, best)
    assert not np.any(best[-2:])
    assert np.all(np.count_nonzero(best, axis=1) <= 1)
    runs = "".join(map(str, best[:, 0])).split("0")
    assert {len(run) for run in runs if run} <= {2, 3}
    too_long = best.copy()
    too_long[:4] = (1, 0)
    assert not allowed(conditions, too_long)
    for cool_min in (361.0, 400.0):  # of 6 h
        with pytest.raises(ConfigurationError, match="No source can run"):
            designed(replace(conditions, cool_min=cool_min), found, 12, starts=1)
    for shortest_min, longest_min in ((60.0, 45.0), (0.0, 10.0)):
        stands = HeatSource(shortest_on_min=shortest_min, longest_on_min=longest_min)
        with pytest.raises(ConfigurationError, match="longest_on_min"):
            replace(conditions, sources={"a": stands})


@pytest.mark.parametrize(
    "stated",
    [
        {"kind": SwitchKind.FUNCTION},
        {"kind": SwitchKind.FUNCTION, "on": 51},
        {"kind": SwitchKind.FUNCTION, "off": 9},
        {"kind": SwitchKind.AXIS, "axis": "X", "to_mm": 410.0},
        {"kind": SwitchKind.AXIS, "axis": "X", "from_mm": 5.0, "to_mm": 5.0},
        {"kind": SwitchKind.AXIS, "from_mm": 5.0, "to_mm": 10.0},
    ],
)
def test_nothing_that_acts_has_a_default(stated) -> None:
    with pytest.raises(ConfigurationError, match="needs"):
        SourceSwitch(**stated)


@pytest.mark.parametrize("seed", range(40))
def test_random_levels_keep_any_limits_and_heat_within_them(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sources = {}
    for name in "abc"[: rng.integers(1, 4)]:
        on_min, off_min, more_min = 20.0 * rng.integers(0, 4, 3)
        longest_min = max(on_min, 20.0) + more_min
        sources[name] = HeatSource((0.0, 1.0, 2.0), (), "", 10.0, 30.0, (5.0, 40.0),
                                   on_min, off_min, longest_min)  # fmt: skip
    conditions = replace(
        SHORT,
        sources=sources,
        block_min=20.0,
        cool_min=20.0 * rng.integers(0, 4),
        most_at_once=int(rng.integers(1, 4)),
    )
    blocks = int(rng.integers(12, 80))
    sequences = [random_sequence(conditions, blocks, rng) for _ in range(10)]
    assert all(allowed(conditions, one) for one in sequences)
    assert sum(one.any() for one in sequences) > 5


def test_a_plan_is_never_worse_than_a_customary_test_of_its_length() -> None:
    plan = planned(SHORT, prior_of(SHORT), 3 * 3600.0)
    assert plan.foreseen_um[-1] <= min(plan.customary_um.values())
    found = foresight(SHORT, prior_of(SHORT), 6)
    assert plan.customary_um == customary_um(SHORT, found, 6)
    again = planned(SHORT, prior_of(SHORT), 3 * 3600.0)
    assert again == plan  # one seed, one plan


def test_steps_of_a_plan_fill_its_time_and_say_when_it_is_enough() -> None:
    plan = planned(replace(SHORT, enough_um=1e5), prior_of(SHORT), 3 * 3600.0)
    ends = [step.begin_s + step.duration_s for step in plan.steps]
    assert [step.begin_s for step in plan.steps] == [0.0, *ends[:-1]]
    assert ends[-1] == plan.duration_s == 3 * 3600.0 + 600.0
    assert plan.enough_s == 600.0 + 1800.0
    assert plan.foreseen_at_um(600.0 + 1799.0) is None
    assert plan.foreseen_at_um(600.0 + 3600.0) == plan.foreseen_um[1]
    assert plan.foreseen_at_um(1e6) == plan.foreseen_um[-1]
    with pytest.raises(ConfigurationError, match="no such level"):
        replace(plan, blocks=((0.5, 0.0), *plan.blocks[1:]))


def test_the_prior_has_the_moments_of_lags_drawn_afresh() -> None:
    conditions = replace(TWO, lags=LagRange(between_min=(5.0, 200.0), number=3))
    prior, rng, n = prior_of(conditions), np.random.default_rng(9), 20_000
    taus_s = 60.0 * np.exp(rng.uniform(np.log(5.0), np.log(200.0), (n, 3)))
    gains = rng.normal(0.0, 15.0, (n, 4))
    for t_s in (600.0, 3600.0, 20_000.0):
        drawn = gains[:, 0] + np.sum(gains[:, 1:] * -np.expm1(-t_s / taus_s), axis=1)
        row = np.append(1.0, -np.expm1(-t_s / prior.time_constants_s))
        by_prior = np.linalg.norm(row @ prior.factor_um[:13, :13])
        assert by_prior == pytest.approx(float(np.std(drawn)), rel=0.04)


def test_a_known_model_is_the_mean_and_how_far_it_may_be_off_the_spread() -> None:
    parts = (
        Part(name="spindle", plus="T_C", sections=(Section(2.0, 900.0), Section(1.0, 7200.0))),
        Part(name="table", plus="T2_C", direct_gain_um_per_k=0.5, sections=(Section(1.5, 3600.0),)),
    )
    model = CompensationModel(outputs=(Output("Z_um", parts),))
    known = replace(TWO, known=KnownModel("m.json", gains_percent=10.0))
    prior = prior_of(known, model)
    dc_um = prior.mean_um.reshape(2, 13).sum(axis=1)
    assert dc_um == pytest.approx([30.0, 20.0], rel=0.01)
    heat = known.heat(customary(known, 8)[CustomaryTest.HEAT_AND_COOL])
    nothing = foresight(TWO, prior_of(TWO), 8).foreseen_um(heat)
    assert foresight(known, prior, 8).foreseen_um(heat) < 0.7 * nothing
    with pytest.raises(ConfigurationError, match="no input coolant"):
        prior_of(replace(known, sources={"coolant": HeatSource()}), model)


def test_gains_at_rest_may_be_wanted() -> None:
    wanted = replace(SHORT, wanted=Wanted.DC_GAINS)
    found = foresight(wanted, prior_of(wanted), 4)
    heat = wanted.heat(customary(wanted, 4)[CustomaryTest.HEATING])
    expected = float(np.sqrt(np.mean(np.square(found.settled_um(heat)))))
    assert found.foreseen_um(heat) == pytest.approx(expected, rel=1e-9)


def record_of(conditions: HeatingConditions, sequence: Any, seed: int) -> Experiment:
    """A record of a machine that the prior draws, rises of 10 min, noise as stated."""
    rng, prior, step_s = np.random.default_rng(seed), prior_of(conditions), 30.0
    n = round(3600.0 * len(sequence) / 2 / step_s)
    gains = (prior.factor_um @ rng.standard_normal(prior.factor_um.shape[1])).reshape(2, -1)
    heat = np.repeat(conditions.heat(sequence), 60, axis=0)
    u, y = np.zeros((n, 2)), np.zeros(n)
    keeps = np.exp(-step_s / prior.time_constants_s)
    state, hot = np.zeros((2, keeps.size)), np.zeros(2)
    for k in range(n):
        u[k] = 10.0 * hot
        y[k] = float(np.sum(gains[:, 0] * hot) + np.sum(gains[:, 1:] * state))
        state += (1.0 - keeps) * (hot[:, None] - state)
        hot = hot + (1.0 - np.exp(-step_s / 600.0)) * (heat[k] - hot)
    drift, keep = 0.0, np.exp(-step_s / 7200.0)
    for k in range(n):
        y[k] += drift + rng.normal(0.0, 0.4)
        drift = keep * drift + rng.normal(0.0, 0.8 * np.sqrt(1.0 - keep**2))
    return Experiment(step_s, u, y)


def test_what_was_reached_is_what_was_foreseen_where_all_was_as_stated() -> None:
    conditions = replace(SHORT, noise=ReadingNoise(every_s=30.0))
    sequence = designed(conditions, found := foresight(conditions, prior_of(conditions), 12), 12)
    foreseen_um = found.foreseen_um(conditions.heat(sequence))
    ends = [
        reached(conditions, prior_of(conditions), record_of(conditions, sequence, seed))
        for seed in range(4)
    ]
    mean_um = float(np.sqrt(np.mean([one.uncertainty_um**2 for one in ends])))
    assert mean_um == pytest.approx(foreseen_um, rel=0.2)
    assert np.median([one.noise.reading_um for one in ends]) == pytest.approx(0.4, rel=0.3)


def test_what_was_reached_is_where_the_next_plan_begins() -> None:
    conditions = replace(SHORT, noise=ReadingNoise(every_s=30.0))
    record = record_of(conditions, customary(conditions, 8)[CustomaryTest.HEATING], 1)
    found = reached(conditions, prior_of(conditions), record)
    first = planned(conditions, prior_of(conditions), 2 * 3600.0)
    following = planned(conditions, found.gains, 2 * 3600.0)
    assert following.foreseen_um[-1] < min(found.uncertainty_um, first.foreseen_um[-1])


def test_a_part_of_a_record_has_reached_less() -> None:
    conditions = replace(SHORT, noise=ReadingNoise(every_s=30.0))
    whole = record_of(conditions, customary(conditions, 12)[CustomaryTest.HEAT_AND_COOL], 2)
    half = Experiment(30.0, whole.u[:360], whole.y[:360])
    left = [reached(conditions, prior_of(conditions), e).uncertainty_um for e in (half, whole)]
    assert left[1] < 0.8 * left[0]


@pytest.mark.parametrize(
    ("make", "why"),
    [
        (lambda: HeatSource(levels=(1.0, 2.0)), "rise from zero"),
        (lambda: HeatSource(levels=(0.0, 2.0, 1.0)), "rise from zero"),
        (lambda: HeatSource(heat=(0.0, 0.5, 1.0)), "rise from zero"),
        (lambda: HeatSource(rise_min=(20.0, 10.0)), "no span"),
        (lambda: SourceSwitch(SwitchKind.AXIS, axis="X"), "two different ends"),
        (lambda: SourceSwitch(SwitchKind.FUNCTION, on=30), "M30 is no switch"),
        (lambda: SourceSwitch(SwitchKind.FUNCTION, on=8, off=8), "M8"),
        (lambda: replace(TWO, sources={}), "sources"),
        (
            lambda: replace(
                TWO, sources={n: HeatSource(switch=SourceSwitch(SwitchKind.SPINDLE)) for n in "ab"}
            ),
            "spindle 1",
        ),
        (lambda: TWO.blocks(600.0), "duration"),
    ],
)
def test_what_cannot_be_is_refused(make: Any, why: str) -> None:
    with pytest.raises(ConfigurationError, match=why):
        make()


def places_record(hours: float, seed: int, noise_um: float = 0.2) -> tuple[FloatArray, Experiment]:
    """Eight places of which 1, 4 and 6 move the displacement."""
    rng, step_s = np.random.default_rng(seed), 60.0
    n = round(3600.0 * hours / step_s)
    u = np.zeros((n, 8))
    for k in range(8):
        levels = np.repeat(rng.integers(0, 2, n // 45 + 1), 45)[:n]
        for i in range(1, n):
            u[i, k] = u[i - 1, k] + step_s / 900.0 * (8.0 * levels[i] - u[i - 1, k])
    slow = np.zeros(n)
    for i in range(1, n):
        slow[i] = slow[i - 1] + step_s / 3600.0 * (u[i, 4] - slow[i - 1])
    y = 1.5 * u[:, 1] + 2.0 * slow - 1.0 * u[:, 6] + rng.normal(0.0, noise_um, n)
    return u, Experiment(step_s, u, y)


def test_the_places_that_move_the_displacement_are_found_and_missed() -> None:
    _, record = places_record(24.0, 1)
    names = [f"place {k}" for k in range(8)]
    found = best_places({"Z": [record]}, names, 3)
    assert found.best.places == ("place 1", "place 4", "place 6")
    assert found.compared == 56
    assert found.best.error_um < 0.3 * found.median_um
    assert set(found.without) == set(found.best.places)
    assert all(um > 3.0 * found.best.error_um for um in found.without.values())


def test_places_are_refused_that_are_too_few_or_too_many() -> None:
    _, record = places_record(4.0, 1)
    names = [f"place {k}" for k in range(8)]
    with pytest.raises(ConfigurationError):
        best_places({"Z": [record]}, names, 8)
    wide = Experiment(60.0, np.tile(record.u, 5), record.y)
    with pytest.raises(ConfigurationError, match="subsets"):
        best_places({"Z": [wide]}, [str(k) for k in range(40)], 10)
