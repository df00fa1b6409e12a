"""One measured positioning run, whatever file it came from."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from datetime import datetime
from enum import StrEnum
from types import MappingProxyType
from typing import TypeAlias, final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message, Place, remark
from thermaxis.errors import DataError
from thermaxis.quantities import AxisKind

FloatArray: TypeAlias = NDArray[np.float64]

FORWARD = 0
"""Index of the approach in positive direction on the last axis of every array."""
BACKWARD = 1
"""Index of the approach in negative direction on the last axis of every array."""
APPROACHES = ("forward", "backward")


class TimeSource(StrEnum):
    """Where the time of each reading comes from."""

    FILE = "file"
    """The file states a time for every reading."""
    INTERPOLATED = "interpolated"
    """Start, end and the acquisition order are known; times are spread evenly, between
    them or within the minutes that the file states."""
    ORDER = "order"
    """Only the acquisition order is known."""
    NONE = "none"
    """Neither times nor the acquisition order are known."""


class Cycle(StrEnum):
    """Order in which the targets are visited (ISO 230-2:2014; step cycle: its Annex B)."""

    STANDARD = "standard"
    """All targets forward, then all targets backward, once per cycle."""
    PILGRIM = "pilgrim"
    """Pilgrim step: some targets forward, fewer back, over and over."""
    STEP = "step"
    """Step cycle (Annex B): each target several times before the next."""


@final
@dataclass(frozen=True, slots=True)
class StartEnd:
    """A quantity of the environment at the start and at the end of a run."""

    start: float | None
    """Value at the start, None if not stated. [unit in the name of its key]"""
    end: float | None
    """Value at the end, None if not stated. [unit in the name of its key]"""


def freeze_arrays(result: object) -> None:
    """Make every array in the fields of a result read-only."""
    for entry in fields(result):  # pyright: ignore[reportArgumentType] - dataclasses only
        value = getattr(result, entry.name)
        if isinstance(value, np.ndarray):
            value.setflags(write=False)


_ALIKE = 1e-6
"""Difference up to which readings are equal but for the computer's rounding. [µm or arcsec]"""
_FEWEST_DIFFERENCES = 8
"""Fewer may be multiples of the smallest by chance. [1]"""
_MULTIPLE = 0.05
"""How far a difference may be from a multiple of a step, as a share of it. [1]"""


def _frozen(values: FloatArray) -> FloatArray:
    copy = np.array(values, dtype=np.float64)
    copy.setflags(write=False)
    return copy


def require_shape(values: FloatArray, expected: str, place: Place, *, fits: bool) -> None:
    """Refuse an array that does not have the expected shape."""
    if not fits:
        raise DataError("wrong_shape", shape=str(values.shape), expected=expected, place=place)


def placed(values: FloatArray, approaches: tuple[int, ...]) -> FloatArray:
    """Return values per level, (..., L), as (..., m, 2); NaN in an approach that is not there.

    Levels are the targets of the first of the approaches, then those of the second.
    """
    m = values.shape[-1] // len(approaches)
    both = np.full((*values.shape[:-1], m, 2), np.nan, order="F")  # many runs are reduced fast
    for k, approach in enumerate(approaches):
        both[..., approach] = values[..., k * m : (k + 1) * m]
    return both


