"""Faults drawn at random against loops and machines of others, and whether the judge sees any."""

from pathlib import Path
from typing import Any

import pytest

from tests.system.opcua.faults import LONGEST_STEP_S, RULES, Happened, campaign, judged
from tests.system.opcua.foreign_server import install, missing
from tests.system.programs import Recorded
from thermaxis.compensation import SupervisorState

pytestmark = pytest.mark.system

STEP_UM = RULES.rate_um_per_s * RULES.cycle_s


def test_no_fault_makes_a_larger_step_than_the_rate_allows_and_each_is_told(
    tmp_path: Path,
) -> None:
    """Two hundred are drawn by ``python -m benchmarks.loop_faults``."""
    reason = missing()
    if reason:
        pytest.fail(reason, pytrace=False)
    install()
    every = campaign(tmp_path, 20, 94, machines=4)
    print(*every, sep="\n")
    assert [breach for one in every for breach in one.breaches] == []
    assert sum(len(one.happened) for one in every) == 20
    assert max(one.largest_um for one in every) > STEP_UM  # it was moved as fast as it may be
    assert max(one.lost_s for one in every) < 5.0  # a second, where nobody else works


def told(*rows: tuple[float, float]) -> list[dict[str, Any]]:
    """Return a server's record of Z: when a write came [s], and what was told [um]."""
    lines: list[dict[str, Any]] = []
    stood_um = 0.0
    for at_s, um in rows:
        stood = dict.fromkeys(("node_um", "took_um", "acts_um"), stood_um)
        line = {"kind": "write", "axis": "Z", "monotonic_s": at_s, "told_um": um, "met": True}
        lines.append(line | stood)
        stood_um = um
    return lines


def cycles(*rows: tuple[float, float]) -> list[Recorded]:
    """Return a history: when a cycle began [s], and what it commanded [um]."""
    active = SupervisorState.ACTIVE
    return [Recorded(k, s, active, True, (um,)) for k, (s, um) in enumerate(rows, start=1)]


def test_the_judge_finds_a_step_a_rate_a_magnitude_a_lost_cycle_and_what_is_not_told() -> None:
    ramp = [(0.1 * k, STEP_UM * k) for k in range(1, 15)]
    later = [(at_s + 0.01, um) for at_s, um in ramp]
    kept = judged(told(*later), [cycles(*ramp)], [], [])
    assert kept.breaches == []
    assert kept.largest_um == pytest.approx(STEP_UM)
    assert kept.ahead_um == pytest.approx(0.0, abs=1e-9)

    far = [*ramp, (1.5, 17.0)]
    (step, ahead) = judged(told(*later, (1.51, 17.0)), [cycles(*far)], [], []).breaches
    assert step.startswith("a step of 3.00 of")
    assert ahead.startswith("2.00 um ahead of the rate: ")
    other = {"kind": "other", "monotonic_s": 1.505, "others_um": {"Z": 20.0}}
    under_way = judged([*told(*later), other, *told((1.51, 17.0))], [cycles(*far)], [], [])
    assert under_way.breaches == []
    assert under_way.unknown_um == (17.0,)
    looked = other | {"monotonic_s": 1.45}
    assert judged([*told(*later), looked, *told((1.51, 17.0))], [cycles(*far)], [], []).breaches

    beyond = [(0.1 * k, STEP_UM * k) for k in range(1, 23)]
    lines = told(*((at_s + 0.01, um) for at_s, um in beyond))
    (breach,) = judged(lines, [cycles(*beyond)], [], []).breaches
    assert breach == "a write is 2.00 um beyond the limit"

    assert judged(told(*later), [cycles(*ramp[:-3])], [], []).lost_s > 100.0
    killed = [Happened("killed_loop", 1.5)]
    lost = judged(told(*later), [cycles(*ramp[:-3])], [], killed)
    assert lost.lost_s == pytest.approx(0.29)
    assert lost.breaches == ["killed_loop: []"]
    gap = cycles(*ramp)
    del gap[5]
    assert "no cycles [6] in the history" in judged(told(*later), [gap], [], []).breaches
    assert LONGEST_STEP_S == pytest.approx(2.0 * RULES.cycle_s)
