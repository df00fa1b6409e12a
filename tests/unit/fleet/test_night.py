"""A night of one machine: its model is judged by what was measured, less what was corrected."""

import json
from dataclasses import replace
from datetime import date, timedelta

import numpy as np
import polars as pl
import pytest

from tests.proofs import quick_first
from tests.unit.fleet.fleet_machines import (
    FIRST,
    GAIN,
    LAST,
    MINUTES,
    Truth,
    cycles_of,
    model_of,
)
from thermaxis.fleet import (
    Cause,
    NightOutcome,
    NightResult,
    StoredNight,
    judge,
    night,
    night_as_json,
)
from thermaxis.messages import remedy_of
from thermaxis.runtime.history import DATUM_SET, MINUTE
from thermaxis.runtime.history._parts import minutes_of


def days_of(truth: Truth) -> list[pl.DataFrame]:
    """Return the minutes of each day."""
    table = cycles_of(truth)
    parts = [table.slice(k * MINUTES, MINUTES) for k in range(truth.days)]
    return [minutes_of(part.lazy()).collect() for part in parts]


def found(minutes: list[pl.DataFrame], gain: float = GAIN, **channels: str) -> NightResult:
    result = night("A", model_of(gain), minutes, LAST, channels=channels)
    assert result is not None
    return result


@pytest.fixture(scope="module")
def days() -> list[pl.DataFrame]:
    return days_of(Truth())


@pytest.fixture(scope="module")
def plain(days) -> NightResult:
    return found(days)


