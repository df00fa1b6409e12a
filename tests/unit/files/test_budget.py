from pathlib import Path

import numpy as np
import pytest

from thermaxis.errors import ConfigurationError
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
        with pytest.raises(ConfigurationError) as caught:
            budget_of(tmp_path, wrong, kind)
        assert (caught.value.code, caught.value.place.key) == ("key_of_other_axis", key)


@pytest.mark.parametrize(
    ("text", "code", "key"),
    [
        (
            "[alignment]\nmisalignment_mm = -1\n",
            "not_a_number_from_zero",
            "alignment.misalignment_mm",
        ),
        (
            "[alignment]\nmisalignment_mm = nan\n",
            "not_a_number_from_zero",
            "alignment.misalignment_mm",
        ),
        (
            "[alignment]\nmisalignment_mm = inf\n",
            "not_a_number_from_zero",
            "alignment.misalignment_mm",
        ),
        (
            "[alignment]\nmisalignment_mm = true\n",
            "not_a_number_from_zero",
            "alignment.misalignment_mm",
        ),
        (
            "[alignment]\nmisalignment_mm = '1'\n",
            "not_a_number_from_zero",
            "alignment.misalignment_mm",
        ),
        ("", "budget_without_terms", ""),
        ("[material]\nexpansion_coefficient_ppm_per_k = 11.5\n", "budget_without_terms", ""),
    ],
)
def test_a_wrong_budget_is_an_error_that_names_file_and_key(
    tmp_path: Path, text: str, code: str, key: str
) -> None:
    with pytest.raises(ConfigurationError) as caught:
        budget_of(tmp_path, text)
    assert (caught.value.code, caught.value.place.key) == (code, key)
    assert caught.value.place.file.endswith("budget.toml")


def test_other_keys_and_two_statements_of_one_term_are_refused(tmp_path: Path) -> None:
    for text in (
        "[devices]\n",
        "[device]\nexpanded_uncertainty_mm = 1\n",
        "device = 3\n",
        "[device]\nexpanded_uncertainty_um = 1\nerror_range_um = 1\n",
        "[device\n",
    ):
        with pytest.raises(ConfigurationError, match=r"budget\.toml"):
            budget_of(tmp_path, text)


def test_a_missing_file_is_an_error_and_no_traceback(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError, match=r"nothing\.toml"):
        read_budget(tmp_path / "nothing.toml", AxisKind.LINEAR)


def test_the_example_states_every_term(root: Path) -> None:
    budget = read_budget(root / "examples" / "budget.toml", AxisKind.LINEAR)
    target = np.linspace(0.0, 300.0, 5)
    deviation = np.zeros((5, 1, 2)) + 0.02 * target[:, None, None]
    test = PositioningTest(
        kind=AxisKind.LINEAR,
        target=target,
        deviation=deviation,
        environment={"air_temperature_c": StartEnd(24.0, None)},
    )
    stated = evaluate_uncertainty(test, None, budget=budget, samples=100).measured
    assert [term.key for term in stated.terms] == [
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
