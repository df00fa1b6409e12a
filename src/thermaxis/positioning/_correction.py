"""The compensation table of an axis, whatever control it is written for.

Inside the project a table holds deviations: measured minus nominal position, per direction. What
a control makes of them, its sign, unit and order, belongs to that control's own file.
"""

from dataclasses import dataclass, replace
from typing import final

import numpy as np

from thermaxis.codes import Message, Place
from thermaxis.errors import ConfigurationError, DataError, require_count, require_positive
from thermaxis.positioning.run import (
    APPROACHES,
    BACKWARD,
    FORWARD,
    FloatArray,
    PositioningTest,
    freeze_arrays,
    require_shape,
)
from thermaxis.positioning.standard import Iso230_2Figures, iso230_2_figures, mean_and_s
from thermaxis.quantities import AxisKind

MOST_POINTS = 100_000
"""Largest number of points of a table, whatever the control. [1]"""
_SAME = 1e-9


@final
@dataclass(frozen=True, slots=True, eq=False)
class CompensationTable:
    """Positional deviations of an axis at the points of a table.

    Not protected: whether the sign fits the machine is shown by a measurement only. A table
    removes the systematic part of the deviations at the thermal state of the run; it removes no
    drift, and outside its points the end values are held.

    Raises
    ------
    DataError
        If a shape is wrong, positions are not strictly increasing, or a number is not finite.
    """

    kind: AxisKind
    """Linear (mm, µm) or rotary (deg, arcsec)."""
    axis: str
    """Name of the axis on the control; may be empty where the table does not say it."""
    position: FloatArray
    """Points, (k,), strictly increasing. [mm or deg]"""
    deviation: FloatArray
    """Mean deviation, measured minus nominal, per direction, (k, 2). [µm or arcsec]"""
    backlash: float | None = None
    """Reversal B, forward minus backward deviation, that is compensated apart from the points;
    None where it is not. [µm or arcsec]"""
    reference_position: float | None = None
    """Point at which the mean of both directions is zero; None if unknown. [mm or deg]"""
    source: str = ""
    """What the deviations are, in words: measured, drift-free, added to an older table."""
    run_sha256: str = ""
    """Hash of the run's file; empty if unknown."""

    def __post_init__(self) -> None:
        """Check shapes and freeze the arrays."""
        position = np.array(self.position, dtype=np.float64)
        deviation = np.array(self.deviation, dtype=np.float64)
        place, k = Place(key="position"), position.size
        require_shape(position, "(k,)", place, fits=position.ndim == 1 and k > 0)
        if k > MOST_POINTS:
            raise DataError("outside_count", count=k, least=1, most=MOST_POINTS, place=place)
        place = Place(key="deviation")
        require_shape(deviation, f"({k}, 2)", place, fits=deviation.shape == (k, 2))
        if not bool(np.all(np.isfinite(position))) or bool(np.any(np.diff(position) <= 0)):
            raise DataError("not_rising", key="position")
        finite = self.backlash is None or bool(np.isfinite(self.backlash))
        if not bool(np.all(np.isfinite(deviation))) or not finite:
            raise DataError("not_finite", key="deviation, backlash")
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "deviation", deviation)
        freeze_arrays(self)

    @property
    def per_direction(self) -> bool:
        """Whether the points differ between the directions."""
        return bool(np.any(self.deviation[:, FORWARD] != self.deviation[:, BACKWARD]))

    @property
    def mean(self) -> FloatArray:
        """Mean of both directions at the points, (k,). [µm or arcsec]"""
        return np.mean(self.deviation, axis=1)

    @property
    def step(self) -> float | None:
        """Distance of neighbouring points where it is the same throughout. [mm or deg]"""
        if self.position.size < 2:
            return None
        step = float(self.position[-1] - self.position[0]) / (self.position.size - 1)
        even = self.position[0] + step * np.arange(self.position.size)
        scale = max(1.0, float(np.max(np.abs(self.position))))
        return step if bool(np.all(np.abs(self.position - even) <= _SAME * scale)) else None

    @property
    def steepest_slope(self) -> tuple[float, float, float]:
        """Steepest slope, its magnitude, and the two points between which it lies.

        Zero and NaN, NaN for a table of one point. [µm/mm or arcsec/deg; mm or deg]
        """
        if self.position.size < 2:
            return 0.0, float("nan"), float("nan")
        rise = np.max(np.abs(np.diff(self.deviation, axis=0)), axis=1)
        slope = rise / np.diff(self.position)
        k = int(np.argmax(slope))
        return float(slope[k]), float(self.position[k]), float(self.position[k + 1])

    def deviation_at(self, position: FloatArray) -> FloatArray:
        """Return what the table holds the deviation to be, per direction, (p, 2).

        Linear between its points, outside them the end values; half the reversal that is
        compensated apart is included. A control corrects by minus this. [µm or arcsec]
        """
        columns = [np.interp(position, self.position, self.deviation[:, a]) for a in (0, 1)]
        half = 0.0 if self.backlash is None else 0.5 * self.backlash
        return np.stack(columns, axis=1) + np.array([half, -half])


