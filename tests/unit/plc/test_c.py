"""What compiled float costs beside compiled double: C by gcc, `cycle`, and the executed tree."""

from pathlib import Path

import numpy as np
import pytest

from tests.unit.plc.equal_parts import CLibrary, c_block, c_library, difference, recorded
from tests.unit.plc.plc_scenarios import CycleBlock, paper_model, wide
from thermaxis.plc import BlockInstance, PlcStep, build_program, scenario_steps


def float_away_from_double(name: str, hours: float, folder: Path) -> tuple[float, float]:
    """Return how far compiled float is from compiled double at 1 s, and the correction's span.

    A model of the paper without a deadband and away from every limit; double is `cycle` and float
    the executed tree, to the last bit. [µm]
    """
    model = paper_model(name)
    corrections: list[np.ndarray] = []
    inputs = [step.inputs for step in scenario_steps(wide(model, double=True), hours=hours, seed=1)]
    for double in (True, False):
        settings = wide(model, double=double)
        program = build_program(settings)
        path = c_library({program.name: c_block(program)}, folder / str(double), "-O2")
        block = CycleBlock(settings) if double else BlockInstance(settings)
        record = recorded(settings, [PlcStep(i, block.step(i)) for i in inputs])
        rows = CLibrary(path).run(program.name, record)
        assert difference(record, rows) == ""
        corrections.append(rows[:, record.outputs.index("correction_z_um")])
    return float(np.max(np.abs(corrections[0] - corrections[1]))), float(np.ptp(corrections[0]))


@pytest.mark.parametrize("name", ["eps1", "eps2"])
def test_compiled_float_stays_near_double_in_the_first_hour_of_the_papers_models(
    name: str, tmp_path: Path
) -> None:
    largest_um, span_um = float_away_from_double(name, 1.0, tmp_path)
    assert span_um > 10.0
    assert 0.0 < largest_um < 0.002
