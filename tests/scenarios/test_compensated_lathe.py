"""The end of the paper's story: a virtual lathe runs with the compensation, and is measured.

The lathe is a thermal network of its own, its sensors show 0.1 K. Both calibration tests (the
paper's section 3.2) gave the model, by the commands of the tutorial. The verification spectrum
(4.2) runs with the compensation in the loop, once for each measuring position, and the true tool
point is what counts.
"""

import asyncio
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.unit.runtime.simulated import SimulatedHistorian
from thermaxis.compensation import (
    Compensation,
    CompensationModel,
    Limits,
    Part,
    Request,
    RequestKind,
    SensorRules,
    SupervisorRules,
)
from thermaxis.files import read_model
from thermaxis.runtime import (
    AtStop,
    CompensationLoop,
    LoopSettings,
    Ports,
    VirtualClock,
    run_in_virtual_time,
)
from thermaxis.virtual import LatheSettings, LatheSink, LatheSource, OffsetRules, VirtualLathe

pytestmark = pytest.mark.system

CYCLE_S = 10.0
POSITIONS = {"TCP": None, "D0": 0.0, "D1500": 1500.0, "D3000": 3000.0}


@pytest.fixture(scope="module")
def model(root: Path) -> CompensationModel:
    return read_model(root / "examples" / "machine" / "models" / "lathe.json")


def compensated(model: CompensationModel, diameter_mm: float | None) -> np.ndarray:
    """Return true and uncorrected displacements, (cycles, 2, 4), in um."""
    slow = LatheSettings(offset=OffsetRules(watchdog_s=60.0))
    lathe = VirtualLathe("verification", seed=7, settings=slow)
    compensation = Compensation(
        model=model,
        sensors={
            c: SensorRules(lowest_c=5.0, highest_c=80.0, longest_age_s=60.0) for c in model.channels
        },
        limits={"Z_um": Limits(280.0, 0.5)},
        supervisor=SupervisorRules(
            settle_s=60.0, input_timeout_s=20.0, recovery_delay_s=10.0, read_back_s=60.0
        ),
        cycle_s=CYCLE_S,
    )
    seen: list[np.ndarray] = []

    async def play() -> None:
        clock = VirtualClock()
        loop = CompensationLoop(
            compensation,
            LoopSettings(
                machine="lathe", model_file="lathe.json", model_sha256="", at_stop=AtStop.LEAVE
            ),
            Ports(LatheSource(lathe, clock), LatheSink(lathe, clock), SimulatedHistorian(), clock),
        )
        loop.listeners.append(
            lambda _: seen.append(np.array([lathe.true_um, lathe.uncorrected_um]))
        )
        running = asyncio.ensure_future(loop.run(asyncio.Event(), cycles=16 * 360))
        for request in (
            Request(RequestKind.DIAMETER, "test", value=diameter_mm),
            Request(RequestKind.ENABLE, "test"),
        ):
            answer = await loop.submit(request)
            assert answer.accepted, answer.code
        await running

    run_in_virtual_time(play())
    return np.array(seen)


def reduction(found: np.ndarray, position: str) -> float:
    k = list(POSITIONS).index(position)
    return float(np.ptp(found[:, 1, k]) / np.ptp(found[:, 0, k]))


@pytest.mark.parametrize("position", list(POSITIONS))
def test_the_true_error_falls_at_least_sixfold(model, position):
    assert reduction(compensated(model, POSITIONS[position]), position) >= 6.0


def test_a_static_regression_on_the_same_logs_stays_under_fourfold(model):
    static = replace(
        model,
        outputs=tuple(
            replace(o, parts=tuple(map(static_part, o.parts)), offset_um=0.0) for o in model.outputs
        ),
    )
    for position in ("TCP", "D3000"):
        assert reduction(compensated(static, POSITIONS[position]), position) < 4.0


def static_part(part: Part) -> Part:
    """Return the part with its best static gain, and no lag."""
    assert part.static_gain_um_per_k is not None
    return replace(part, direct_gain_um_per_k=part.static_gain_um_per_k, sections=())
