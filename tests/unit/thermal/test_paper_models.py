"""The published transfer functions ship as models that say what their digits leave open."""

from pathlib import Path

import numpy as np

from tests.printed_digits import (
    PAPER_SPINDLE,
    PAPER_TABLE,
    paper_spindle_model,
    paper_table_model,
)
from thermaxis.compensation import Reading, initial_state, model_step
from thermaxis.files import format_model, read_model
from thermaxis.thermal import (
    simulate_transfer_function,
)


def test_the_examples_are_what_the_functions_give(root: Path) -> None:
    for name, model in (("eps1", paper_spindle_model()), ("eps2", paper_table_model())):
        path = root / "examples" / "models" / f"{name}.json"
        assert path.read_text(encoding="ascii") == format_model(model)
        assert read_model(path) == model


def test_after_twenty_samples_the_cycle_equals_the_printed_difference_equation() -> None:
    for model, printed, within_um in (
        (paper_spindle_model(), PAPER_SPINDLE, 1e-7),
        (paper_table_model(), PAPER_TABLE, 0.02),
    ):
        part = model.outputs[0].parts[0]
        calm, warm = ({part.plus: c, part.minus: 20.0} for c in (20.0, 21.0))
        state, _ = model_step(model, initial_state(model, calm), Reading(-1.0, calm))
        said = []
        for k in range(2000):
            state, output = model_step(model, state, Reading(float(k), warm))
            said.append(output.model_um[0])
        expected = simulate_transfer_function(printed.transfer_function, np.ones(2000))
        assert np.max(np.abs(np.array(said) - expected)[20:]) < within_um