# ---- levels and grids ---------------------------------------------------------------------------


@final
@dataclass(frozen=True, slots=True, eq=False)
class AxisLevels:
    """Mean deviation of each target per direction: what a table is made of."""

    target: FloatArray
    """Targets, (m,). [mm or deg]"""
    level: FloatArray
    """Their levels, (m, 2); an approach that was not measured has that of the other.
    [µm or arcsec]"""
    bidirectional: bool
    """Whether both approaches were measured."""
    remarks: tuple[Message, ...] = ()
    """What was left out or taken over."""


def axis_levels(target: FloatArray, level: FloatArray) -> AxisLevels:
    """Return levels that a table can be made of.

    Targets without a level are left out. Where one approach is missing throughout, the other
    stands for both; where it is missing at a target only, that target is left out. Fewer than two
    targets are refused.
    """
    known = ~np.isnan(level)
    measured = np.any(known, axis=0)
    remarks: list[Message] = []
    if bool(np.all(measured)):
        filled, keep = level, np.all(known, axis=1)
    else:
        side = FORWARD if bool(measured[FORWARD]) else BACKWARD
        filled, keep = np.stack((level[:, side],) * 2, axis=1), known[:, side]
        remarks.append(Message("remark-one_approach_for_both", {"approach": APPROACHES[side]}))
    if not bool(np.all(keep)):
        numbers = ", ".join(str(i + 1) for i in np.flatnonzero(~keep).tolist())
        remarks.append(Message("remark-targets_left_out", {"targets": numbers}))
    if int(np.sum(keep)) < 2:
        raise DataError("too_few_targets", targets=int(np.sum(keep)), needed=2)
    return AxisLevels(target[keep], filled[keep], bool(np.all(measured)), tuple(remarks))


def measured_levels(test: PositioningTest) -> AxisLevels:
    """Return the mean unidirectional deviations of a run; missing readings are left out.

    References
    ----------
    ISO 230-2:2014, clause 3 (mean unidirectional positioning deviation at a position).
    """
    return axis_levels(test.target, mean_and_s(test.deviation)[0])


