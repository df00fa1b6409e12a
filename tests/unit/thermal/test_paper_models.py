"""The published transfer functions ship as models that say what their digits leave open."""

from pathlib import Path

import numpy as np
import pytest

from thermaxis.compensation import CompensationModel, Reading, initial_state, model_step
from thermaxis.files import format_model, read_model
from thermaxis.thermal import (
    PAPER_SPINDLE,
    PAPER_TABLE,
    PrintedTransferFunction,
    paper_spindle_model,
    paper_table_model,
    simulate_transfer_function,
)


@pytest.mark.parametrize(
    ("name", "model"), [("eps1", paper_spindle_model()), ("eps2", paper_table_model())]
)
def test_the_example_is_what_the_function_gives(
    root: Path, name: str, model: CompensationModel
) -> None:
    path = root / "examples" / "models" / f"{name}.json"
    assert path.read_text(encoding="ascii") == format_model(model)
    assert read_model(path) == model


@pytest.mark.parametrize(
    ("model", "printed", "within_um"),
    [(paper_spindle_model(), PAPER_SPINDLE, 1e-7), (paper_table_model(), PAPER_TABLE, 0.02)],
)
def test_after_twenty_samples_the_cycle_equals_the_printed_difference_equation(
    model: CompensationModel, printed: PrintedTransferFunction, within_um: float
) -> None:
    part = model.outputs[0].parts[0]
    state = initial_state(model, {part.plus: 20.0, part.minus: 20.0})
    state, _ = model_step(model, state, Reading(-1.0, {part.plus: 20.0, part.minus: 20.0}))
    said = []
    for k in range(2000):
        state, output = model_step(
            model, state, Reading(float(k), {part.plus: 21.0, part.minus: 20.0})
        )
        said.append(output.model_um[0])
    expected = simulate_transfer_function(printed.transfer_function, np.ones(2000))
    assert np.max(np.abs(np.array(said) - expected)[20:]) < within_um


def test_only_the_table_is_called_irreproducible() -> None:
    assert not any("cannot be reproduced" in w for w in paper_spindle_model().warnings)
    assert any("cannot be reproduced" in w for w in paper_table_model().warnings)
    assert any("22.59" in w and "35.27" in w for w in paper_table_model().warnings)
