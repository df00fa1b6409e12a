"""Three public runs through the command: every printed digit of independently computed figures.

The expected numbers were computed from the same files by an independent implementation and are
facts about public data sets; the sets themselves are no part of the project.
"""

import json
from contextlib import redirect_stdout
from functools import cache
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

from thermaxis.cli import main
from thermaxis.files import read_positioning

pytestmark = pytest.mark.real_data

PSI = "positioning/psi_ecmccfg/psi_fat_sat_2023/report.md_ISO230.dat"
ESS = "positioning/psi_ecmccfg/ess_mcu1025_2021/report.md_ISO230.dat"
B02 = "positioning/ess_target_b02_x/target_x_ISO230.dat"
B02_TIMES = "positioning/ess_target_b02_x/x_positioning_with_times.csv"
KEYS = (
    *("B", "B_mean", "M", "E_forward", "E_backward", "E"),
    *("R_forward", "R_backward", "R", "A_forward", "A_backward", "A"),
)
FIGURES = {
    PSI: "0.01220 -0.00540 0.02770 0.03300 0.02460 0.03680"
    " 0.062903 0.050327 0.068815 0.088807 0.064282 0.088807",
    ESS: "43.4594 -7.1849 48.0935 46.1161 74.7720 74.7720"
    " 204.7595 18.2970 204.7595 204.7595 89.2653 204.7595",
    B02: "33.5757 -25.3683 93.6527 98.0339 90.6452 122.8472"
    " 19.3653 28.3114 55.1606 111.4976 108.4219 135.2711",
}
B02_TARGETS = {
    "mean_forward": "-50.7818 0.5598 45.4320 11.4422 -52.6019 -32.2155 -33.1209 -19.6133 16.7421",
    "mean_backward": "-20.3999 27.6661 70.2452 27.4111 -19.0262 -14.0354 -3.7217 6.0188 39.9994",
    "s_forward": "1.2420 1.6733 3.0172 1.6480 3.7146 2.8604 4.8413 0.8877 1.1725",
    "s_backward": "1.6276 4.5503 2.4974 1.0195 7.0779 3.5223 4.6918 0.8491 0.8491",
    "B": "-30.3819 -27.1062 -24.8133 -15.9689 -33.5757 -18.1800 -29.3992 -25.6322 -23.2573",
    "R": "36.1210 39.5535 35.8425 21.3041 55.1606 30.9454 48.4656 29.1057 27.3005",
}
B02_ADJACENT = {
    ("forward", "mean_difference"): "-51.3416 -44.8722 33.9898 64.0441 -20.3865 0.9054 -13.5076"
    " -36.3554",
    ("forward", "standard_uncertainty"): "0.7616 0.9101 0.7704 1.0146 0.4669 1.0599 1.7820 0.9064",
    ("backward", "mean_difference"): "-48.0660 -42.5792 42.8341 46.4374 -4.9908 -10.3138 -9.7405"
    " -33.9805",
    ("backward", "standard_uncertainty"): "1.4797 1.0864 0.7393 2.7480 1.7592 1.0245 2.2239 0.2006",
}
OTHER_STANDARDS = {
    PSI: "0.097123 0.116711 0.012200 0.005720 0.084923 0.057785 0.027700 0.107228",
    ESS: "307.1392 307.1392 43.4594 19.5506 157.8594 55.9122 48.0935 168.6529",
    B02: "65.9530 141.4831 33.5757 25.3683 32.3773 15.9140 93.6527 147.3078",
}
WRONG_RULES = {
    "E takes the larger of both minima": (0.0246, 65.144, 90.645),
    "R forgets the reversal value": (0.0629, 204.7595, 28.311),
    "R_i adds in quadrature": (0.0629, 204.7595, 35.428),
    "the approaches are exchanged": (0.0054, 7.185, 25.368),
    "B_i has no absolute value": (0.0629, 204.7595, 28.311),
    "n in place of n - 1": (0.0628, 183.142, 52.882),
}


@cache
def evaluated(path: Path, *options: str) -> dict[str, object]:
    with redirect_stdout(StringIO()) as out:
        assert main(["evaluate", str(path), "--json", "-", *options]) == 0
    return json.loads(out.getvalue())


def agrees_to_every_printed_digit(values: list[float], printed: str) -> None:
    for value, text in zip(values, printed.split(), strict=True):
        decimals = len(text.partition(".")[2])
        assert f"{value:.{decimals}f}" == text