@final
@dataclass(frozen=True, slots=True, eq=False)
class PositioningTest:
    """A measured positioning run: m targets, n cycles, two approaches.

    Arrays of readings have the shape (m, n, 2): target, cycle, approach (0 forward,
    1 backward). A missing reading is NaN. In a unidirectional run one approach is missing
    throughout. The kind of the axis fixes the units: mm and µm, or deg and arcsec.

    Raises
    ------
    DataError
        If a shape is wrong, targets are not strictly increasing, a value is infinite, there is
        no reading at all, or times and readings do not belong together.

    References
    ----------
    ISO 230-2:2014, clause 3 (terms); GOST ISO 230-2-2016 for their numbering.
    """

    kind: AxisKind
    """Linear (mm, µm) or rotary (deg, arcsec)."""
    target: FloatArray
    """Target positions, (m,), strictly increasing. [mm or deg]"""
    deviation: FloatArray
    """Positional deviations, measured minus target, (m, n, 2). [µm or arcsec]"""
    time_source: TimeSource = TimeSource.NONE
    """Where `time_s` and `order` come from."""
    time_s: FloatArray | None = None
    """Time of each reading since the first one, (m, n, 2). [s]"""
    order: FloatArray | None = None
    """Number of each reading in acquisition order, from 1, (m, n, 2). [1]"""
    order_deduced: bool = False
    """Whether `order` was deduced for the standard cycle, as the file states run numbers only."""
    start: datetime | None = None
    """Time of day of the first reading; aware if the file states a zone."""
    end: datetime | None = None
    """Time of day of the last reading; aware if the file states a zone."""
    cycle: Cycle = Cycle.STANDARD
    """Order in which the targets are visited."""
    channels: Mapping[str, FloatArray] = field(default_factory=dict[str, FloatArray])
    """Further readings taken at each stop, by the name of their column, each (m, n, 2)."""
    environment: Mapping[str, StartEnd] = field(default_factory=dict[str, StartEnd])
    """Air, material and expansion values; the unit ends the key (`air_temperature_c`)."""
    header: Mapping[str, str] = field(default_factory=dict[str, str])
    """Texts of the file's head, by field (`machine`, `axis`, `title`, ...)."""
    remarks: tuple[Message, ...] = ()

    def __post_init__(self) -> None:
        """Check shapes and freeze every array."""
        set_field = object.__setattr__
        for name in ("target", "deviation", "time_s", "order"):
            values = getattr(self, name)
            if values is not None:
                set_field(self, name, _frozen(values))
        channels = {name: _frozen(values) for name, values in self.channels.items()}
        set_field(self, "channels", MappingProxyType(channels))
        set_field(self, "environment", MappingProxyType(dict(self.environment)))
        set_field(self, "header", MappingProxyType(dict(self.header)))
        self._check_readings()
        self._check_times()

    def _check_readings(self) -> None:
        fits = self.target.ndim == 1 and self.target.size > 0
        require_shape(self.target, "(m,)", Place(key="target"), fits=fits)
        m = self.target.size
        fits = self.deviation.ndim == 3 and self.deviation.shape[::2] == (m, 2)
        require_shape(self.deviation, f"({m}, n, 2)", Place(key="deviation"), fits=fits)
        if self.deviation.shape[1] == 0 or bool(np.all(np.isnan(self.deviation))):
            raise DataError("no_readings")
        if not bool(np.all(np.isfinite(self.target))) or bool(np.any(np.diff(self.target) <= 0)):
            raise DataError("not_rising", key="target")
        if bool(np.any(np.isinf(self.deviation))):
            raise DataError("not_finite", key="deviation")
        for name, values in self.channels.items():
            self._require_readings_shape(values, Place(channel=name))

    def _require_readings_shape(self, values: FloatArray, place: Place) -> None:
        shape = self.deviation.shape
        require_shape(values, str(shape), place, fits=values.shape == shape)

    def _check_times(self) -> None:
        measured = ~np.isnan(self.deviation)
        for name, values in (("time_s", self.time_s), ("order", self.order)):
            if values is None:
                continue
            self._require_readings_shape(values, Place(key=name))
            if not bool(np.all(np.isfinite(values[measured]))):
                raise DataError("value_missing_for_reading", key=name)
        known = (self.time_s is not None, self.order is not None)
        expected = {
            TimeSource.FILE: (True, True),
            TimeSource.INTERPOLATED: (True, True),
            TimeSource.ORDER: (False, True),
            TimeSource.NONE: (False, False),
        }[self.time_source]
        if known != expected:
            raise DataError("time_source_unfit", time_source=str(self.time_source))

    @property
    def cycles(self) -> int:
        """Number of cycles n, complete or not. [1]"""
        return int(self.deviation.shape[1])

    @property
    def measured_approaches(self) -> tuple[bool, bool]:
        """Whether the forward and the backward approach have any reading."""
        missing = np.isnan(self.deviation)
        return not bool(np.all(missing[..., FORWARD])), not bool(np.all(missing[..., BACKWARD]))

    @property
    def approaches(self) -> tuple[int, ...]:
        """Approaches that have any reading: 0 forward, 1 backward."""
        return tuple(a for a, measured in enumerate(self.measured_approaches) if measured)

    @property
    def unidirectional(self) -> bool:
        """Whether only one approach was measured."""
        return not all(self.measured_approaches)

    @property
    def readings(self) -> FloatArray:
        """Number of readings per target and approach, (m, 2). [1]"""
        return np.asarray(np.sum(~np.isnan(self.deviation), axis=1), dtype=np.float64)

    @property
    def repeats_exactly(self) -> bool:
        """Whether readings repeat at every target without any scatter, which no machine does."""
        first = np.nanmax(self.deviation, axis=1, initial=-np.inf)
        last = np.nanmin(self.deviation, axis=1, initial=np.inf)
        return bool(np.max(self.readings) > 1.0 and np.all(first - last <= _ALIKE))

    @property
    def resolution(self) -> float:
        """Step of which all differences of the readings of a target are multiples, 0 without one.

        Where nearly all readings repeat exactly, differences between targets serve. [µm or arcsec]
        """
        readings = np.sort(self.deviation, axis=1)
        step = np.diff(readings, axis=1)
        if np.sum(~np.isnan(step)) < _FEWEST_DIFFERENCES:
            return 0.0
        step = step[step > _ALIKE]
        if step.size < _FEWEST_DIFFERENCES:
            step = np.diff(np.unique(readings[~np.isnan(readings)]))
            common = int(np.gcd.reduce(np.rint(step / _ALIKE).astype(np.int64), initial=0))
            return _ALIKE * common if common > 1 else 0.0
        least = float(np.min(step))
        return least if np.max(np.abs(step / least - np.rint(step / least))) < _MULTIPLE else 0.0

    @property
    def measured_length(self) -> float:
        """Distance from the first to the last target. [mm or deg]"""
        return float(self.target[-1] - self.target[0])

    def with_cycle(self, cycle: Cycle) -> "PositioningTest":
        """Return the same readings, taken in another kind of cycle.

        Where the acquisition order was deduced for the standard cycle, it is dropped for another
        one, with a remark.
        """
        if cycle is self.cycle or not self.order_deduced:
            return replace(self, cycle=cycle)
        kept = tuple(r for r in self.remarks if r.code != "remark-times_interpolated")
        return replace(
            self,
            cycle=cycle,
            time_source=TimeSource.NONE,
            time_s=None,
            order=None,
            order_deduced=False,
            remarks=(*kept, remark("order_of_cycle_unknown", cycle=cycle)),
        )
