"""What sources do through lags, exactly, in means over rows of time."""

import numpy as np

from thermaxis.thermal._arrays import FloatArray

_APART = 1e-3


def _integral(time_s: FloatArray, time_constants_s: FloatArray, rise_s: float) -> FloatArray:
    """Return the integral of the answer to a step at zero, (t, j). [s]

    Notes
    -----
    With the input 1 - exp(-t / r) and a lag T behind it the answer is
    1 - (T exp(-t / T) - r exp(-t / r)) / (T - r); its integral is
    t - (T^2 (1 - exp(-t / T)) - r^2 (1 - exp(-t / r))) / (T - r).
    """
    t = np.maximum(time_s, 0.0)[:, None]
    lag_s = np.maximum(time_constants_s, 1e-12)
    if rise_s <= 0.0:
        return np.asarray(t + lag_s * np.expm1(-t / lag_s))
    near = np.abs(lag_s - rise_s) < _APART * rise_s
    lag_s = np.where(near, rise_s * (1.0 + _APART), lag_s)
    own, risen = lag_s**2 * np.expm1(-t / lag_s), rise_s**2 * np.expm1(-t / rise_s)
    return np.asarray(t + (own - risen) / (lag_s - rise_s))


def pulses(
    blocks: int, block_s: float, rows: int, time_constants_s: FloatArray, rise_s: float
) -> FloatArray:
    """Return what full heat in one block does, (blocks, blocks rows, 1 + j), means over rows. [1]

    Parameters
    ----------
    blocks : int
        Number of blocks. [1]
    block_s : float
        Length of a block. [s]
    rows : int
        Rows per block. [1]
    time_constants_s : ndarray
        Lags behind the input, (j,); the input itself stands before them. [s]
    rise_s : float
        Time constant with which the input rises; zero: at once. [s]
    """
    count = blocks * rows
    edges_s = np.arange(count + 1) * block_s / rows
    lags_s = np.append(0.0, time_constants_s)
    step = np.diff(_integral(edges_s, lags_s, rise_s), axis=0) * rows / block_s
    found = np.zeros((blocks, count, lags_s.size))
    for k in range(blocks):
        found[k, k * rows :] = step[: count - k * rows]
        if k + 1 < blocks:
            found[k, (k + 1) * rows :] -= step[: count - (k + 1) * rows]
    return found


def noise_covariance(
    times_s: FloatArray,
    white_variance: FloatArray | float,
    zero_variance: float,
    drift_variance: float,
    drift_s: float,
) -> FloatArray:
    """Return the covariance of noise and drift relative to their value at the zero, (n, n). [µm²]

    The drift is a Gauss-Markov series, as `SlowNoise`, less its value when the record begins.
    """
    faded = np.exp(-times_s / drift_s)
    covariance = np.exp(-np.abs(times_s[:, None] - times_s) / drift_s)
    covariance = drift_variance * (covariance - faded[:, None] - faded + 1.0) + zero_variance
    return np.asarray(covariance + np.diag(np.broadcast_to(white_variance, times_s.shape)))
