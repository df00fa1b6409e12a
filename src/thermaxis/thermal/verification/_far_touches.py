"""Touches that the others exclude: one that is off, as by a chip, and a datum that was set anew.

What n touches show is lags of the inputs, a walk, an offset and noise, all unknown, in units of the
noise

    y ~ N(0, s^2 V)      V = g^2 F F' + q min(t, t') + b 11' + I

One touch that is off adds a column c of one row to it, another datum one of all later rows. With
S = y' V^-1 y the touches are likelier by it by

    n / 2 log(S / (S - t^2)) - 1/2 log(1 + c' V^-1 c v)      t^2 = (c' V^-1 y)^2 / c' V^-1 c

where v is the variance of what it may be off by. Gains g and walk q are the likeliest with it, so
that a column which is taken for a walk without it is none with it.
"""

import numpy as np
from numpy.typing import NDArray

from thermaxis.thermal._arrays import FloatArray, recursion
from thermaxis.thermal.transfer_function import held
from thermaxis.thermal.verification._touched_run import LEAST_FAR_UM, MOST_FAR_SHARE

SPARSE = 0.5
"""No larger share of the rows is measured where a log has touches in place of a record. [1]"""
FEWEST = 12
"""Fewer touches exclude none. [1]"""
FAR_UM = 50.0
"""What a chip or another datum is off by, standard deviation. [µm]"""
SELDOM = 0.01
"""How often a touch is far, or a datum set anew. [1]"""
LEAST_EVIDENCE = 5.0
"""Logarithm of how much likelier a far touch makes the log, from which it is excluded. [1]"""
_LAGS_S = (600.0, 2400.0, 9600.0, 38400.0)
_GAINS2, _WALKS_PER_H = np.meshgrid(np.geomspace(1.0, 1e4, 5), [1e-3, 3e-2, 0.3, 3.0, 30.0])
_OFFSET2 = 1e6
_WINDOW, _SHARED, _KEPT_FROM = 100, 20, 4
_LEAST = 1e-9


def far_touches(
    time_s: FloatArray, u: FloatArray, touched_um: FloatArray
) -> tuple[dict[int, float], dict[int, float]]:
    """Return touches that are off and first ones of another datum, with by how much. [µm]

    Each is the number of a touch among those that are there. None is far where too few are.

    Parameters
    ----------
    time_s, u, touched_um : array
        Times, (n,), inputs about 0, (n, k), and touches, (n,), NaN in most rows. [s, K, µm]
    """
    rows = np.flatnonzero(~np.isnan(touched_um))
    if not FEWEST <= rows.size <= SPARSE * touched_um.size:
        return {}, {}
    inputs, y = held(u)[0], touched_um[rows]
    alphas = -np.expm1(-float(np.median(np.diff(time_s))) / np.array(_LAGS_S))
    lagged = [
        np.column_stack([u, *(recursion(1.0 - a, a * u[:-1], u[0]) for a in alphas.tolist())])
        for u in inputs.T
    ]
    shown = np.hstack([lags[rows] / max(float(np.std(lags[rows, 0])), 1e-9) for lags in lagged])
    hours: FloatArray = time_s[rows] / 3600.0
    chips: dict[int, float] = {}
    moves: dict[int, float] = {}
    kept = np.arange(_GAINS2.size)
    likeliest: set[int] = set()
    for number, first in enumerate(range(0, max(rows.size - _SHARED, 1), _WINDOW - _SHARED)):
        if number == _KEPT_FROM:  # they are alike along a log
            kept = np.array(sorted(likeliest))
        part = slice(first, first + _WINDOW)
        found, size_um, best = _window(y[part], shown[part], hours[part], kept)
        likeliest.add(best)
        for (row, steps), um in zip(found, size_um.tolist(), strict=True):
            if not (first and row < _SHARED // 2):  # else the window before has told it
                (moves if steps else chips)[first + row] = um
    return chips, moves


def _window(
    y_um: FloatArray, shown: FloatArray, hours: FloatArray, kept: NDArray[np.intp]
) -> tuple[list[tuple[int, bool]], FloatArray, int]:
    """Return what is far in a stretch: rows and whether each is a datum, sizes, which g and q."""
    n, since_h = y_um.size, hours - hours[0]
    gains2, walks = (each.ravel()[kept, None, None] for each in (_GAINS2, _WALKS_PER_H))
    walk: FloatArray = np.asarray(np.minimum(since_h, since_h[:, None]), dtype=np.float64)
    v: FloatArray = gains2 * (shown @ shown.T) + walks * walk + (_OFFSET2 + np.eye(n))
    inverse = np.asarray(np.linalg.inv(v), dtype=np.float64)
    whole, log_v = inverse, np.linalg.slogdet(v)[1]
    found: list[tuple[int, bool]] = []
    while True:
        right: FloatArray = inverse @ y_um
        s: FloatArray = np.maximum(right @ y_um, _LEAST)[:, None, None]
        each = (inverse, _behind(inverse, (1, 2)))
        squares = np.stack([np.diagonal(one, axis1=1, axis2=2) for one in each], axis=1)
        told = np.stack([right, _behind(right, (1,))], axis=1)
        able = (squares > _LEAST) & (np.abs(told) >= LEAST_FAR_UM * squares)
        able[:, 1, [0, 1, -1]] = False
        t2 = told**2 / np.where(able, squares, 1.0)
        left = np.maximum(s - t2, _LEAST)
        sizes2 = np.log1p(squares * (n * FAR_UM**2 / left))
        known = -0.5 * (log_v[:, None, None] + n * np.log(s))
        more = 0.5 * (n * np.log(s / left) - sizes2) + np.log(SELDOM)
        every = np.where(able, known + more, -np.inf)
        best, datum, row = (int(k) for k in np.unravel_index(np.argmax(every), every.shape))
        if every[best, datum, row] < np.max(known) + LEAST_EVIDENCE:
            best = int(np.argmax(known))
            break
        found.append((row, bool(datum)))
        if len(found) > MOST_FAR_SHARE * n:
            return [], np.zeros(0), int(kept[best])
        c = np.eye(n)[row] if not datum else (np.arange(n) >= row).astype(np.float64)
        seen: FloatArray = inverse @ c
        inverse = inverse - seen[:, :, None] * seen[:, None, :] / squares[:, datum, row, None, None]
        log_v = log_v + sizes2[:, datum, row]
    columns = np.array([np.arange(n) >= r if datum else np.arange(n) == r for r, datum in found])
    columns = columns.reshape(len(found), n).astype(np.float64)
    right = columns @ whole[best]
    size_um = np.asarray(np.linalg.solve(right @ columns.T, right @ y_um), dtype=np.float64)
    return found, size_um, int(kept[best])


def _behind(values: FloatArray, axes: tuple[int, ...]) -> FloatArray:
    """Return sums over all that is not before."""
    for axis in axes:
        values = np.flip(np.flip(values, axis).cumsum(axis=axis), axis)
    return values
