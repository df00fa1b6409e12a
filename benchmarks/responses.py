"""How often the 95 % bands of Bode diagrams and step responses hold the truth.

On the four machines of tests/thermal_machines.py the true response of an input is the ratio of two
responses, known at every frequency. Shares of gains and phases within their bands at periods of
20 min, 1, 4 and 16 h, both inputs together; of steps on `direct`, where the truth is a sum of lags,
after 10 min, 1, 4 and 8 h.

    python benchmarks/responses.py [--tests 12]
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from benchmarks.thermal_machines import NAMES, NORMAL_95, experiment
from tests.thermal_machines import KINDS, TRUE_TAU_S, log, machine
from thermaxis.thermal import ModalPart, ThermalModel, frequency_response, modal, step_response

PERIODS_S = np.array([16.0, 4.0, 1.0, 1.0 / 3.0]) * 3600.0
TIMES_S = np.array([600.0, 3600.0, 4 * 3600.0, 8 * 3600.0])
GAINS = ((10.0, 30.0, -16.0), (6.0, 9.0, 17.0))


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--tests", type=int, default=12)
    tests = parser.parse_args().tests
    true_steps = step_response(
        ThermalModel(
            tuple(
                ModalPart(name, 0.0, np.array(gains), np.array(TRUE_TAU_S))
                for name, gains in zip(NAMES, GAINS, strict=True)
            )
        ),
        TIMES_S,
    )
    for hours in (72.0, 8.0):
        for kind in KINDS:
            true = np.array([machine(kind).response(2j * np.pi / p) for p in PERIODS_S])
            held = {"gain": [], "phase": [], "step": []}
            for seed in range(tests):
                result = modal([experiment(log(kind, hours, seed, step_s=10.0))], input_names=NAMES)
                s = 2j * np.pi / PERIODS_S[:, None]
                plain, square = result.posterior.deviations(
                    lambda tau_s, s=s: 1.0 / (1.0 + s * tau_s)
                )
                found = frequency_response(result.model, 1.0 / PERIODS_S)
                turned = (square * np.conj(found / np.abs(found)) ** 2).real
                across = np.sqrt((plain - turned) / 2.0) / np.abs(found)
                t_s = TIMES_S[:, None]
                step, _ = result.posterior.deviations(
                    lambda tau_s, t_s=t_s: -np.expm1(-t_s / tau_s)
                )
                apart = {
                    "gain": (np.abs(found) - np.abs(true), np.sqrt((plain + turned) / 2.0)),
                    "phase": (np.angle(found * np.conj(true)), across),
                    "step": (step_response(result.model, TIMES_S) - true_steps, np.sqrt(step)),
                }
                for key, (error, std) in apart.items():
                    held[key].append(np.abs(error) <= NORMAL_95 * std)
            for key, inside in held.items():
                if key != "step" or kind == "direct":
                    shares = 100.0 * np.mean(inside, axis=(0, 2))
                    print(f"{hours:3g} h  {kind:8s} {key:6s}", *(f"{s:6.0f} %" for s in shares))


if __name__ == "__main__":
    main()
