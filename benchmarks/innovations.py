"""How honest the uncertainty between touches is, and what touches are worth on the lathe.

Three machines are touched every hour with 1 um of noise: the virtual lathe on ordinary days, and
two that were written for this and used for nothing else. A model is identified on touches of the
first two days, drift and discrepancy are the likeliest of two weeks, and then all of it is left
alone: shares of the innovations within two standard deviations, 0.954 if they are normal.

    python benchmarks/innovations.py               at least 5,000 touches of each machine
    python benchmarks/innovations.py 500           so many
    python benchmarks/innovations.py lathe         true error of the lathe by how it was learnt

*Coloured*: two sources at random powers for random times, three lags each, disturbed by coloured
noise of 0.8 um with 2 h and by touches of which neighbours share some noise. *Nonlinear*: heat
leaves by natural convection, a joint that conducts better when it is warm, and a displacement with
a quadratic part. Sensors of both show steps of 0.1 K. `lathe` compares with the calibration tests
of the tutorial, on other days and seeds, at the tool centre point.
"""

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import product
from typing import cast

import numpy as np

from thermaxis.compensation import CompensationModel
from thermaxis.thermal import (
    MeasuredOutput,
    ThermalLog,
    TouchFigures,
    TouchPlan,
    identify,
    parse_input,
    records_of,
    verify,
)
from thermaxis.virtual import LatheSettings, VirtualLathe, log_lathe

ROW_S = 300.0
HOUR = 3600.0
NOISE_UM = 1.0
LEARN_DAYS, RATE_DAYS = 2.0, 14.0
RULES = ("probe_and_hold", "free_run", "with_offset")
Record = tuple[np.ndarray, np.ndarray, np.ndarray]


def powers(rng: np.random.Generator, rows: int) -> np.ndarray:
    """Return powers of two sources that change after some tens of minutes to hours, (rows, 2)."""
    found = np.zeros((rows, 2))
    for k in range(2):
        row = int(rng.integers(3, 10))
        while row < rows:
            behind = row + max(2, int(rng.exponential(18.0)))
            found[row:behind, k] = rng.choice([0.0, rng.uniform(0.2, 1.0)], p=[0.35, 0.65])
            row = behind
    return found


def lagged(u: np.ndarray, lag_s: float) -> np.ndarray:
    """Return a first-order lag of held inputs."""
    alpha, x = -math.expm1(-ROW_S / lag_s), np.zeros_like(u)
    for k in range(1, u.size):
        x[k] = x[k - 1] + alpha * (u[k - 1] - x[k - 1])
    return x


def colour(rng: np.random.Generator, rows: int, sigma: float, time_s: float) -> np.ndarray:
    """Return noise with a correlation time."""
    a, x = math.exp(-ROW_S / time_s), np.zeros(rows)
    steps = sigma * math.sqrt(1.0 - a * a) * rng.standard_normal(rows)
    for k in range(1, rows):
        x[k] = a * x[k - 1] + steps[k]
    return x


def coloured(days: float, seed: int) -> Record:
    """Return temperatures, displacement and touches of the first machine."""
    rng, rows = np.random.default_rng((1, seed)), int(days * 86_400.0 / ROW_S)
    heat = powers(rng, rows)
    hall = colour(rng, rows, 0.5, 5.0 * HOUR)
    z, temperature = 1.5 * hall, [22.0 + hall]
    for k, (gains, lags) in enumerate(
        (((-18.0, -26.0, 9.0), (500.0, 2500.0, 9000.0)), ((6.0, 21.0, 8.0), (900.0, 4000.0, 15e3)))
    ):
        bearing = 9.0 * lagged(heat[:, k], 1200.0) + 3.0 * lagged(heat[:, k], 7000.0)
        temperature.append(22.0 + hall + bearing)
        z = z + sum(g * lagged(heat[:, k], lag) for g, lag in zip(gains, lags, strict=True))
    z = z + colour(rng, rows, 0.8, 2.0 * HOUR)
    return np.array(temperature), z, colour(rng, rows, NOISE_UM, 0.4 * HOUR)


def nonlinear(days: float, seed: int) -> Record:
    """Return temperatures, displacement and noise of touches of the second machine."""
    rng, rows = np.random.default_rng((2, seed)), int(days * 86_400.0 / ROW_S)
    heat = powers(rng, rows)
    daily = np.sin(2.0 * np.pi * np.arange(rows) * ROW_S / 86_400.0)
    hall = 21.0 + 0.8 * daily + colour(rng, rows, 0.3, 3.0 * HOUR)
    state = np.full((rows, 4), hall[0])  # two bearings, housing, columns
    inner = 10
    for k in range(1, rows):
        one, other, housing, columns = state[k - 1]
        for _ in range(inner):
            step_s = ROW_S / inner
            rise = np.array([one, other, housing, columns]) - hall[k]
            out = np.array([4.0, 6.0, 25.0, 110.0]) * rise * (1.0 + 0.25 * np.abs(rise) ** 0.25)
            joint = 22.0 * (1.0 + 0.02 * (one - housing)) * (one - housing)
            second = 18.0 * (other - housing)
            inward = 12.0 * (housing - columns)
            one += step_s * (260.0 * heat[k, 0] - joint - out[0]) / 9e3
            other += step_s * (220.0 * heat[k, 1] - second - out[1]) / 16e3
            housing += step_s * (joint + second - inward - out[2]) / 180e3
            columns += step_s * (inward - out[3]) / 1.6e6
        state[k] = one, other, housing, columns
    rise = state - state[0]
    z = -4.0 * rise[:, 0] + 3.0 * rise[:, 1] - 6.0 * rise[:, 2] + 11.0 * rise[:, 3]
    z = z - 0.06 * rise[:, 0] ** 2
    noise = NOISE_UM * rng.standard_normal(rows)
    return np.array([state[:, 3], state[:, 0], state[:, 1]]), z, noise


