"""``thermaxis run`` with its offset on a real LinuxCNC is frozen; the watchdog takes it back."""

import signal
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.in_time import LONGEST_S
from tests.system.linuxcnc import machine as linuxcnc
from tests.system.linuxcnc.offset_machine import running, wait_for
from tests.system.loop_stand import LARGEST_UM, RATE_UM_PER_S, lathe, write_site
from tests.system.programs import compensating
from tests.system.test_loop_is_killed import FROZEN_S, assert_two_seconds
from thermaxis.compensation import Limits, SupervisorState
from thermaxis.runtime import AWAY, read_machine
from thermaxis.runtime.sinks import LinuxCncOutput, hal_text

pytestmark = [pytest.mark.system, pytest.mark.real_time]

LINUXCNC_OUTPUT = f"""\
joint = 2
unit = "mm"
sign = "{AWAY}"
"""


def test_a_frozen_loop_on_linuxcnc_is_taken_back_by_the_watchdog_and_heals_without_a_step(
    tmp_path: Path,
) -> None:
    """Temperatures by OPC UA from the virtual lathe, the offset through HAL, all in programs."""
    reason = linuxcnc.missing()
    if reason:
        pytest.fail(reason, pytrace=False)
    with linuxcnc.one_at_a_time(), lathe(tmp_path, watchdog="off") as url:
        configuration = write_site(
            tmp_path, url, sink='kind = "linuxcnc"\n', output=LINUXCNC_OUTPUT
        )
        settings = read_machine(configuration).sink.linuxcnc
        assert settings is not None
        other = LinuxCncOutput(0, "mm", AWAY, Limits(LARGEST_UM, RATE_UM_PER_S))
        both = replace(settings, outputs={**settings.outputs, "X_um": other})
        with running(hal_text(both)) as machine:
            machine.order("home")

            def offset_um() -> float:
                return 1e3 * float(machine.trace().offset[-1])

            with compensating(configuration, "--enable") as loop:
                loop.wait_for_state(SupervisorState.ACTIVE, LONGEST_S)
                wait_for(lambda: offset_um() < -9.0, LONGEST_S, "it has gone somewhere")
                frozen_s = loop.signal(signal.SIGSTOP)
                time.sleep(FROZEN_S)
                assert offset_um() == 0.0
                thawed_s = loop.signal(signal.SIGCONT)
                wait_for(lambda: offset_um() < -9.0, LONGEST_S, "it is there again")
                loop.signal(signal.SIGTERM)
                assert loop.wait(60.0) == 0
            time.sleep(0.5)
            trace = machine.trace()
    step_um = 1e3 * np.max(np.abs(np.diff(trace.offset)))
    assert step_um <= 1.001e-3 * RATE_UM_PER_S  # per servo period of a millisecond
    assert 1e3 * np.max(np.abs(trace.offset)) <= LARGEST_UM
    frozen = (trace.clock_s > frozen_s + 0.2) & (trace.clock_s < thawed_s)
    tripped_s = trace.clock_s[frozen & ~trace.ok][0]
    assert_two_seconds(tripped_s - frozen_s)
    assert np.all(trace.offset[frozen & (trace.clock_s > tripped_s + 3.0)] == 0.0)
    assert trace.offset[-1] == pytest.approx(0.0, abs=1e-9)