def test_a_true_model_leaves_the_noise_of_the_probe_and_a_wrong_gain_its_share(days, plain):
    nights = (plain, found(days, 1.3 * GAIN), found(days, 1.6 * GAIN))
    true, wrong, more = (one.outputs["Z_um"] for one in nights)
    assert (true.rows, true.touches) == (MINUTES // 30, 2 * MINUTES // 30)
    assert 0.7 < true.rmse_um < 1.6
    assert wrong.mean_um < -0.1 * true.uncompensated_um
    assert more.mean_um - true.mean_um == pytest.approx(2.0 * (wrong.mean_um - true.mean_um))
    assert true.offset_mae_um < true.held_mae_um
    assert wrong.within_two_sigma < 0.9 < true.within_two_sigma


@pytest.mark.parametrize("corrected", quick_first(1, [0.0, 0.7, 1.3]))
def test_what_was_corrected_says_nothing_of_the_model(plain, corrected):
    one, other = (night.outputs["Z_um"] for night in (plain, found(days_of(Truth(0, corrected)))))
    for key in ("rmse_um", "mean_um", "mae_um", "uncompensated_um"):
        assert getattr(other, key) == pytest.approx(getattr(one, key), abs=1e-6), key


def test_only_the_last_day_counts_and_the_days_before_it_warm_the_model(days):
    later = (LAST + timedelta(days=1)).isoformat()
    assert found(days).minutes == MINUTES
    assert night("A", model_of(), days, LAST + timedelta(days=1)) is None, later
    assert night("A", model_of(), [], LAST) is None
    alone = found(days[-1:])
    assert alone.outputs["Z_um"].touches == MINUTES // 30


def test_a_frozen_sensor_is_named_and_a_sensor_that_is_away_verifies_nothing():
    frozen = found(days_of(Truth(2, frozen=True)))
    assert [one.place.channel for one in frozen.sensors] == ["T_spindle_C"]
    away = [day.drop("T_spindle_C_mean") for day in days_of(Truth())]
    result = found(away)
    assert result.outcome is NightOutcome.UNVERIFIED
    assert [one.code for one in result.sensors] == ["log-never_measured"]
    assert result.remarks


@pytest.mark.parametrize("touches", [0, 1])
def test_without_touches_on_the_day_sensors_are_judged_alone(days, touches):
    probe = pl.col("probe_Z_um_mean")
    few = pl.when(probe.is_not_null().cum_sum() <= touches).then(probe)
    bare = [*days[:-1], days[-1].with_columns(few.alias("probe_Z_um_mean"))]
    result = found(bare)
    assert result.outcome is NightOutcome.UNVERIFIED
    assert [one.code for one in result.remarks] == ["remark-nothing_measured"]
    assert result.outputs is None


def test_a_sensor_map_finds_channels_and_probes_of_other_names(days, plain):
    names = {
        f"{old}_{end}": f"{new}_{end}"
        for old, new in (("T_spindle_C", "T3_C"), ("probe_Z_um", "probe_tip_um"))
        for end in ("mean", "count")
    }
    renamed = [day.rename(names) for day in days]
    assert found(renamed, T_spindle_C="T3_C", Z_um="probe_tip_um") == plain


def test_a_clock_that_went_back_is_said_and_a_minute_that_came_twice_counts_once(days, plain):
    """The last hour comes again, in a part of its own, as after a clock that was set back."""
    again = days[-1].tail(60)
    result = found([*days, again])
    assert [one.code for one in result.remarks] == ["remark-clock_went_back"]
    assert replace(result, remarks=()).outputs["Z_um"].rows == plain.outputs["Z_um"].rows
    assert result.outputs["Z_um"].rmse_um == pytest.approx(plain.outputs["Z_um"].rmse_um)
    assert result.minutes == MINUTES


@pytest.mark.proof
def test_machines_that_were_off_for_hours_are_verified_as_well(days):
    holes = [day.filter((pl.col(MINUTE).dt.hour() < 1) | (pl.col(MINUTE).dt.hour() > 5))
             for day in days]  # fmt: skip
    result = found(holes)
    assert result.outcome is NightOutcome.VERIFIED
    assert result.outputs["Z_um"].rmse_um < 2.0


def unknowns_of(result: NightResult) -> dict[str, float]:
    """Return the least squares of what the touches of the day and before say, by kind."""
    (one,) = result.touched
    size = len(one.columns)
    matrix, vector = np.zeros((size, size)), np.zeros(size)
    for part in (one.day, one.before):
        upper = np.zeros((size, size))
        upper[np.triu_indices(size)] = part.matrix
        matrix, vector = matrix + upper + np.triu(upper, 1).T, vector + part.vector
    keep = [k for k, (kind, _) in enumerate(one.columns) if kind != "swap"]
    found = np.linalg.solve(matrix[np.ix_(keep, keep)], vector[keep])
    return {str(one.columns[k][0]): x for k, x in zip(keep, found.tolist(), strict=True)}


def test_what_follows_the_temperature_around_is_neither_gain_nor_mean(days, plain):
    around = pl.col("T_column_C_mean") - 20.0
    moved = [day.with_columns(pl.col("probe_Z_um_mean") + 3.0 * around) for day in days]
    gone = pl.when(pl.int_range(pl.len()) != MINUTES - 30).then(pl.col("T_column_C_mean"))
    said, was, missing = map(
        unknowns_of,
        (found(moved), plain, found([*moved[:-1], moved[-1].with_columns(gone)])),
    )
    for one in (said, missing):
        assert one["ambient"] - was["ambient"] == pytest.approx(3.0, abs=0.3)
        assert one["gain"] == pytest.approx(was["gain"], abs=0.02)
        assert one["time_constant"] == pytest.approx(was["time_constant"], abs=0.03)


def test_a_result_is_json(plain):
    text = json.dumps(night_as_json(plain), allow_nan=False)
    assert json.loads(text)["outputs"]["Z_um"]["rows"] == MINUTES // 30


@pytest.mark.proof
def test_where_the_day_shows_a_better_model_it_is_proposed_with_its_origin_and_else_none(
    days, plain
):
    wrong = found(days, 1.3 * GAIN)
    assert plain.proposal is None
    assert [one.place.channel for one in plain.relearned] == ["Z_um"]
    assert wrong.proposal is not None
    assert wrong.model_sha256 in wrong.proposal.provenance.method
    (part,) = wrong.proposal.outputs[0].parts
    assert part.dc_gain_um_per_k == pytest.approx(GAIN, rel=0.15)
    sensor = pl.col("T_spindle_C_mean")
    stood = pl.when(pl.int_range(pl.len()) < MINUTES - 180).then(sensor).forward_fill()
    doubtful = found([*days[:-1], days[-1].with_columns(stood)], 1.3 * GAIN)
    assert ([one.code for one in doubtful.relearned], doubtful.proposal) == (
        ["relearn-sensors_first"],
        None,
    )
    again = night("A", wrong.proposal, days, LAST)
    assert again is not None
    assert again.outputs["Z_um"].rmse_um < 0.5 * wrong.outputs["Z_um"].rmse_um


@pytest.mark.proof
def test_a_datum_that_was_set_anew_names_nobody_unless_it_is_not_told():
    told = days_of(Truth(5, days=6, datum_um=30.0))
    before = _stored(told, 3)
    for known in (True, False):
        days = told if known else [day.drop(DATUM_SET) for day in told]
        (one,) = judge([before, _stored(days, 4), _stored(days, 5)], _day(5))
        if known:
            assert not one.named
        else:
            assert (one.named, one.causes[0]) == (True, Cause.DRIFT)
            assert abs((_day(4) - one.since).days) <= 1
            assert "datum" in remedy_of(one.evidence[0])[:20]


def _day(number: int) -> date:
    return FIRST + timedelta(days=number)


def _stored(days: list[pl.DataFrame], number: int) -> StoredNight:
    twice = days[number].tail(1)  # a minute that two files have
    result = night("A", model_of(), [*days[: number + 1], twice], _day(number))
    assert result is not None
    return StoredNight("A", "mill", _day(number), result.model_sha256, "1", night_as_json(result))
