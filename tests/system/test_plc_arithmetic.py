"""What REAL costs in a shift of the paper's models, and what plain increments would cost.

The figures are those of ``docs/theory/plc-arithmetic.md``; see them with ``pytest -s``.
"""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from tests.unit.plc.equal_parts import CLibrary, Record, c_library, recorded, st_block
from tests.unit.plc.plc_scenarios import paper_model, scenario_steps, wide
from thermaxis.compensation import CompensationModel
from thermaxis.plc import LIBRARY, Block, CycleBlock, PlcStep, st_library

pytestmark = pytest.mark.system


def away_um(
    model: CompensationModel, record: Record, folder: Path, *, compensated: bool
) -> np.ndarray:
    """Return how far the model in REAL is from `cycle`, by call; states are the same.

    With plain increments its lag is that of LREAL, rounded.
    """
    block = Block(settings=wide(model, double=False))
    texts = block.st()
    if not compensated:
        texts[f"{LIBRARY}.st"] = st_library(double=True).replace("LREAL", "REAL")
    name = f"{block.name}_{compensated}"
    c = {name: st_block(block, texts, name)}
    rows = CLibrary(c_library(c, folder / name, "-O1")).run(name, record)
    state, moved = (record.outputs.index(one) for one in ("state", "model_z_um"))
    assert np.array_equal(rows[:, state], record.wanted[:, state])
    return np.abs(rows[:, moved] - record.wanted[:, moved])


@pytest.mark.parametrize("name", ["eps1", "eps2"])
def test_real_stays_within_two_nanometres_of_lreal_for_the_models_of_the_paper(
    name: str, tmp_path: Path
) -> None:
    model = paper_model(name)
    steps = scenario_steps(wide(model, double=True), hours=8.0, seed=1)
    record = recorded(wide(model, double=False), steps)
    largest_um, plain_um = (
        np.max(away_um(model, record, tmp_path, compensated=one)) for one in (True, False)
    )
    span_um = np.ptp(record.wanted[:, record.outputs.index("model_z_um")])
    print(f"{name}: {largest_um:.2e} um of {span_um:.1f} um, plain {plain_um:.2e} um")
    assert span_um > 10.0
    assert 0.0 < largest_um < 0.002


@pytest.mark.parametrize(("name", "plain_um"), [("eps1", 0.02), ("eps2", 0.0001)])
def test_at_constant_temperatures_only_the_compensated_section_in_real_reaches_its_end(
    name: str, plain_um: float, tmp_path: Path
) -> None:
    model = paper_model(name)
    record = recorded(wide(model, double=False), after_a_step(model))
    kept, plain = (
        np.max(away_um(model, record, tmp_path, compensated=one)) for one in (True, False)
    )
    print(f"{name}: compensated {kept:.2e} um, plain {plain:.2e} um, eight hours after a step")
    assert kept < 0.0002
    assert plain > plain_um


def after_a_step(model: CompensationModel) -> Iterator[PlcStep]:
    """Yield eight hours in which one temperature rises by 9 K and then stands."""
    settings = wide(model, double=True)
    cycle = CycleBlock(settings)
    calm = next(iter(scenario_steps(settings, hours=1.0, seed=0))).inputs
    for call in range(28_800):
        rise_k = 0.09 * min(call, 100)
        # A count of the sensor to and fro: a value that does not change at all is not believed.
        count_k = 0.005 * (call // 7200 % 2)
        temperatures_c = (20.0 + rise_k + count_k, 20.0)
        names = [f"t_{stem}" for stem in settings.names.channels]
        told = {**calm, **dict(zip(names, temperatures_c, strict=True)), "enable": call > 0}
        yield PlcStep(told, cycle.step(told))


def rest(alpha: float, begin: float, end: float, *, compensated: bool, steps: int) -> float:
    """Return where the lag in REAL rests, as the two texts of the library say."""
    x, u, share, lost = (np.float32(v) for v in (begin, end, alpha, 0.0))
    for _ in range(steps):
        change = share * (u - x)
        if compensated:
            change -= lost
            total = x + change
            lost = (total - x) - change
            x = total
        else:
            x = x + change
    return float(x)


@pytest.mark.parametrize("tau_s", [7200.0, 36_000.0])
def test_a_plain_increment_in_real_stalls_where_the_law_says(tau_s: float) -> None:
    alpha = -math.expm1(-1.0 / tau_s)
    x = rest(alpha, 9.0, 10.0, compensated=False, steps=400_000)
    stall_k = float(np.spacing(np.float32(x))) / (2.0 * alpha)
    assert 10.0 - x == pytest.approx(stall_k, rel=0.01)


def test_the_slow_section_of_the_paper_would_rest_a_fifth_of_a_micrometre_early() -> None:
    section = paper_model("eps2").layout.parts[0].sections[0]
    alpha = -math.expm1(-1.0 / section.time_constant_s)
    rest_um = [
        abs(section.gain_um_per_k * (9.0 - rest(alpha, 8.9, 9.0, compensated=c, steps=400_000)))
        for c in (False, True)
    ]
    print(f"eps2 at 9 K: plain {rest_um[0]:.3f} um, compensated {rest_um[1]:.1e} um")
    assert rest_um[0] == pytest.approx(0.22, abs=0.02)
    assert rest_um[1] < 2e-5
