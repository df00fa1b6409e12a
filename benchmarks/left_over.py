"""How often the residual test flags a residual without an input's doing, and how often with it.

Tests of 8 h with one source that switches at random every hour, a drift of 1 µm and noise of
0.4 µm, on means of 72 s. `drift`, walks, `white`: what is left has nothing to do with the input.
The others add what a wrong model leaves.

    python benchmarks/left_over.py
"""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from thermaxis.thermal import analyse_residuals

ROWS, STEP_S = 400, 72.0
SEEDS = {"drift": 400, "walk": 400, "noisy walk": 400, "white": 400}
FEW_SEEDS = 80

Array = NDArray[np.float64]


def lagged(u: Array, tau_s: float) -> Array:
    alpha = -np.expm1(-STEP_S / tau_s)
    return lfilter([0.0, alpha], [1.0, alpha - 1.0], u)


def test_of(case: str, seed: int) -> tuple[Array, Array]:
    """Return residual and input of one test."""
    rng = np.random.default_rng(seed)
    on = np.repeat(rng.random(8) > 0.5, ROWS // 8).astype(float)
    hall = 0.5 * np.sqrt(STEP_S / 86_400.0) * np.cumsum(rng.normal(size=ROWS))
    u = 20.0 * lagged(on, 2400.0) + hall
    seen = np.round((u + rng.normal(0.0, 0.05 / np.sqrt(STEP_S / 10.0), ROWS)) / 0.02) * 0.02
    pole = np.exp(-STEP_S / 7200.0)
    drift = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], rng.normal(size=ROWS + 500))[500:]
    noise = rng.normal(0.0, 0.4 / np.sqrt(STEP_S / 10.0), ROWS)
    y = 4.0 * lagged(u, 3000.0)
    late = round(300.0 / STEP_S)
    e = {
        "drift": drift + noise,
        "walk": np.sqrt(STEP_S / 3600.0) * np.cumsum(rng.normal(size=ROWS)) + noise,
        "noisy walk": 0.25 * np.sqrt(STEP_S / 3600.0) * np.cumsum(rng.normal(size=ROWS)) + noise,
        "white": 0.2 * (drift + noise) + rng.normal(size=ROWS),
        "DC gain 10 % wrong": drift + noise + 0.1 * y,
        "600 s missing": drift + noise + 0.4 * (u - lagged(u, 600.0)),
        "late by 300 s": drift + noise + y - np.concatenate([np.zeros(late), y[:-late]]),
        "12,000 s missing": drift + noise + 0.3 * lagged(u, 12_000.0),
    }[case]
    return e, seen


def main() -> None:
    for case in (
        *SEEDS,
        "DC gain 10 % wrong",
        "600 s missing",
        "late by 300 s",
        "12,000 s missing",
    ):
        flagged = []
        for seed in range(SEEDS.get(case, FEW_SEEDS)):
            e, u = test_of(case, seed)
            flagged.append(not analyse_residuals([e], [u[:, None]]).independent[0])
        print(f"{case:20s}{100.0 * np.mean(flagged):6.1f} % of {len(flagged)}")


if __name__ == "__main__":
    main()