def generated(make: Callable[[float, int], Record], days: float, seed: int) -> ThermalLog:
    """Return the log of a machine that is touched each hour, its truth beside."""
    temperature, z, noise = make(days, seed)
    touches = np.full(z.size, np.nan)
    rows = slice(0, None, int(HOUR / ROW_S))
    touches[rows] = (np.round((z + noise) * 10.0) / 10.0)[rows]
    names = ("T_column_C", "T_spindle_C", "T_table_C")
    sensors = np.round(10.0 * temperature) / 10.0
    columns = dict(zip(names, sensors, strict=True)) | {"Z_um": touches, "true_um": z - z[0]}
    return ThermalLog.from_columns(columns, sample_time_s=ROW_S, name=make.__name__)


def lathe(days: float, seed: int, scenario: str = "day", row_s: float = ROW_S) -> ThermalLog:
    """Return the log of the lathe in production, its truth beside."""
    settings = LatheSettings(touch_every_s=HOUR, touch_noise_um=NOISE_UM)
    log = log_lathe(VirtualLathe(scenario, seed, settings), 24.0 * days, every_s=row_s, truth=True)
    columns = {**log.columns, "true_um": log.columns["Z_uncorrected_um"]}
    return replace(log, columns=columns, units={**log.units, "true_um": "um"})


def learnt(logs: Sequence[ThermalLog]) -> CompensationModel:
    """Return the model of spindle and table over the columns."""
    inputs = [parse_input(f"{k}=T_{k}_C-T_column_C") for k in ("spindle", "table")]
    records = records_of(logs, inputs, ["Z_um"])
    return identify(records).to_compensation_model(records)


def touched(
    model: CompensationModel, log: ThermalLog, plan: TouchPlan, first_day: float = 0.0
) -> TouchFigures:
    """Return what touches are worth beside the truth, from a day on."""
    rows = (round(first_day * 86_400.0 / ROW_S), log.rows) if first_day else None
    found = verify(model, [log], [MeasuredOutput("true_um", "Z_um")], touches=plan, rows=rows)
    return cast("TouchFigures", found.logs[0].outputs[0].touched)


def rated(model: CompensationModel, log: ThermalLog) -> TouchPlan:
    """Return how touches are believed: drift and discrepancy are the likeliest of a log."""
    plan = TouchPlan(channels={"Z_um": "Z_um"})
    return replace(plan, rules=touched(model, log, plan).likely or plan.rules)


def spans(log: ThermalLog, days: float) -> ThermalLog:
    return log.span(0, round(days * 86_400.0 / log.usual_step_s))


def innovations(touches: int) -> None:
    print("machine      touches excluded in 2 sigma  drift discrep.     hold free run   offset, um")
    machines = (
        ("lathe", lambda d: lathe(d, 3), 16),
        ("coloured", lambda d: generated(coloured, d, 1), 24),
        ("nonlinear", lambda d: generated(nonlinear, d, 1), 24),
    )
    for name, make, a_day in machines:
        log = make(RATE_DAYS + math.ceil(touches / a_day))
        model = learnt([spans(log, LEARN_DAYS)])
        plan = rated(model, spans(log, RATE_DAYS))
        found = touched(model, log, plan, RATE_DAYS)
        mae = "".join(f"{getattr(found, rule).mae_um:9.2f}" for rule in RULES)
        rules = plan.rules
        print(
            f"{name:<12} {found.touches:7d} {found.excluded:8d} {found.within_two_sigma:10.3f}"
            f"  {rules.drift_um_per_root_h:5.2f} {rules.discrepancy_um:8.2f}{mae}"
        )


def compared(seeds: int = 5) -> None:
    """Print the true error of the lathe by how its model was learnt, medians of seeds."""
    print("judged on                 model of             hold free run   offset, um")
    found: dict[tuple[str, str], list[tuple[float, ...]]] = {}
    for seed in range(1, seeds + 1):
        tests = ("calibration-spindle", "calibration-table")
        calibrated = [log_lathe(VirtualLathe(test, seed), 14.25, every_s=60.0) for test in tests]
        models = {
            "two days of touches": learnt([lathe(LEARN_DAYS, seed, row_s=60.0)]),
            "calibration tests": learnt(calibrated),
        }
        judges = {
            "seven days of production": lathe(7.0, seed + 100, row_s=60.0),
            "verification, 16 h": lathe(16.0 / 24.0, seed + 200, "verification", row_s=60.0),
        }
        for (learn, model), (judge, log) in product(models.items(), judges.items()):
            figures = touched(model, log, TouchPlan(channels={"Z_um": "Z_um"}))
            errors = tuple(getattr(figures, rule).mae_um for rule in RULES)
            found.setdefault((judge, learn), []).append(errors)
    for (judge, learn), errors in sorted(found.items()):
        medians = "".join(f"{one:9.2f}" for one in np.median(errors, axis=0))
        print(f"{judge:<25} {learn:<19}{medians}")


if __name__ == "__main__":
    if sys.argv[1:] == ["lathe"]:
        compared()
    else:
        innovations(int(sys.argv[1]) if len(sys.argv) > 1 else 5000)
