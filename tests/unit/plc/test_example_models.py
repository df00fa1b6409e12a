"""The example models that are exported are what the commands and numbers beside them make."""

from pathlib import Path

import pytest

from thermaxis.cli import main
from thermaxis.compensation import (
    STATED,
    CompensationModel,
    Output,
    Part,
    Provenance,
    Section,
)
from thermaxis.files import format_model, read_model

WARNING = "an example with stated numbers: no machine was measured"


def screw_model(end_um_per_k: float, fast_um_per_k: float) -> CompensationModel:
    """Return what a screw that warms does at one position of the axis."""
    sections = (Section(end_um_per_k - fast_um_per_k, 5400.0), Section(fast_um_per_k, 900.0))
    return CompensationModel(
        outputs=(Output("X_um", (Part("screw", "T_nut_C", "T_bed_C", 0.0, sections),)),),
        reference=STATED,
        reference_c={"T_nut_C": 20.0, "T_bed_C": 20.0},
        provenance=Provenance(method="stated numbers, examples/models/README.md"),
        warnings=(WARNING,),
    )


@pytest.mark.parametrize(
    ("name", "model"),
    [
        ("x_at_100", screw_model(1.25, 0.5)),
        ("x_at_500", screw_model(5.75, 2.0)),
        ("x_at_900", screw_model(10.0, 3.0)),
    ],
)
def test_the_models_at_positions_are_the_stated_numbers(
    root: Path, name: str, model: CompensationModel
) -> None:
    path = root / "examples" / "models" / f"{name}.json"
    assert path.read_text(encoding="ascii") == format_model(model)
    assert read_model(path) == model


def test_the_model_with_a_gain_by_diameter_is_what_combine_writes(
    root: Path, tmp_path: Path
) -> None:
    models = root / "examples" / "models"
    written = tmp_path / "spindle_table.json"
    gain = ("--gain", "table=0:1,1500:1.6,3000:2.2")
    parts = (str(models / "eps1.json"), str(models / "eps2.json"))
    assert main(["combine", *parts, *gain, "-o", str(written)]) == 0
    assert written.read_bytes() == (models / "spindle_table.json").read_bytes()


def test_every_example_model_is_described_beside_it(root: Path) -> None:
    folder = root / "examples" / "models"
    page = (folder / "README.md").read_text(encoding="utf-8")
    for path in folder.glob("*.json"):
        assert f"`{path.name}`" in page
