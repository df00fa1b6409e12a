"""The touch program on a real control: LinuxCNC without display, whose probe sees its axis."""

import numpy as np
import pytest

from tests.system.linuxcnc.machine import PERIOD_S, missing, run_program
from thermaxis.controls import TouchRequest, check_options, control_by_name

pytestmark = [pytest.mark.system, pytest.mark.real_time]

SURFACE_MM, STATED_MM, START_MM, SEARCH_MM, FEED = 2.988, 3.0, 4.0, 2.5, 120.0
OFFSETS = "G10 L2 P2 X50 Y-70\nG55\nG92 X12.5\nG43.1 X7\nG20\nG93\n"
"""What a part program may leave in force, none of which may matter."""


@pytest.mark.parametrize(
    ("moves_mm", "alarm"),
    [(-100.0, "no touch within the search"), (100.0, "the probe was deflected before")],
)
def test_a_touch_leaves_value_and_counter_and_one_that_is_none_leaves_both(
    moves_mm: float, alarm: str
) -> None:
    """After the first touch the surface is gone, or the probe answers all the time."""
    reason = missing()
    if reason:
        pytest.fail(reason, pytrace=False)
    control = control_by_name("linuxcnc")
    program = control.format_touch(
        TouchRequest(
            axis="X",
            surface_mm=STATED_MM,
            start_mm=START_MM,
            search_mm=SEARCH_MM,
            feed_mm_per_min=FEED,
            touches=3,
            pause_s=0.1,
            options=check_options(control, [], purpose="touch"),
        )
    )
    trace = run_program(
        OFFSETS + program,
        limit_s=60.0,
        heeds_messages=False,
        surface_mm=(SURFACE_MM, moves_mm),
    )
    assert any(alarm in said for said in trace.said), trace.said
    value_um, counter = trace.outputs
    assert counter == 1.0
    step_um = 1000.0 * FEED / 60.0 * PERIOD_S  # the control reads once in a servo period
    assert value_um == pytest.approx(1000.0 * (STATED_MM - SURFACE_MM), abs=2.0 * step_um)
    way = trace.position[np.argmax(trace.position) :]  # from the start of the first search
    lowest = START_MM - SEARCH_MM if moves_mm < 0 else pytest.approx(SURFACE_MM, abs=0.05)
    assert np.min(way) == lowest
    assert np.max(way) == START_MM
    assert np.max(np.abs(trace.velocity)) <= FEED / 60.0 * (1.0 + 1e-9)
    assert trace.position[-1] == pytest.approx(START_MM, abs=1e-9)
    assert np.all(trace.bystander == 0.0)
