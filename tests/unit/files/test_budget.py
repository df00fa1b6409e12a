from functools import partial
from pathlib import Path

import numpy as np

from tests.refusals import refusal_of
from thermaxis.files import read_budget
from thermaxis.positioning import PositioningTest, StartEnd, UncertaintyBudget, evaluate_uncertainty
from thermaxis.quantities import AxisKind

FULL = """
[device]
expanded_uncertainty_um = 0.1
expanded_uncertainty_um_per_m = 0.5
[alignment]
misalignment_mm = 1
[material]
temperature_interval_k = 0.2
expansion_coefficient_ppm_per_k = 11.7
expansion_coefficient_interval_ppm_per_k = 2.0
largest_difference_to_20_c_k = 4.6
[environment]
variation_um = 0.8
"""


def budget_of(folder: Path, text: str, kind: AxisKind = AxisKind.LINEAR) -> UncertaintyBudget:
    path = folder / "budget.toml"
    path.write_text(text, encoding="utf-8")
    return read_budget(path, kind)


def test_every_key_reaches_its_field(tmp_path: Path) -> None:
    assert budget_of(tmp_path, FULL) == UncertaintyBudget(
        device=0.1,
        device_um_per_m=0.5,
        misalignment_mm=1.0,
        material_temperature_interval_k=0.2,
        expansion_coefficient_ppm_per_k=11.7,
        expansion_coefficient_interval_ppm_per_k=2.0,
        largest_difference_to_20_c_k=4.6,
        environmental_variation=0.8,
    )
    text = "[device]\nerror_range_um = 0.4\nerror_range_um_per_m = 1.0\n"
    expected = UncertaintyBudget(device_range=0.4, device_range_um_per_m=1.0)
    assert budget_of(tmp_path, text) == expected


def test_a_budget_may_state_one_term_alone_and_zero_is_a_statement(tmp_path: Path) -> None:
    budget = budget_of(tmp_path, "[environment]\nvariation_um = 0\n")
    assert budget == UncertaintyBudget(environmental_variation=0.0)


def test_a_rotary_axis_has_its_units_and_no_terms_of_expansion(tmp_path: Path) -> None:
    text = "[device]\nexpanded_uncertainty_arcsec = 0.3\n[environment]\nvariation_arcsec = 0.5\n"
    expected = UncertaintyBudget(device=0.3, environmental_variation=0.5)
    assert budget_of(tmp_path, text, AxisKind.ROTARY) == expected
    for wrong, kind, key in (
        (FULL, AxisKind.ROTARY, "device.expanded_uncertainty_um"),
        ("[material]\n", AxisKind.ROTARY, "material"),
        (text, AxisKind.LINEAR, "device.expanded_uncertainty_arcsec"),
    ):
        assert refusal(tmp_path, wrong, kind).endswith(": other_kind_of_axis"), key


def refusal(folder: Path, text: str, kind: AxisKind = AxisKind.LINEAR) -> str:
    path = folder / "budget.toml"
    path.write_text(text, encoding="utf-8")
    return refusal_of(partial(read_budget, kind=kind), path)


def test_a_wrong_budget_is_an_error_that_names_file_and_key(tmp_path: Path) -> None:
    for text, said in [
        ("[devices]\n", "devices: unknown_key_near"),
        (
            "[device]\nexpanded_uncertainty_mm = 1\n",
            "line 2, device.expanded_uncertainty_mm: unknown_key_near",
        ),
        ("device = 3\n", "device: not_a_table"),
        ("[alignment]\nmisalignment_mm = -1\n", "alignment.misalignment_mm: outside_range"),
        ("[alignment]\nmisalignment_mm = nan\n", "alignment.misalignment_mm: not_finite"),
        ("[alignment]\nmisalignment_mm = inf\n", "alignment.misalignment_mm: not_finite"),
        ("[alignment]\nmisalignment_mm = true\n", "alignment.misalignment_mm: no_number"),
        ("[alignment]\nmisalignment_mm = '1'\n", "alignment.misalignment_mm: no_number"),
        ("", "no_uncertainty_term"),
        ("[material]\nexpansion_coefficient_ppm_per_k = 11.5\n", "no_uncertainty_term"),
        ("[device\n", "not_toml"),
    ]:
        assert refusal(tmp_path, text).endswith(said)
    twice = "[device]\nexpanded_uncertainty_um = 1\nerror_range_um = 1\n"
    refusal(tmp_path, twice)  # by its expanded uncertainty and by its range


def test_the_example_states_every_term(root: Path) -> None:
    budget = read_budget(root / "examples" / "budget.toml", AxisKind.LINEAR)
    target = np.linspace(0.0, 300.0, 5)
    scatter = np.random.default_rng(1).normal(0.0, 0.3, (5, 3, 2))
    deviation = scatter + 0.02 * target[:, None, None]
    test = PositioningTest(
        kind=AxisKind.LINEAR,
        target=target,
        deviation=deviation,
        environment={"air_temperature_c": StartEnd(24.0, None)},
    )
    stated = evaluate_uncertainty(test, None, budget=budget, samples=100).measured
    assert [row.quantity for row in stated.budget if row.figure == "E"] == [
        "noise",
        "extremes",
        "device",
        "misalignment",
        "material_temperature",
        "expansion_coefficient",
        "environmental_variation",
    ]


def test_the_how_to_names_every_key_and_its_examples_are_read(root: Path, tmp_path: Path) -> None:
    page = (root / "docs" / "how-to" / "uncertainty-budget.md").read_text(encoding="utf-8")
    blocks = [part.split("```")[0] for part in page.split("```toml\n")[1:]]
    kinds = [AxisKind.ROTARY if "arcsec" in block else AxisKind.LINEAR for block in blocks]
    assert set(kinds) == {AxisKind.LINEAR, AxisKind.ROTARY}
    for block, kind in zip(blocks, kinds, strict=True):
        budget_of(tmp_path, block, kind)
    for line in FULL.splitlines():
        assert line.split(" = ")[0] in page
    for key in ("error_range_um", "error_range_um_per_m", "error_range_arcsec"):
        assert f"`{key}`" in page
