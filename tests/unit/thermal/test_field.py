"""Thermal fields are compared pixel by pixel; emissivity is corrected by fourth powers."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import stats

from tests.refusals import refused
from thermaxis.codes import remark
from thermaxis.thermal import (
    MOST_PIXELS,
    Region,
    ThermalField,
    correct_emissivity,
    default_regions,
    evaluate_thermal_fields,
    relate_to_drift,
)


def field(values, name=""):
    return ThermalField(np.array(values, dtype=float), name=name)


def series(*means, shape=(4, 6)):
    return [field(np.full(shape, mean)) for mean in means]


def test_the_difference_is_the_last_image_minus_the_first_where_neither_misses_a_pixel():
    images = [field([[1, np.nan], [3, 4]]), field([[9, 9], [9, 9]]), field([[2, 4], [np.nan, 8]])]
    result = evaluate_thermal_fields(images)
    assert np.array_equal(result.difference_k, [[1, np.nan], [np.nan, 4]], equal_nan=True)
    assert remark("pixels_missing", missing=2, pixels=4) in result.warnings


def test_a_pixel_that_one_image_misses_counts_in_no_mean():
    hot = np.full((2, 4), 20.0)
    hot[0, 0] = 1000.0
    hole = np.full((2, 4), 25.0)
    hole[0, 0] = np.nan
    result = evaluate_thermal_fields([field(hot), field(hole)])
    assert result.region_mean_c[:, 0].tolist() == [20.0, 25.0]
    assert result.region_pixels[0] == 7
    assert result.region_change_k[0] == 5.0


def test_the_quarters_share_out_the_image():
    for shape in ((2, 2), (5, 7), (60, 80)):
        cover = np.zeros(shape, dtype=int)
        whole, *quarters = default_regions(shape)
        for region in quarters:
            cover[region.slices(shape)] += 1
        assert (cover == 1).all()
        assert cover[whole.slices(shape)].size == shape[0] * shape[1]


@settings(derandomize=True, max_examples=100, deadline=None)
@given(
    left=st.floats(0, 9), width=st.floats(0.01, 9), top=st.floats(0, 7), height=st.floats(0.01, 7)
)
def test_a_pixel_belongs_to_a_region_if_its_centre_lies_inside(left, width, top, height):
    right, bottom = min(left + width, 10.0), min(top + height, 8.0)
    rows, columns = np.mgrid[0:8, 0:10] + 0.5
    inside = (left <= columns) & (columns < right) & (top <= rows) & (rows < bottom)
    near = np.abs(np.concatenate((columns[0] - left, columns[0] - right, rows[:, 0] - top)))
    if min(near.min(), np.abs(rows[:, 0] - bottom).min()) < 1e-6:
        return  # the edge itself runs through a centre
    region = Region("r", left, right, top, bottom)
    if not inside.any():
        with refused("region_empty", key="region r"):
            region.slices((8, 10))
        return
    found = np.zeros((8, 10), dtype=bool)
    found[region.slices((8, 10))] = True
    assert np.array_equal(found, inside)


def test_a_region_without_a_common_pixel_has_no_mean_and_this_is_said():
    images = [field([[1, np.nan], [1, 1]]), field([[1, 2], [1, 1]])]
    result = evaluate_thermal_fields(images, regions=[Region("corner", 1, 2, 0, 1)])
    assert np.isnan(result.region_mean_c).all()
    assert remark("region_without_mean", region="corner") in result.warnings
    relation = relate_to_drift(
        evaluate_thermal_fields([*images, images[1]]), np.arange(3.0), np.arange(3.0)
    )
    assert np.isnan(relation.common[2].correlation)


def refusals() -> Iterator[tuple[str, Callable[[], object]]]:
    for edges in ((-1, 3, 0, 2), (0, 11, 0, 2), (3, 1, 0, 2), (0, 3, 0, 9)):
        yield "region_outside", partial(lambda e: Region("motor", *e).slices((8, 10)), edges)
    apart = [field([[1, np.nan], [1, np.nan]]), field([[np.nan, 2], [np.nan, 1]])]
    yield "no_common_pixel", partial(evaluate_thermal_fields, apart)
    yield "one_image", partial(evaluate_thermal_fields, [field(np.ones((3, 3)))])
    unlike = [field(np.ones((3, 3))), field(np.ones((3, 4)))]
    yield "image_sizes_differ", partial(evaluate_thermal_fields, unlike)
    timed = partial(evaluate_thermal_fields, series(20, 21))
    yield "times_not_images", partial(timed, time_s=[0.0])
    for times in ([0.0, 0.0], [2.0, 1.0], [0.0, float("nan")]):
        yield "not_rising", partial(timed, time_s=times)
    yield "wrong_shape", partial(ThermalField, np.ones(5))
    yield "wrong_shape", partial(ThermalField, np.ones((1, 5)))
    yield "image_empty", partial(ThermalField, np.full((3, 3), np.nan))
    yield "pixel_out_of_range", partial(ThermalField, np.full((2, 2), -300.0))
    large = np.broadcast_to(np.float64(20.0), (MOST_PIXELS // 1000 + 1, 1000))
    yield "too_many_pixels", partial(ThermalField, large)
    corrected = partial(correct_emissivity, np.array([20.0]))
    for emissivity in (0.0, -0.1, 1.01, float("nan")):
        yield "no_emissivity", partial(corrected, emissivity=emissivity, reflected_c=20.0)
    yield "reflection_exceeds", partial(corrected, emissivity=0.1, reflected_c=200.0)
    yield "outside_range", partial(corrected, emissivity=0.9, reflected_c=-300.0)


def test_what_is_no_image_region_time_or_emissivity_is_refused():
    for words, call in refusals():
        with refused(words):
            call()


def test_an_image_cannot_be_changed_afterwards():
    values = np.ones((3, 3))
    image = ThermalField(values)
    values[0, 0] = 99.0
    assert image.temperature_c[0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        image.temperature_c[0, 0] = 2.0


# ---- emissivity ---------------------------------------------------------------------------------


@settings(derandomize=True, max_examples=200, deadline=None)
@given(
    temperature=st.floats(-50, 300), emissivity=st.floats(0.05, 1.0), reflected=st.floats(-50, 100)
)
def test_the_correction_undoes_what_a_grey_surface_does(temperature, emissivity, reflected):
    radiated = emissivity * (temperature + 273.15) ** 4
    radiated += (1 - emissivity) * (reflected + 273.15) ** 4
    apparent = np.array([[radiated**0.25 - 273.15]])
    found = correct_emissivity(apparent, emissivity=emissivity, reflected_c=reflected)
    assert found[0, 0] == pytest.approx(temperature, abs=1e-7)


def test_a_known_value_of_the_correction_and_none_of_a_black_surface():
    # (303.15^4 - 0.1 293.15^4) / 0.9 = 8.56342e9 K^4, its fourth root 304.2018 K
    found = correct_emissivity(np.array([30.0, np.nan]), emissivity=0.9, reflected_c=20.0)
    assert found == pytest.approx([31.0518, np.nan], abs=5e-4, nan_ok=True)
    values = np.array([[20.0, np.nan], [30.0, -5.0]])
    black = correct_emissivity(values, emissivity=1.0, reflected_c=80.0)
    assert np.array_equal(black, values, equal_nan=True)


def planck(temperature_c):
    """Radiance in the band of 7.5 to 13 um, in any unit, by Planck's law."""
    wavelength = np.linspace(7.5, 13.0, 801)
    kelvin = np.asarray(temperature_c, dtype=float)[..., None] + 273.15
    density = wavelength**-5 / np.expm1(14387.769 / (wavelength * kelvin))
    return np.trapezoid(density, wavelength, axis=-1)


