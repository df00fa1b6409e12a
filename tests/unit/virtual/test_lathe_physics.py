"""The lathe's physics: heat, network and bending, each against a second way."""

import math

import numpy as np
import pytest

from thermaxis.virtual import (
    SCENARIOS,
    HallSettings,
    LatheDuty,
    LatheSettings,
    Scenario,
    Stage,
    VirtualLathe,
)
from thermaxis.virtual.lathe._hall import Hall
from thermaxis.virtual.lathe._physics import (
    DIAMETERS_MM,
    Boundary,
    LathePhysics,
    Node,
    time_constants_s,
)

PHYSICS = LathePhysics()
STILL = LatheSettings(hall=HallSettings(day_k=0.0, unrest_k=0.0))


def test_an_even_warming_of_all_masses_leaves_the_tool_point_where_it_is() -> None:
    shape = PHYSICS.shape()
    warmed = np.ones(len(Node))
    moved = shape @ warmed
    assert moved[0] == pytest.approx(0.0, abs=1e-9)
    frame = PHYSICS.expansion_um_per_m_k * PHYSICS.tool_m
    assert moved[1:] == pytest.approx([frame] * 3)


def test_the_arch_of_the_bed_is_that_of_a_beam_integrated_point_by_point() -> None:
    """A beam warmer above bends with constant curvature: twice integrated by the midpoint rule."""
    shape, p = PHYSICS.shape(), PHYSICS
    curvature = p.expansion_um_per_m_k / p.bed_m  # per kelvin, um/m²

    def fall(distance_m: float) -> tuple[float, float]:
        steps = 20_000
        h, slope, sunk = distance_m / steps, 0.0, 0.0
        for _ in range(steps):
            sunk += h * (slope + curvature * h / 2.0)
            slope += curvature * h
        return sunk, slope

    foot_sinks, slope = fall(p.reach_m)
    tool_rises = slope * p.reach_m - foot_sinks
    _, seat_slope = fall(p.cone_radius_m)
    for row, diameter_mm in zip(shape, DIAMETERS_MM, strict=True):
        expected = tool_rises + seat_slope * diameter_mm / 2000.0
        assert -row[Node.BED_FOOT] == pytest.approx(expected, rel=1e-6)
        assert row[Node.BED_TOP] == pytest.approx(expected, rel=1e-6)


def test_bearing_heat_follows_a_torque_with_a_part_that_grows_with_the_speed() -> None:
    """Heat is torque times speed: the torque is taken out again and compared."""
    torque = []
    for rpm in (500.0, 1000.0, 2000.0, 3500.0):
        heat = PHYSICS.heat_w(LatheDuty(spindle_rpm=rpm, gear=2))
        torque.append(heat[Node.SPINDLE_BEARING] / (2.0 * math.pi * rpm / 60.0))
    constant = 170.0 / (2.0 * math.pi * 3500.0 / 60.0)
    growing = np.array(torque) - constant
    assert growing / growing[-1] == pytest.approx(
        (np.array([500.0, 1000.0, 2000.0, 3500.0]) / 3500.0) ** (2.0 / 3.0), rel=1e-6
    )


def test_at_rest_only_the_pump_warms_and_without_coolant_nothing() -> None:
    heat = PHYSICS.heat_w(LatheDuty())
    assert heat[Node.COOLANT] == PHYSICS.pump_w
    assert np.count_nonzero(heat) == 1
    assert not PHYSICS.heat_w(LatheDuty(coolant=False)).any()


def test_the_first_gear_warms_the_headstock_more_at_the_same_speed() -> None:
    low, high = (
        PHYSICS.heat_w(LatheDuty(spindle_rpm=900.0, gear=gear))[Node.HEADSTOCK] for gear in (1, 2)
    )
    assert low == pytest.approx(PHYSICS.gear_w[0])
    assert high == pytest.approx(PHYSICS.gear_w[1] * 900.0 / 3500.0)
    assert low > 2.0 * high > 0.0


def test_rotation_and_coolant_and_cooler_change_the_network() -> None:
    rest = PHYSICS.network(LatheDuty(coolant=False))
    turning = PHYSICS.network(LatheDuty(coolant=False, table_rpm=200.0))
    flowing = PHYSICS.network(LatheDuty())
    cooled = PHYSICS.network(LatheDuty(cooler=True))
    ratio = turning.boundary_w_per_k[Node.RIM, 0] / rest.boundary_w_per_k[Node.RIM, 0]
    assert ratio == pytest.approx(PHYSICS.rotating_factor)
    half = PHYSICS.network(LatheDuty(coolant=False, table_rpm=100.0))
    ratio = half.boundary_w_per_k[Node.TABLE, 0] / rest.boundary_w_per_k[Node.TABLE, 0]
    assert ratio == pytest.approx(1.0 + (PHYSICS.rotating_factor - 1.0) * 0.5**0.8)
    assert rest.conductance_w_per_k[Node.TABLE_BEARING, Node.COOLANT] == 0.0
    assert flowing.conductance_w_per_k[Node.TABLE_BEARING, Node.COOLANT] > 0.0
    assert flowing.boundary_w_per_k[Node.COOLANT, Boundary.COOLER] == 0.0
    assert cooled.boundary_w_per_k[Node.COOLANT, Boundary.COOLER] > 0.0


