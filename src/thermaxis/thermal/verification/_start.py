"""How a log began, by what the free run leaves of its displacement."""

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from thermaxis.thermal._arrays import FloatArray

BLOCKS = 200
"""Blocks that the rows of a log are averaged to. [1]"""
FEWEST_BLOCKS = 20
"""Blocks with measured rows below which a log is taken to begin at rest. [1]"""
REST_ODDS = 3.0
"""Logarithm of how much more likely another start must be than rest: 20 times. [1]"""
TOLD_SHARE = 0.02
"""Share of the displacement's range up to which a start is not worth a word. [1]"""
MODEL_ERROR = 0.15
"""Share of the displacement that a model may err by without its start being wrong. [1]"""


class LogStart(StrEnum):
    """State of the machine at the first row of a log."""

    REST = "rest"
    """Every lag is at the reference of the log, as `cycle` starts."""
    STEADY = "steady"
    """Inputs were for long what they are in the first row."""
    FITTED = "fitted"
    """States of the lags and the zero of the log are estimated from measured rows."""


class StartOfLog(NamedTuple):
    """A start, with what a fitted one adds to the free run from rest."""

    start: LogStart
    states_k: FloatArray
    """States of the lags at the first row, (j,); zero unless fitted. [K]"""
    zero_um: float
    """Displacement of the model at the log's zero; zero unless fitted. [µm]"""
    matters: bool = False
    """Whether it moves the free run by more than the noise and `TOLD_SHARE` of the range."""


def start_of_log(
    time_s: FloatArray,
    measured_um: FloatArray,
    left_um: Sequence[FloatArray],
    fading_um_per_k: FloatArray,
    spread_k: FloatArray,
    asked: LogStart | None,
) -> StartOfLog:
    """Return how a log began: as asked, or else at rest unless another start is far more likely.

    Parameters are times and displacements, (n,), what the free run leaves of these from rest and
    from the steady state of the first row, unless that is rest but for noise, (n,) each, what one
    kelvin in each lag at the first row of the log does, (n, j), and the root mean square of the
    lags' inputs, (j,).

    Notes
    -----
    States x and zero z are the most likely ones for what rest leaves, e = F x + z + noise, with the
    priors x ~ N(0, spread^2) and z ~ N(0, mean of e^2). Noise of lag-one correlation r counts as
    m = n (1 - r) / (1 + r) of the n blocks. Slow states can take the place of a wrong gain as well:
    with e left by rest, d by a fitted start and s = std(d) + 0.15 |displacement|,

        log odds of a fitted start = m / 2 mean((e^2 - d^2) / s^2) - (j + 1) / 2 log m,
        of a steady one = m / 2 log(sum of e^2 from rest / sum of e^2).

    References
    ----------
    Schwarz 1978 (BIC); Ljung 1999, section 3.2 (initial conditions of a simulation).
    """
    lags = fading_um_per_k.shape[1]
    rest = StartOfLog(LogStart.REST, np.zeros(lags), 0.0)
    if asked in (LogStart.REST, LogStart.STEADY):
        return rest._replace(start=asked)
    since_s = time_s - time_s[:1]
    number = np.floor(BLOCKS * since_s / max(float(np.max(since_s, initial=0.0)), 1e-9))
    _, first = np.unique(number, return_index=True)
    if first.size < FEWEST_BLOCKS or float(np.ptp(left_um[0])) == 0.0:
        return rest._replace(start=asked or LogStart.REST)
    every = (*fading_um_per_k.T, np.ones(time_s.size), measured_um, left_um[0], left_um[-1])
    means = np.column_stack([np.add.reduceat(one, first) for one in every])
    means /= np.diff(np.append(first, since_s.size))[:, None]
    columns, measured, left, steady = means[:, :-3], means[:, -3], means[:, -2], means[:, -1]
    variance = counted = float(np.mean(left**2))
    prior = 1.0 / np.append(np.maximum(spread_k, 1e-6) ** 2, variance)
    independent = float(first.size)
    states, after = np.zeros(lags + 1), left
    for _ in range(3):
        precision = columns.T @ columns / counted + np.diag(prior)
        solved = np.linalg.solve(precision, columns.T @ left / counted)
        states = np.asarray(solved, dtype=np.float64)
        after = left - columns @ states
        about = after - np.mean(after)
        r = float(about[1:] @ about[:-1] / max(about @ about, 1e-300))
        independent = max(first.size * (1.0 - r) / (1.0 + r), 3.0)
        counted = max(float(np.mean(after**2)), 1e-9 * variance) * first.size / independent
    floor = 1e-9 * float(left @ left)
    of_steady = (
        0.5 * independent * math.log(float(left @ left) / max(float(steady @ steady), floor))
    )
    s: FloatArray = math.sqrt(max(float(np.mean(after**2)), floor)) + MODEL_ERROR * np.abs(measured)
    of_fitted = 0.5 * independent * float(np.mean((left**2 - after**2) / s**2))
    of_fitted -= 0.5 * (lags + 1) * math.log(independent)
    best = LogStart.FITTED if of_fitted > of_steady + REST_ODDS else LogStart.STEADY
    start = asked or (best if max(of_fitted, of_steady) > REST_ODDS else LogStart.REST)
    if start is LogStart.REST:
        return rest
    ends = after if start is LogStart.FITTED else steady
    least_um = TOLD_SHARE * float(np.ptp(measured))
    matters = float(np.max(np.abs(left - ends))) > max(float(np.std(ends)), least_um)
    if start is LogStart.STEADY:
        return rest._replace(start=start, matters=matters)
    return StartOfLog(start, states[:-1], float(states[-1]), matters)