def table_points(
    target: FloatArray,
    *,
    points: int | None = None,
    spacing: float | None = None,
    through: float | None = None,
    decimals: int = 4,
) -> FloatArray:
    """Return equidistant points that cover all targets.

    Parameters
    ----------
    target : FloatArray
        Targets, (m,), strictly increasing. [mm or deg]
    points : int, optional
        Number of points from the first to the last target; with `through` the largest number, and
        three are the fewest that can pass through a position between them. Default: see
        `spacing`. [1]
    spacing : float, optional
        Distance of the points. The first lies at the first target; the last may lie beyond the
        last target, by less than one spacing. Default: as many points as targets. [mm or deg]
    through : float, optional
        A position on which a point must lie (or would, were the table long enough); the first
        point then lies at most one spacing before the first target. Default: none. [mm or deg]
    decimals : int
        Decimals of the spacing and of the first point; a spacing that follows from a number of
        points and `through` is rounded up, so that no further point is needed. Default: 4. [1]

    Returns
    -------
    FloatArray
        The points, (k,). [mm or deg]

    Raises
    ------
    ConfigurationError
        If both are stated, a number is out of its range, or points would fall together.
    """
    if points is not None and spacing is not None:
        raise ConfigurationError("only_one_of", names=("points", "spacing"), key="points, spacing")
    first, last = float(target[0]), float(target[-1])
    if spacing is None:
        points = target.size if points is None else points
        require_count("points", points, 2, MOST_POINTS)
        spacing = (last - first) / (points - 1)
        if through is not None:
            spacing = _spacing_through(first, last, through, points)
            # rounded down, the last of so many points would end short of the last target
            spacing = float(np.ceil(spacing * 10.0**decimals - 1e-6)) / 10.0**decimals
    require_positive("spacing", spacing, 1e6)
    step = round(spacing, decimals)
    if step <= 0:
        raise ConfigurationError("points_too_near", decimals=decimals, key="spacing")
    start = round(first, decimals)
    if through is not None:
        start = round(through + step * np.floor((first - through) / step + 1e-9), decimals)
    rounding = step * 1e-6 + 0.5 * 10.0**-decimals
    if points is not None and through is None:
        count = points  # the rounded spacing may end a last digit times the points off the target
    else:
        count = int(np.ceil((last - start - rounding) / step)) + 1
    if count > MOST_POINTS:
        raise ConfigurationError("too_many_points", count=count, most=MOST_POINTS, key="spacing")
    position: FloatArray = start + step * np.arange(max(count, 2), dtype=np.float64)
    return np.round(position, decimals + 2)


def _spacing_through(first: float, last: float, through: float, points: int) -> float:
    """Return the smallest distance of points that cover the targets, one of them at a position."""
    below, above, sections = through - first, last - through, points - 1
    if below < 0.0 or above < 0.0:  # the grid may begin anywhere: one section more is enough
        return (last - first) / max(sections - 1, 1)
    share = sections * below / (last - first)
    found = [
        max(below / max(i, 1), above / max(sections - i, 1))
        for i in (int(np.floor(share + 1e-9)), int(np.ceil(share - 1e-9)))
        if (i > 0 or below == 0.0) and (i < sections or above == 0.0)
    ]
    return min(found, default=last - first)


def values_at_points(levels: AxisLevels, position: FloatArray) -> FloatArray:
    """Return the levels at the points of a table, linear between the targets.

    Parameters
    ----------
    position : FloatArray
        Points of the table, (k,). [mm or deg]

    Returns
    -------
    FloatArray
        Values, (k, 2). Points within the targets lie on the line between the levels. A point
        beyond an end of the targets continues the line from the nearest point within through
        the level of the last target, so that this target is met, where that target lies in the
        farther half of the way; from a shorter piece the noise of one level would be stretched,
        and the level of the last target is held. Further points hold that value.
        [µm or arcsec]
    """
    target, level = levels.target, levels.level
    value = np.stack([np.interp(position, target, level[:, a]) for a in (0, 1)], axis=1)
    inside = np.flatnonzero((position >= target[0]) & (position <= target[-1]))
    if inside.size == 0:  # all targets between two points: the line through the outer levels
        around = int(np.count_nonzero(position < target[0]))
        if 0 < around < position.size and _is_long_enough(
            float(target[-1] - target[0]), float(position[around] - position[around - 1])
        ):
            share = (position - target[0]) / (target[-1] - target[0])
            return level[0] + share[:, np.newaxis] * (level[-1] - level[0])
        return value
    for outside, end in ((position < target[0], 0), (position > target[-1], -1)):
        number = np.flatnonzero(outside)
        if number.size == 0:
            continue
        near = inside[0] if end == 0 else inside[-1]
        beyond = number[-1] if end == 0 else number[0]
        gap, step = target[end] - position[near], position[beyond] - position[near]
        if _is_long_enough(abs(float(gap)), abs(float(step))):
            slope = (level[end] - value[near]) / gap
            value[number] = value[near] + slope * step
    return value