def test_the_time_constants_reach_from_minutes_to_half_a_day() -> None:
    found = time_constants_s(PHYSICS.network(LatheDuty()))
    assert len(found) == len(Node)
    assert 3600.0 * 6.0 < found[0] < 3600.0 * 18.0
    assert 60.0 < found[-1] < 600.0
    assert sum(600.0 < tau < 3.0 * 3600.0 for tau in found) >= 4


def test_one_shift_of_the_spindle_warms_and_moves_as_much_as_in_the_paper() -> None:
    lathe = VirtualLathe("calibration-spindle", 1, STILL)
    lathe.step(900.0)
    before = lathe.temperature_c
    lathe.step(8.0 * 3600.0)
    rise = lathe.temperature_c - before
    assert 8.0 < rise[Node.SPINDLE_BEARING] < 16.0
    assert abs(rise[Node.COLUMNS]) < 2.0
    moved = lathe.uncorrected_um
    assert np.all((moved < -100.0) & (moved > -300.0))
    assert moved[0] == pytest.approx(moved[1], rel=0.15)
    assert moved[3] == pytest.approx(moved[1], rel=0.05)


def test_one_shift_of_the_table_moves_the_other_way_and_more_at_the_rim() -> None:
    lathe = VirtualLathe("calibration-table", 1, STILL)
    lathe.step(900.0)
    before = lathe.temperature_c
    moved = np.empty((480, 4))
    for minute in range(480):
        lathe.step(60.0)
        moved[minute] = lathe.uncorrected_um
    assert 4.0 < lathe.temperature_c[Node.TABLE_BEARING] - before[Node.TABLE_BEARING] < 15.0
    highest = moved.max(axis=0)
    assert highest[1] > 50.0
    assert highest[2] / highest[1] == pytest.approx(1.6, abs=0.12)
    assert highest[3] / highest[1] == pytest.approx(2.2, abs=0.2)
    assert highest[3] < 300.0


def test_in_a_hall_that_does_not_move_a_machine_at_rest_does_not_move() -> None:
    standing = Scenario("standing", "nothing", (Stage(86_400.0, machine_on=False, coolant=False),))
    lathe = VirtualLathe(standing, 1, STILL)
    lathe.step(20.0 * 3600.0)
    assert np.max(np.abs(lathe.uncorrected_um)) < 1e-9


def test_a_machine_that_has_stood_for_ever_is_what_ten_days_in_the_hall_make_of_it() -> None:
    """The closed form of the start against 2,880 steps from an even temperature."""
    start_s, days, step_s = 6.0 * 3600.0, 10, 300.0
    hall = Hall(HallSettings(), (1, 2), start_s)
    network = PHYSICS.network(LatheDuty(coolant=False))
    temperature = np.full(len(Node), 21.0)
    for k in range(-days * 288, 0):
        hall_c = hall.at((k + 0.5) * step_s)
        boundary = np.array([hall_c, PHYSICS.foundation_c, PHYSICS.cooler_c])
        temperature = network.after(temperature, np.zeros(len(Node)), boundary, step_s)
    expected = hall.rest(PHYSICS)
    # the coolant has the longest way to go: it gives its heat to the hall alone while it stands
    assert temperature == pytest.approx(expected, abs=2e-3)


def test_the_hall_is_warmest_in_the_afternoon_and_comes_back_every_day() -> None:
    quiet = Hall(HallSettings(unrest_k=0.0), (1,), 6.0 * 3600.0)
    times = np.arange(0.0, 86_400.0, 300.0)
    values = np.array([quiet.at(t) for t in times])
    assert times[np.argmax(values)] == 9.0 * 3600.0
    assert np.ptp(values) == pytest.approx(2.0 * HallSettings().day_k, rel=1e-3)
    assert quiet.at(86_400.0 + 777.0) == pytest.approx(quiet.at(777.0))


def test_every_scenario_keeps_to_the_speeds_that_the_machine_has() -> None:
    for scenario in SCENARIOS.values():
        for stage in scenario.stages:
            assert 0.0 <= stage.spindle_rpm <= 3500.0
            assert 0.0 <= stage.table_rpm <= 200.0
            assert stage.gear_engaged in {1, 2}
            if stage.gear_engaged == 1:
                assert stage.spindle_rpm <= 900.0
    assert SCENARIOS["verification"].duration_s == 16.0 * 3600.0
    assert SCENARIOS["day"].duration_s == 86_400.0
