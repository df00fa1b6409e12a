"""Inputs and displacement of one test, as the estimators take them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.codes import Place
from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray, require_sample_time

REFERENCE_S = 60.0
"""References are the levels over this first time. [s]"""
FEWEST_READINGS = 8
"""Measured displacements that an experiment must have. [1]"""


def _frozen(values: FloatArray) -> FloatArray:
    array = np.asarray(values, dtype=np.float64)
    if array.flags.writeable:
        array = array.copy()
        array.setflags(write=False)
    return array


@final
@dataclass(frozen=True, slots=True, eq=False)
class Experiment:
    """One test: inputs and displacement at equal sample times, in relative coordinates.

    The input at a row is held until the next row (zero-order hold). Rows in which an input or
    the displacement was not measured stay in their place as NaN: the time runs on.

    Raises
    ------
    DataError
        If the sample time is not positive and finite, the shapes are not (n, k) and (n,), a value
        is infinite, an input is never measured, or there are fewer than eight displacements.

    References
    ----------
    Mareš and Horejš 2021, section 3 (relative coordinates).
    """

    sample_time_s: float
    """Time from one row to the next. [s]"""
    u: FloatArray
    """Inputs relative to their reference, (n, k); NaN where not measured. [K]"""
    y: FloatArray
    """Displacement relative to its reference, (n,); NaN where not measured. [µm]"""
    name: str = ""
    """Name of the test, for messages."""
    ambient_k: FloatArray | None = None
    """What everything follows, such as the reference of the inputs, relative to its start, (n,);
    a drift that follows it is told apart from the inputs. None: not known. [K]"""
    reference_s: float = REFERENCE_S
    """The displacement is relative to its level over this first time. [s]"""

    def __post_init__(self) -> None:
        """Check the shapes and freeze the arrays."""
        u, y = np.asarray(self.u, dtype=np.float64), np.asarray(self.y, dtype=np.float64)
        place = Place(self.name or "experiment")
        require_sample_time(self.sample_time_s, place)
        if u.ndim != 2 or y.ndim != 1 or u.shape[0] != y.shape[0] or u.shape[1] == 0:
            raise DataError(
                "wrong_shape", shape=f"{u.shape}, {y.shape}", expected="(n, k), (n,)", place=place
            )
        # A sum is infinite or NaN only where a value is: one pass without a copy for good logs.
        if not np.isfinite(np.sum(u)) or not np.isfinite(np.sum(y)):
            self._check_values(u, y, place)
        if y.size < FEWEST_READINGS:
            raise DataError("too_few_rows", rows=y.size, needed=FEWEST_READINGS, place=place)
        if self.ambient_k is not None:
            object.__setattr__(self, "ambient_k", _frozen(self.ambient_k))
        object.__setattr__(self, "u", _frozen(u))
        object.__setattr__(self, "y", _frozen(y))

    @staticmethod
    def _check_values(u: FloatArray, y: FloatArray, place: Place) -> None:
        if bool(np.any(np.isinf(u))) or bool(np.any(np.isinf(y))):
            raise DataError("infinite_value", place=place)
        for column in range(u.shape[1]):
            if bool(np.all(np.isnan(u[:, column]))):
                raise DataError("input_never_measured", input=column + 1, place=place)
        measured = int(np.count_nonzero(~np.isnan(y)))
        if measured < FEWEST_READINGS:
            raise DataError(
                "too_few_measured", measured=measured, needed=FEWEST_READINGS, place=place
            )

    @property
    def duration_s(self) -> float:
        """Time from the first row to the end of the last one. [s]"""
        return self.y.size * self.sample_time_s

    @property
    def inputs(self) -> int:
        """Number of inputs k. [1]"""
        return int(self.u.shape[1])


def common_shape(experiments: Sequence[Experiment]) -> int:
    """Return the number of inputs that all experiments share."""
    if not experiments:
        raise DataError("no_log", key="experiments")
    counts = {e.inputs for e in experiments}
    if len(counts) > 1:
        raise DataError("inputs_differ", counts=tuple(str(c) for c in sorted(counts)))
    return counts.pop()