def test_the_fourth_power_errs_as_little_as_documented_in_the_band_of_a_camera():
    table = np.linspace(0.0, 80.0, 4001)
    true = np.linspace(15.0, 60.0, 46)
    for emissivity, bound_k in ((0.97, 0.013), (0.7, 0.12)):
        seen = emissivity * planck(true) + (1 - emissivity) * planck(24.0)
        apparent = np.interp(seen, planck(table), table)
        found = correct_emissivity(apparent, emissivity=emissivity, reflected_c=24.0)
        worst = np.abs(found - true).max()
        assert 0.8 * bound_k < worst <= 1.02 * bound_k
        assert np.abs(apparent - true).max() > 50 * worst


# ---- beside the drift of a run ------------------------------------------------------------------


def test_the_correlation_is_that_of_another_library():
    rng = np.random.default_rng(3)
    images = [ThermalField(rng.normal(25.0, 1.0, (4, 6))) for _ in range(7)]
    result = evaluate_thermal_fields(images)
    common, slope = rng.normal(0.0, 3.0, (2, 7))
    relation = relate_to_drift(result, common, slope)
    assert relation.images == 7
    for found, drift in ((relation.common, common), (relation.slope, slope)):
        for r, one in enumerate(found):
            line = stats.linregress(result.region_mean_c[:, r], drift)
            assert one.region == result.regions[r].name
            assert one.correlation == pytest.approx(line.rvalue, rel=1e-10)
            assert one.per_k == pytest.approx(line.slope, rel=1e-10)
            assert one.p_value == pytest.approx(line.pvalue, rel=1e-9)


def test_a_drift_in_proportion_to_the_temperature_is_found_with_its_factor():
    means = np.array([20.0, 21.0, 23.0, 23.5])
    result = evaluate_thermal_fields(series(*means))
    relation = relate_to_drift(result, -2.5 * means, 4.0 * means + 1.0)
    assert relation.common[0].correlation == pytest.approx(-1.0)
    assert relation.common[0].per_k == pytest.approx(-2.5)
    assert relation.slope[0].per_k == pytest.approx(4.0)
    assert relation.slope[0].p_value < 1e-6


def test_an_image_outside_the_run_does_not_count_and_two_images_have_no_correlation():
    result = evaluate_thermal_fields(series(20, 21, 22, 50))
    drift = np.array([0.0, 1.0, 2.0, np.nan])
    relation = relate_to_drift(result, drift, drift)
    assert relation.images == 3
    assert relation.common[0].per_k == pytest.approx(1.0)
    drift[2] = np.nan
    relation = relate_to_drift(result, drift, drift)
    assert (relation.images, relation.common, relation.slope) == (2, (), ())


def test_a_constant_temperature_has_no_correlation_and_a_drift_of_another_length_is_an_error():
    relation = relate_to_drift(
        evaluate_thermal_fields(series(20, 20, 20)), np.arange(3.0), np.arange(3.0)
    )
    assert np.isnan(relation.common[0].correlation)
    assert np.isnan(relation.common[0].p_value)
    with refused("wrong_shape", key="drift"):
        relate_to_drift(evaluate_thermal_fields(series(1, 2)), np.arange(3.0), np.arange(2.0))