def _is_long_enough(covered: float, step: float) -> bool:
    """Whether targets cover enough of the way between two points to continue a line there."""
    return covered >= 0.5 * step


def compensation_table(
    levels: AxisLevels,
    position: FloatArray,
    *,
    kind: AxisKind,
    axis: str,
    reference_position: float,
    per_direction: bool = True,
    backlash: bool = False,
) -> CompensationTable:
    """Return the table of an axis: its levels at the points, zero at the reference point.

    Not protected: the levels count as measured at the nominal positions of this axis, with the
    sign of the run; a run of another axis, or with the laser's direction turned around, makes a
    table that looks right and doubles the error. No limit of size or slope is set here.

    Parameters
    ----------
    levels : AxisLevels
        Levels of the targets. [µm or arcsec]
    position : FloatArray
        Points, (k,), strictly increasing. [mm or deg]
    kind : AxisKind
        Linear or rotary.
    axis : str
        Name of the axis on the control.
    reference_position : float
        Where the mean of both directions becomes zero. [mm or deg]
    per_direction : bool
        Whether the control has a value for each direction; otherwise the mean bidirectional
        deviation stands for both. Default: it has.
    backlash : bool
        Whether the mean reversal is stated apart; needs `per_direction` false. Default: no.

    Returns
    -------
    CompensationTable
        The table, not yet rounded.

    References
    ----------
    ISO 230-2:2014, clause 3 (mean bidirectional deviation, reversal value, mean reversal value).
    """
    value = values_at_points(levels, position)
    reversal: float | None = None
    if not per_direction:
        if backlash:
            reversal = float(np.mean(levels.level[:, FORWARD] - levels.level[:, BACKWARD]))
        value = np.stack((np.mean(value, axis=1),) * 2, axis=1)
    zero = _mean_at(reference_position, position, value)
    return CompensationTable(
        kind=kind,
        axis=axis,
        position=position,
        deviation=value - zero,
        backlash=reversal,
        reference_position=reference_position,
    )


def _mean_at(place: float, position: FloatArray, value: FloatArray) -> float:
    mean: FloatArray = 0.5 * (value[:, FORWARD] + value[:, BACKWARD])
    return float(np.interp(place, position, mean))


def merge_tables(old: CompensationTable, residual: CompensationTable) -> CompensationTable:
    """Return the table that takes the place of an older one in force during the run.

    Not protected: that the older table was in force, unchanged, in every reading is the caller's
    word; if it was not, its correction acts twice, or not at all. What the sum loses of the older
    table between the new points is not told here.

    Parameters
    ----------
    old : CompensationTable
        Table that was in force when the run was measured.
    residual : CompensationTable
        Table of what the run still showed; its points are those of the result.

    Returns
    -------
    CompensationTable
        Sum of both at the points of the residual, zero at its reference point.

    Raises
    ------
    DataError
        If one of them is of a linear and the other of a rotary axis.
    """
    if old.kind is not residual.kind:
        raise DataError("axes_differ", older=str(old.kind), kind=str(residual.kind))
    apart = replace(old, backlash=None).deviation_at(residual.position)
    value = apart + residual.deviation
    if residual.reference_position is not None:
        value = value - _mean_at(residual.reference_position, residual.position, value)
    stated = [table.backlash for table in (old, residual) if table.backlash is not None]
    return replace(residual, deviation=value, backlash=sum(stated) if stated else None)


