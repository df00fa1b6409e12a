"""Ten thousand runs of 5 cycles x 11 targets x 2 approaches in one vectorised call."""

import time

import numpy as np

from thermaxis.positioning import iso230_2_figures

RUNS, TARGETS, CYCLES = 10_000, 11, 5
LIMIT_S = 1.0


def main() -> int:
    """Measure both ways in one run, print, and return 1 if the promise is not kept."""
    deviation = np.random.default_rng(1).normal(size=(RUNS, TARGETS, CYCLES, 2))
    since = time.perf_counter()
    together = iso230_2_figures(deviation)
    vectorised_s = time.perf_counter() - since
    since = time.perf_counter()
    alone = [iso230_2_figures(run) for run in deviation[:1000]]
    loop_s = (time.perf_counter() - since) * RUNS / 1000
    same = all(float(together.A[i]) == float(figures.A) for i, figures in enumerate(alone))
    print(f"{RUNS} runs in one call: {vectorised_s:.3f} s (at most {LIMIT_S:g} s)")
    print(f"the same one by one:   {loop_s:.3f} s, {loop_s / vectorised_s:.0f} times as long")
    print(f"same figures: {same}")
    return 0 if same and vectorised_s < LIMIT_S else 1


if __name__ == "__main__":
    raise SystemExit(main())
