"""How often a run without drift is said to drift: the test promises one run in a hundred.

Every run has independent normal noise of 0.4 µm about levels of its own, a reading every 7.9 s in
a standard cycle, and no drift. It is tested as measured, and once more with its readings rounded
to steps of the noise's standard deviation, as a coarse display gives them. The table has the
shares of runs with `p_no_drift` below 0.01 (`significant`), 0.05 and 0.1, as `evaluate_drift` gives
it, and of runs with a warning that the model does not hold. With 2,000 runs, a share of one percent
has a standard error of 0.22. Long runs, which take longer, are fewer.

    python benchmarks/drift_calibration.py [--runs 2000] [--designs 5x5 8x5 ...] [--processes 2]
"""

import argparse
import os
import time
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np
from drift_evidence import DOES_NOT_HOLD

from thermaxis.positioning import PositioningTest, TimeSource, evaluate_drift
from thermaxis.quantities import AxisKind

DESIGNS = ("5x5", "8x5", "11x5", "16x10", "16x30", "16x100")
FEWER = {30: 4, 100: 20}
"""By how much the runs of so many cycles are fewer. [1]"""
NOISE_UM, STOP_S = 0.4, 252.0 / 32.0


def silent(seed: int, targets: int, cycles: int, step_um: float) -> PositioningTest:
    """Return a run without drift, its readings rounded to a step unless that is zero."""
    rng = np.random.default_rng(seed)
    up = np.arange(targets)
    visit = np.stack((up, 2 * targets - 1 - up), axis=1)
    number = visit[:, None, :] + 2.0 * targets * np.arange(cycles)[None, :, None]
    deviation = rng.normal(0.0, 3.0, (targets, 1, 2)) + rng.normal(0.0, NOISE_UM, number.shape)
    if step_um > 0.0:
        deviation = step_um * np.round(deviation / step_um)
    return PositioningTest(
        kind=AxisKind.LINEAR,
        target=20.0 * up,
        deviation=deviation,
        time_source=TimeSource.FILE,
        time_s=STOP_S * number,
        order=number + 1.0,
    )


def judged(seed: int, targets: int, cycles: int, step_um: float) -> tuple[float, bool]:
    """Return the probability that a silent run is given, and whether a warning is."""
    result = evaluate_drift(silent(seed, targets, cycles, step_um))
    return result.p_no_drift, any(w.code in DOES_NOT_HOLD for w in result.warnings)


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description="False alarms of the test of drift.")
    parser.add_argument("--runs", type=int, default=2000)
    parser.add_argument("--designs", nargs="+", default=DESIGNS, metavar="TARGETSxCYCLES")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    print(
        "| targets x cycles | readings | runs | p < 0.01, % | p < 0.05, % | p < 0.1, % |"
        " warned, % | seconds |"
    )
    print("|---|---|" + "---:|" * 6, flush=True)
    with ProcessPoolExecutor(arguments.processes) as pool:
        for design in arguments.designs:
            targets, cycles = (int(part) for part in design.split("x"))
            for name, step_um in (("as measured", 0.0), ("rounded", NOISE_UM)):
                since = time.perf_counter()
                one = partial(judged, targets=targets, cycles=cycles, step_um=step_um)
                runs = arguments.runs // FEWER.get(cycles, 1)
                p, said = np.array(list(pool.map(one, range(runs), chunksize=5))).T
                every = (*(np.mean(p < below) for below in (0.01, 0.05, 0.1)), np.mean(said))
                shares = (f"{100.0 * float(share):.2f}" for share in every)
                seconds = f"{time.perf_counter() - since:.0f}"
                print(
                    "| " + " | ".join((design, name, str(runs), *shares, seconds)) + " |",
                    flush=True,
                )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