# ---- what a table leaves ------------------------------------------------------------------------


def interpolation_bound(
    levels: AxisLevels, position: FloatArray, *, per_direction: bool = True, backlash: bool = False
) -> FloatArray:
    """Return how far a table with these points can miss each level, before any rounding, (m,).

    Worked out from the slopes of the levels alone, not by simulating a table: between two points
    the line of the levels departs from its chord by at most a quarter of the spacing times the
    difference of its largest and smallest slope there. Where the last level is held beyond the
    targets, the difference of both chords is added; where reversal is not compensated target by
    target, what it differs from its mean, or all of it. The larger of both directions counts.
    [µm or arcsec]
    """
    target, level = levels.target, levels.level
    half = 0.5 * (level[:, FORWARD] - level[:, BACKWARD])
    left = np.zeros(target.size)
    if not per_direction:
        left = np.abs(half - (np.mean(half) if backlash else 0.0))
        level = np.stack((np.mean(level, axis=1),) * 2, axis=1)
    slope = np.diff(level, axis=0) / np.diff(target)[:, np.newaxis]
    bound = np.zeros(target.size)
    edges = [-np.inf, *position.tolist(), np.inf]
    cells = np.searchsorted(position, target, side="right")
    for i, (place, c) in enumerate(zip(target.tolist(), cells.tolist(), strict=True)):
        low, high = edges[c], edges[c + 1]
        if place == low:
            continue
        part = slope[(target[1:] > low) & (target[:-1] < high)]
        if np.isfinite(low) and np.isfinite(high):
            covered = min(float(target[-1]), high) - max(float(target[0]), low)
            bound[i] = 0.25 * float(np.max(np.ptp(part, axis=0))) * covered
            if not _is_long_enough(covered, high - low):  # the last level is held there
                inner = target[0] <= low or target[-1] >= high
                share = 1.0 - covered / (high - low) if inner else 1.0
                bound[i] += float(np.max(np.abs(part))) * covered * share
        else:
            end = low if np.isfinite(low) else high
            bound[i] = float(np.max(np.abs(part))) * abs(place - end)
    return bound + left


@final
@dataclass(frozen=True, slots=True, eq=False)
class CorrectionEffect:
    """A run with and without the corrections of a table, by simulation."""

    target: FloatArray
    """Targets, (m,). [mm or deg]"""
    correction: FloatArray
    """What the control adds, (m, 2). [µm or arcsec]"""
    before: FloatArray
    """Mean deviation per direction as measured, (m, 2); NaN where not measured. [µm or arcsec]"""
    after: FloatArray
    """The same with the correction, (m, 2). [µm or arcsec]"""
    figures_before: Iso230_2Figures
    """Figures of ISO 230-2 as measured. [µm or arcsec]"""
    figures_after: Iso230_2Figures
    """The same with the correction. [µm or arcsec]"""


def evaluate_correction(test: PositioningTest, correction: FloatArray) -> CorrectionEffect:
    """Return what corrections, (m, 2), make of a run that was measured without them.

    The correction is taken at the nominal position. The axis, moved by it, then stands where the
    deviation is another one, by the slope of the levels times the correction: with 0.1 µm/mm
    (1e-4) and 20 µm that is 0.002 µm. [µm or arcsec]

    References
    ----------
    ISO 230-2:2014, clause 3, for the figures.
    """
    shape = (test.target.size, 2)
    require_shape(correction, str(shape), Place(key="correction"), fits=correction.shape == shape)
    corrected = test.deviation + correction[:, np.newaxis, :]
    before = mean_and_s(test.deviation)[0]
    return CorrectionEffect(
        target=test.target,
        correction=correction,
        before=before,
        after=before + correction,
        figures_before=iso230_2_figures(test.deviation),
        figures_after=iso230_2_figures(corrected),
    )
