"""Figures of ISO 230-2: known answers, rules for what is absent, errors."""

import math

import numpy as np
import pytest

from tests.refusals import refused
from tests.unit.positioning.builders import closed_form, run
from thermaxis.positioning import (
    FIGURE_KEYS,
    Edition,
    evaluate_iso230_2,
    evaluate_iso230_2_1988,
    evaluate_vdi_dgq_3441,
    iso230_2_figures,
)
from thermaxis.quantities import AxisKind

RNG = np.random.default_rng(20)


def test_made_data_with_closed_form_answers() -> None:
    g, b, k = 1.5, 2.0, 0.7
    result = evaluate_iso230_2(run(closed_form(6, g, b, k)))
    s = k * math.sqrt(2.5)
    expected = {
        "B": 2 * b,
        "B_mean": 2 * b,
        "M": 5 * g,
        "E_forward": 5 * g,
        "E_backward": 5 * g,
        "E": 5 * g + 2 * b,
        "R_forward": 4 * s,
        "R_backward": 4 * s,
        "R": 4 * s + 2 * b,
        "A_forward": 5 * g + 4 * s,
        "A_backward": 5 * g + 4 * s,
        "A": 5 * g + 4 * s + 2 * b,
    }
    assert {key: getattr(result, key) for key in FIGURE_KEYS} == pytest.approx(expected, abs=1e-12)
    assert result.R == pytest.approx(8.427188724, abs=5e-10)


def test_a_reversal_that_changes_sign_separates_both_means() -> None:
    x = np.zeros((4, 5, 2))
    reversal = np.array([3.0, -1.0, 2.0, -4.0])
    x[:, :, 0] = reversal[:, None] / 2
    x[:, :, 1] = -reversal[:, None] / 2
    x += 0.1 * np.arange(-2.0, 3.0)[None, :, None]
    result = evaluate_iso230_2(run(x))
    assert result.B == pytest.approx(4.0)
    assert result.B_mean == pytest.approx(0.0, abs=1e-12)
    vdi = evaluate_vdi_dgq_3441(run(x))
    assert vdi.U_mean == pytest.approx(2.5)
    assert vdi.U_max == pytest.approx(4.0)


def transcription(x: np.ndarray) -> dict[str, float]:
    """Follow the clauses word by word in plain Python, a second way to every figure."""
    m, n, _ = x.shape
    mean = [[sum(x[i, j, d] for j in range(n)) / n for d in (0, 1)] for i in range(m)]
    s = [
        [math.sqrt(sum((x[i, j, d] - mean[i][d]) ** 2 for j in range(n)) / (n - 1)) for d in (0, 1)]
        for i in range(m)
    ]
    b = [mean[i][0] - mean[i][1] for i in range(m)]
    both = [(mean[i][0] + mean[i][1]) / 2 for i in range(m)]
    r = [max(2 * s[i][0] + 2 * s[i][1] + abs(b[i]), 4 * s[i][0], 4 * s[i][1]) for i in range(m)]

    def width(k: float, ways: tuple[int, ...]) -> float:
        upper = max(mean[i][d] + k * s[i][d] for i in range(m) for d in ways)
        return upper - min(mean[i][d] - k * s[i][d] for i in range(m) for d in ways)

    return {
        "B": max(abs(v) for v in b),
        "B_mean": sum(b) / m,
        "M": max(both) - min(both),
        "E_forward": width(0, (0,)),
        "E_backward": width(0, (1,)),
        "E": width(0, (0, 1)),
        "R_forward": max(4 * s[i][0] for i in range(m)),
        "R_backward": max(4 * s[i][1] for i in range(m)),
        "R": max(r),
        "A_forward": width(2, (0,)),
        "A_backward": width(2, (1,)),
        "A": width(2, (0, 1)),
    }


def test_a_plain_transcription_of_the_clauses_agrees() -> None:
    for shape in ((5, 5), (9, 5), (16, 20), (2, 2)):
        for _ in range(20):
            x = RNG.normal(size=(*shape, 2)) * RNG.uniform(0.01, 10) + RNG.normal(
                size=(shape[0], 1, 2)
            )
            result = evaluate_iso230_2(run(x))
            figures = {key: getattr(result, key) for key in FIGURE_KEYS}
            assert figures == pytest.approx(transcription(x), rel=1e-11, abs=1e-11)


def test_nanometre_noise_on_a_large_offset_is_not_cancelled() -> None:
    x = closed_form(6, 1.5, 2.0, 1e-6) + 1e5
    result = evaluate_iso230_2(run(x))
    assert result.R_forward == pytest.approx(4 * 1e-6 * math.sqrt(2.5), rel=1e-4)