@pytest.mark.parametrize("name", FIGURES)
def test_the_figures_of_public_runs_to_every_printed_digit(real_data: Path, name: str) -> None:
    iso230_2 = evaluated(real_data / name)["iso230_2"]
    agrees_to_every_printed_digit([iso230_2[key] for key in KEYS], FIGURES[name])


def test_targets_and_adjacent_differences_of_the_warming_axis(real_data: Path) -> None:
    targets = evaluated(real_data / B02)["iso230_2"]["targets"]
    assert [row["position"] for row in targets] == [-20, -15, -10, -5, 0, 5, 10, 15, 20]
    for key, printed in B02_TARGETS.items():
        agrees_to_every_printed_digit([row[key] for row in targets], printed)
    adjacent = evaluated(real_data / B02)["adjacent_difference"]
    for (approach, key), printed in B02_ADJACENT.items():
        agrees_to_every_printed_digit(adjacent[approach][key], printed)
    assert adjacent["student_factor"] == pytest.approx(2.869, abs=5e-4)
    assert adjacent["reference_cycle"] == 1


def test_the_same_run_with_times_agrees_within_its_rounding(real_data: Path) -> None:
    """The table with times prints 0.001 µm, so its means may be off by half of that."""
    exact = evaluated(real_data / B02)["iso230_2"]
    rounded = evaluated(real_data / B02_TIMES)["iso230_2"]
    for key in KEYS:
        assert rounded[key] == pytest.approx(exact[key], abs=3e-3)


def test_the_older_conventions_on_public_runs(real_data: Path) -> None:
    for name, printed in OTHER_STANDARDS.items():
        old = evaluated(real_data / name, "--no-drift", "--edition", "1988")["iso230_2_1988"]
        vdi = evaluated(real_data / name, "--no-drift", "--edition", "vdi3441")["vdi3441"]
        values = [old["R"], old["A"]]
        values += [vdi[key] for key in ("U_max", "U_mean", "Ps_max", "Ps_mean", "Pa", "P")]
        agrees_to_every_printed_digit(values, printed)
        assert old["mark"] == vdi["mark"] == "unverified: from memory"


def test_the_times_of_the_warming_axis_come_from_the_file(real_data: Path) -> None:
    test = read_positioning(real_data / B02_TIMES)
    assert test.time_source == "file"
    assert test.order is not None
    assert test.order[8, 0, 1] == 10
    assert test.time_s is not None
    assert np.max(test.time_s) / 60.0 == pytest.approx(40.58, abs=0.01)
    assert read_positioning(real_data / B02).time_source == "none"


def wrong_figures(x: np.ndarray) -> dict[str, float]:
    """Apply the wrong rules that stand in public code."""
    mean, s = x.mean(axis=1), x.std(axis=1, ddof=1)
    b = mean[:, 0] - mean[:, 1]
    low = mean.min(axis=0)
    four_s = 4 * s.max(axis=1)
    biased = 2 * x.std(axis=1, ddof=0)
    return {
        "E takes the larger of both minima": float(mean.max() - low.max()),
        "R forgets the reversal value": float(four_s.max()),
        "R_i adds in quadrature": float(
            max(np.maximum(np.sqrt(2 * s[:, 0] ** 2 + 2 * s[:, 1] ** 2 + b**2), four_s))
        ),
        "the approaches are exchanged": float(np.mean(-b)),
        "B_i has no absolute value": float(max(np.maximum(2 * s[:, 0] + 2 * s[:, 1] + b, four_s))),
        "n in place of n - 1": float(
            max(np.maximum(biased.sum(axis=1) + abs(b), 2 * biased.max(axis=1)))
        ),
    }


def test_the_wrong_rules_of_public_code_are_not_ours(real_data: Path) -> None:
    """Each wrong rule gives the number that public reports print, and ours is another one."""
    for rule, found in WRONG_RULES.items():
        differs = False
        for name, printed in zip((PSI, ESS, B02), found, strict=True):
            wrong = wrong_figures(read_positioning(real_data / name).deviation)[rule]
            decimals = 4 if name == PSI else 3
            assert wrong == pytest.approx(printed, abs=0.6 * 10.0**-decimals), rule
            iso230_2 = evaluated(real_data / name)["iso230_2"]
            key = "B_mean" if "exchanged" in rule else rule[0] if rule[0] in "ER" else "R"
            differs |= abs(iso230_2[key] - wrong) > 0.05 * abs(wrong)
        assert differs, rule
