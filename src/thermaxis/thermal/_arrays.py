"""The one kind of array that identification calculates with, and what every input must be."""

import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.blas import dtbsv  # pyright: ignore[reportAttributeAccessIssue, reportUnknownVariableType] - no types

from thermaxis.codes import NOWHERE, Place
from thermaxis.errors import DataError

FloatArray: TypeAlias = NDArray[np.float64]


def require_sample_time(sample_time_s: float, place: Place = NOWHERE) -> None:
    """Refuse a time between rows that is not finite and positive."""
    if not (math.isfinite(sample_time_s) and sample_time_s > 0.0):
        raise DataError(
            "not_positive", value=sample_time_s, place=place._replace(key="sample_time_s")
        )


def frozen_array(values: FloatArray | Sequence[float]) -> FloatArray:
    """Return a copy as float64 that cannot be written to."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def significant(value: float, digits: int = 4) -> float:
    """Return a number to significant digits, as a message states it."""
    return float(f"{value:.{digits}g}")


def rows_of_inputs(u: FloatArray, inputs: int) -> FloatArray:
    """Return inputs as numbers, one row per sample and one column per input of the model."""
    values = np.asarray(u, dtype=np.float64)
    if values.ndim != 2 or values.shape[1] != inputs or values.shape[0] == 0:
        shape, expected = str(values.shape), f"(n, {inputs})"
        raise DataError("wrong_shape", shape=shape, expected=expected, key="u")
    return values


def recursion(keep: float | FloatArray, drive: FloatArray, start: float) -> FloatArray:
    """Return x with x(0) = start and x(k + 1) = keep(k) x(k) + drive(k), one more than drives.

    It is a banded triangle of equations; `scipy.signal` takes half a second to import.
    """
    band = np.ones((2, drive.size + 1), order="F")
    band[1, :-1] = -keep
    return np.asarray(dtbsv(1, band, np.append(start, drive), lower=1, diag=1), dtype=np.float64)