def test_a_unidirectional_run_has_its_own_figures_only() -> None:
    for way, word in enumerate(("forward", "backward")):
        x = closed_form(6, 1.5, 2.0, 0.7)
        x[:, :, 1 - way] = np.nan
        result = evaluate_iso230_2(run(x))
        present = {key for key in FIGURE_KEYS if not np.isnan(getattr(result, key))}
        assert present == {f"{letter}_{word}" for letter in "ERA"}
        assert getattr(result, f"A_{word}") == pytest.approx(7.5 + 4 * 0.7 * math.sqrt(2.5))


def test_over_two_metres_spread_is_absent_and_full_brings_it_back() -> None:
    target = np.linspace(0.0, 2500.0, 11)
    x = RNG.normal(size=(11, 5, 2))
    short = evaluate_iso230_2(run(x, target))
    assert short.single_run_rule
    assert np.all(np.isnan([short.R, short.A, short.R_forward, short.A_backward]))
    assert np.all(np.isnan(short.s))
    full = evaluate_iso230_2(run(x, target), full=True)
    assert np.isfinite(full.R)
    assert (short.E, short.M, short.B, short.B_mean) == (full.E, full.M, full.B, full.B_mean)
    one_run = evaluate_iso230_2(run(x[:, :1], target))
    assert one_run.E == pytest.approx(np.ptp(x[:, :1]))
    assert np.isnan(one_run.R)
    assert one_run.s.shape == (11, 2)
    assert np.isfinite(evaluate_iso230_2(run(x, np.linspace(0.0, 2000.0, 11))).R)
    rotary = run(x, np.linspace(0.0, 3600.0, 11), kind=AxisKind.ROTARY)
    assert np.isfinite(evaluate_iso230_2(rotary).R)


def test_too_few_readings_are_an_error_that_names_target_and_approach() -> None:
    x = RNG.normal(size=(5, 5, 2))
    x[2, 1:, 1] = np.nan
    with refused("too_few_at_target", target=3, position=40.0, readings=1, approach="backward"):
        evaluate_iso230_2(run(x))
    with refused("too_few_at_target", target=1):
        evaluate_iso230_2(run(RNG.normal(size=(5, 1, 2))))
    long_axis = run(RNG.normal(size=(11, 1, 2)), np.linspace(0.0, 2500.0, 11))
    with refused("too_few_at_target", needed=2):
        evaluate_iso230_2(long_axis, full=True)


def test_a_missing_reading_counts_for_its_own_target_only() -> None:
    x = closed_form(6, 1.5, 2.0, 0.7)
    x[3, 4, 0] = np.nan
    result = evaluate_iso230_2(run(x))
    assert result.s[3, 0] == pytest.approx(np.std(0.7 * np.arange(-2, 2), ddof=1))
    assert result.s[3, 1] == pytest.approx(0.7 * math.sqrt(2.5))


def test_editions_differ_in_name_only() -> None:
    test = run(RNG.normal(size=(5, 5, 2)))
    results = [evaluate_iso230_2(test, edition=edition) for edition in Edition]
    assert [str(r.edition) for r in results] == ["1997", "2006", "2014"]
    assert len({tuple(getattr(r, key) for key in FIGURE_KEYS) for r in results}) == 1


def test_the_old_standards_carry_their_mark() -> None:
    test = run(closed_form(6, 1.5, 2.0, 0.7))
    s = 0.7 * math.sqrt(2.5)
    old = evaluate_iso230_2_1988(test)
    assert old.R == pytest.approx(6 * s + 4.0)
    assert old.A == pytest.approx(7.5 + 6 * s + 4.0)
    vdi = evaluate_vdi_dgq_3441(test)
    assert (vdi.U_max, vdi.U_mean, vdi.Pa) == pytest.approx((4.0, 4.0, 7.5))
    assert (vdi.Ps_max, vdi.Ps_mean) == pytest.approx((6 * s, 6 * s))
    assert vdi.P == pytest.approx(7.5 + 4.0 + 6 * s)
    assert old.mark == vdi.mark == "unverified: from memory"


def test_a_wrong_shape_is_an_error_and_never_a_transpose() -> None:
    with refused("wrong_shape", key="deviation"):
        iso230_2_figures(np.zeros((2, 5, 5)))
    with refused("wrong_shape", key="deviation"):
        iso230_2_figures(np.zeros((5, 2)))
