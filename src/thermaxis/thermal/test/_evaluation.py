"""Evaluate a log as a thermal test of ISO 230-3."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import NDArray

from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.thermal._arrays import FloatArray, significant
from thermaxis.thermal.log import TEMPERATURES, ThermalLog, resolution_of
from thermaxis.thermal.test._figures import (
    COVERAGE,
    CUSTOMARY_H,
    END_SHARE,
    HOUR_S,
    EndCriterion,
    RangeFigure,
    SpeedClass,
    ThermalTest,
    ThermalTestQuantity,
    ThermalTestTemperature,
    UncertaintyCause,
)
from thermaxis.thermal.test._ranges import largest_ranges, range_of, rows_between
from thermaxis.thermal.test._setup import ThermalTestKind, ThermalTestMotion, ThermalTestSetup

STANDSTILL = 1.0
"""Up to this a speed counts as standstill. [unit of the channel]"""
SPEED_NOISE = 0.01
"""So does one up to this share of the highest speed of the log: an encoder is never still. [1]"""
LONGEST_GAP_S = 1800.0
"""A longer time without a value leaves no range within 60 min. [s]"""
TOLD_GAP_S = 300.0
"""A shorter time without a value, or one of a few rows, is not told. [s]"""
_FEW_ROWS = 5.0
_SET_ASIDE = ("remark-rows_stuck", "remark-values_no_measurement")
_CLASSES = 10
"""Classes of speed up to the highest one. [1]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Series:
    """A displacement or tilt, and what one probe's error is worth in it."""

    name: str
    unit: str
    values: FloatArray
    scale: float = 1.0
    """Unit of the series for each µm of a probe's displacement."""
    probes: int = 1
    distance_mm: float | None = None
    resolution_um: float = 0.0


def evaluate_thermal_test(
    log: ThermalLog,
    kind: ThermalTestKind,
    setup: ThermalTestSetup,
    *,
    read: ThermalLog | None = None,
) -> ThermalTest:
    """Evaluate a log as one of the four tests of ISO 230-3.

    Parameters
    ----------
    read : ThermalLog, optional
        The log as it was read, where a model was taken off: values less a model have no step, and
        the resolution is that of what was read. Default: the log itself.

    Raises
    ------
    ConfigurationError
        If the set-up names no probe, or nothing that says when something moved.
    DataError
        If the log lacks a channel or has it in another unit, nothing moved, test or motion is
        shorter than 60 min, or a channel has no value for 30 min.

    References
    ----------
    ISO 230-3:2020, from memory [M]: which ranges and spans, tilts A = (Y1 - Y2) / l and
    B = (X1 - X2) / l, the end of a test.
    """
    series = tuple(_series(log, kind, setup, read or log))
    begin_s, end_s = _span(log, kind, setup)
    step_s = log.usual_step_s if log.rows > 1 else 0.0
    if not end_s - begin_s + step_s >= HOUR_S:
        minutes = significant((end_s - begin_s) / 60.0, 3)
        raise DataError("thermal_test_too_short", minutes=minutes, place=log.place())
    warnings = list(_warnings(log, kind, setup, begin_s, end_s))
    ambient = [_measured(log, name, "degC") for name in setup.ambient]
    for name, channel in (*setup.named(kind), *zip(setup.ambient, setup.ambient, strict=True)):
        warnings += _gaps(log, name, channel, begin_s, end_s)
    spans_h: tuple[float, ...] = ()
    if kind is ThermalTestKind.ETVE:
        spans_h = tuple(t for t in setup.spans_h if t * HOUR_S <= end_s - begin_s + step_s)
    own = _Rows(log.time_s, begin_s, end_s, step_s)
    quantities = tuple(_quantity(one, own, spans_h, ambient, setup) for one in series)
    criterion = None if kind is ThermalTestKind.ETVE else _criterion(quantities)
    hours = significant((end_s - begin_s) / HOUR_S, 3)
    short_h = CUSTOMARY_H - (end_s - begin_s + step_s) / HOUR_S
    if short_h > 1e-9 and not (criterion and criterion.reached):
        values = {"hours": hours, "least_h": CUSTOMARY_H}
        below = {**values, "percent": 100.0 * END_SHARE}
        early = Message("warning-thermal_test_ended_early", below)
        short = Message("warning-thermal_test_short", values)
        warnings.append(short if kind is ThermalTestKind.ETVE else early)
    return ThermalTest(
        kind=kind,
        name=log.name,
        time_s=log.time_s,
        begin_s=begin_s,
        end_s=end_s,
        quantities=quantities,
        temperatures=tuple(_temperatures(log, setup, own)),
        room_spread_k=_spread(ambient),
        spans_h=spans_h,
        spectrum=_spectrum(log, setup, own) if kind is not ThermalTestKind.ETVE else (),
        end_criterion=criterion,
        warnings=tuple(warnings),
    )


# ---- displacements and tilts --------------------------------------------------------------------


def _series(
    log: ThermalLog, kind: ThermalTestKind, setup: ThermalTestSetup, read: ThermalLog
) -> Iterator[_Series]:
    """Yield what is measured, and behind it what is made of two of them."""
    differences, named = [("A", "Y1", "Y2"), ("B", "X1", "X2")], setup.named(kind)
    if kind is ThermalTestKind.LINEAR:
        differences = [("D+", "P2+", "P1+"), ("D-", "P2-", "P1-")]
    if not named:
        raise ConfigurationError("probes_missing", key="probes")
    stated_um = setup.uncertainty.resolution_um
    found: dict[str, _Series] = {}
    for name, channel in named:
        values = _measured(log, channel, "um")
        shown = _measured(read, channel, "um")
        known = shown[~np.isnan(shown)]
        resolution_um = resolution_of(known) if stated_um is None else stated_um
        found[name] = _Series(name, "um", values, resolution_um=resolution_um)
    yield from found.values()
    distance_mm = setup.probes.distance_mm
    for name, one, other in differences:
        if one not in found or other not in found:
            continue
        scale, unit = 1.0, "um"
        if distance_mm is not None and kind is not ThermalTestKind.LINEAR:
            scale, unit = 1e3 / distance_mm, "um/m"
        minuend, subtrahend = found[one], found[other]
        yield _Series(
            name,
            unit,
            scale * _difference(log.time_s, minuend.values, subtrahend.values),
            scale,
            2,
            distance_mm if unit == "um/m" else None,
            max(minuend.resolution_um, subtrahend.resolution_um),
        )


def _measured(log: ThermalLog, channel: str, unit: str) -> FloatArray:
    """Return a channel that has a value."""
    values = log.column(channel, unit=unit)
    if bool(np.all(np.isnan(values))):
        _refuse_set_aside(log, channel, 0.0, log.duration_s)
        raise DataError("never_measured", place=log.place(log.name_of(channel)))
    return values


def _refuse_set_aside(log: ThermalLog, channel: str, begin_s: float, end_s: float) -> None:
    """Refuse values that are missing because reading set them aside; say which finding did."""
    name = log.name_of(channel)
    for one in log.remarks:
        if one.code in _SET_ASIDE and one.place.channel == name:
            first_s, last_s = (log.time_s[int(str(one.values[key]))] for key in ("row", "last"))
            if first_s <= end_s and last_s >= begin_s:
                place = log.place(name)
                raise DataError(
                    "thermal_test_values_set_aside",
                    finding=Message(one.code, one.values),
                    most_min=LONGEST_GAP_S / 60.0,
                    place=place,
                )


def _difference(time_s: FloatArray, one: FloatArray, other: FloatArray) -> FloatArray:
    """Return a difference at every row of either, the other between its neighbours in time."""
    columns: list[FloatArray] = []
    for values in (one, other):
        known = ~np.isnan(values)
        between = np.interp(time_s, time_s[known], values[known], left=np.nan, right=np.nan)
        columns.append(between)
    return np.where(np.isnan(one) & np.isnan(other), np.nan, columns[0] - columns[1])


@final
@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Which rows of a test belong together; a row less at the end is no hour less."""

    time_s: FloatArray
    begin_s: float
    end_s: float
    step_s: float

    def within(self, first_s: float, last_s: float) -> NDArray[np.bool_]:
        return rows_between(self.time_s, max(first_s, self.begin_s), min(last_s, self.end_s))

    @property
    def whole(self) -> NDArray[np.bool_]:
        return self.within(self.begin_s, self.end_s)

    @property
    def hours(self) -> list[NDArray[np.bool_]]:
        count = int((self.end_s - self.begin_s + self.step_s) / HOUR_S)
        begins_s = self.begin_s + HOUR_S * np.arange(count)
        return [self.within(begin_s, begin_s + HOUR_S) for begin_s in begins_s.tolist()]


def _quantity(
    one: _Series,
    own: _Rows,
    spans_h: tuple[float, ...],
    ambient: list[FloatArray],
    setup: ThermalTestSetup,
) -> ThermalTestQuantity:
    hours, cooling = own.hours, rows_between(own.time_s, own.end_s, float(own.time_s[-1]))
    last = own.within(own.end_s - HOUR_S, own.end_s)
    has_cooling = int(np.count_nonzero(cooling & ~np.isnan(one.values))) > 1
    return ThermalTestQuantity(
        name=one.name,
        unit=one.unit,
        values=one.values,
        first_hour=_range(one, hours[0], ambient, setup),
        whole=_range(one, own.whole, ambient, setup),
        last_hour=range_of(one.values[last]),
        cooling=_range(one, cooling, ambient, setup) if has_cooling else None,
        drift_per_h=tuple(_slope(own.time_s[rows], one.values[rows]) for rows in hours),
        last_hour_drift_per_h=_slope(own.time_s[last], one.values[last]),
        within_spans=largest_ranges(own.time_s, one.values, [t * HOUR_S for t in spans_h]),
    )


def _slope(time_s: FloatArray, values: FloatArray) -> float:
    """Return the slope by least squares per hour."""
    known = ~np.isnan(values)
    if int(np.count_nonzero(known)) < 2:
        return float("nan")
    about_h = (time_s[known] - np.mean(time_s[known])) / HOUR_S
    return float(about_h @ (values[known] - np.mean(values[known])) / (about_h @ about_h))


def _range(
    one: _Series, rows: NDArray[np.bool_], ambient: list[FloatArray], setup: ThermalTestSetup
) -> RangeFigure:
    """Return a range with what makes it uncertain.

    Two readings of each probe: a rectangle of the resolution about both; of the expansion, up to
    what the ambient range makes of it; half the step to a neighbour at both extremes.
    """
    values, known = one.values[rows], setup.uncertainty
    value, both = range_of(values), one.scale * float(np.sqrt(one.probes))
    terms: dict[UncertaintyCause, float] = {}
    if known.probe_um is not None:
        terms[UncertaintyCause.PROBE] = both * known.probe_um / COVERAGE
    ranges_k = [r for column in ambient if not np.isnan(r := range_of(column[rows]))]
    if known.fixture_um_per_k is not None and ranges_k:
        widest_k = max(ranges_k)
        terms[UncertaintyCause.TEMPERATURE] = both * known.fixture_um_per_k * widest_k / 3.0**0.5
    terms[UncertaintyCause.RESOLUTION] = both * one.resolution_um / 6.0**0.5
    terms[UncertaintyCause.SAMPLING] = _between_rows(values) / 3.0**0.5
    if one.distance_mm is not None and known.distance_mm is not None:
        relative = known.distance_mm / COVERAGE / one.distance_mm
        terms[UncertaintyCause.DISTANCE] = value * relative
    return RangeFigure(value, terms)


def _between_rows(values: FloatArray) -> float:
    """Return half the larger step to a neighbour at both extremes, root of the sum of squares."""
    known = values[~np.isnan(values)]
    steps = np.pad(np.abs(np.diff(known)), 1)
    halves = [0.5 * max(steps[k], steps[k + 1]) for k in (np.argmax(known), np.argmin(known))]
    return float(np.hypot(*halves))


# ---- when something moved -----------------------------------------------------------------------


def _span(log: ThermalLog, kind: ThermalTestKind, setup: ThermalTestSetup) -> tuple[float, float]:
    """Return begin and end of the test, or of the motion."""
    if kind is ThermalTestKind.ETVE:
        return 0.0, log.duration_s
    motion = setup.motion
    if motion.running_min is not None:
        begin_s, end_s = (60.0 * edge for edge in motion.running_min)
        if end_s > log.duration_s + (log.usual_step_s if log.rows > 1 else 0.0):
            minutes = significant(log.duration_s / 60.0, 4)
            place = log.place()._replace(key="motion.running_min")
            raise DataError("motion_beyond_log", minutes=minutes, place=place)
        return begin_s, min(end_s, log.duration_s)
    if not motion.speed:
        raise ConfigurationError("motion_missing", key="motion.speed")
    moving = np.flatnonzero(_speed(log, motion.speed) > 0.0)
    if not moving.size:
        place = log.place(log.name_of(motion.speed))
        raise DataError("never_moved", least=STANDSTILL, place=place)
    return float(log.time_s[moving[0]]), float(log.time_s[moving[-1]])


def _speed(log: ThermalLog, channel: str) -> FloatArray:
    """Return a speed without its sign; what counts as standstill is zero."""
    speed = np.abs(log.column(channel))
    least = max(STANDSTILL, SPEED_NOISE * float(np.fmax.reduce(speed)))
    return np.where(speed <= least, 0.0, speed)


def _spectrum(log: ThermalLog, setup: ThermalTestSetup, own: _Rows) -> tuple[SpeedClass, ...]:
    """Return how long which speeds were run; one holds until the next that was recorded."""
    if not setup.motion.speed:
        return ()
    column = _speed(log, setup.motion.speed)
    rows = np.flatnonzero(own.whole & ~np.isnan(column))
    speed, held_s = column[rows[:-1]], np.diff(log.time_s[rows])
    highest = max(setup.motion.highest or 0.0, float(np.max(speed, initial=STANDSTILL)))
    number = np.ceil(_CLASSES * speed / highest * (1.0 - 1e-9))
    classes: list[SpeedClass] = []
    for k in np.unique(number).tolist():
        alike = number == k
        time_s = float(np.sum(held_s[alike]))
        mean = float(speed[alike] @ held_s[alike]) / time_s
        width = 100.0 / _CLASSES
        classes.append(SpeedClass(max(k - 1.0, 0.0) * width, k * width, mean, time_s))
    return tuple(classes)


def _criterion(quantities: tuple[ThermalTestQuantity, ...]) -> EndCriterion | None:
    own = [one for one in quantities if not one.is_tilt]
    if len(own[0].drift_per_h) < 2:
        return None
    return EndCriterion(max(one.first_hour.value for one in own), max(one.last_hour for one in own))


# ---- temperatures -------------------------------------------------------------------------------


def _temperatures(
    log: ThermalLog, setup: ThermalTestSetup, own: _Rows
) -> Iterator[ThermalTestTemperature]:
    ambient = [log.name_of(name) for name in setup.ambient]
    others = [n for n, unit in log.units.items() if unit in TEMPERATURES and n not in ambient]
    whole, first = own.whole, own.hours[0]
    for name in (*ambient, *others):
        values = log.column(name, unit="degC")
        known = values[whole & ~np.isnan(values)]
        (gradient,) = largest_ranges(own.time_s[whole], values[whole], (HOUR_S,))
        yield ThermalTestTemperature(
            channel=name,
            ambient=name in ambient,
            start_c=float(known[0]) if known.size else float("nan"),
            end_c=float(known[-1]) if known.size else float("nan"),
            range_k=range_of(known),
            first_hour_range_k=range_of(values[first]),
            gradient_k_per_h=gradient,
        )


def _spread(ambient: list[FloatArray]) -> float | None:
    """Return the largest difference within the room at one time."""
    if len(ambient) < 2:
        return None
    table = np.stack(ambient)
    apart = np.ptp(table, axis=0)
    return float(np.max(apart, where=~np.isnan(apart), initial=0.0))


# ---- what the reader must know ------------------------------------------------------------------


def _warnings(
    log: ThermalLog, kind: ThermalTestKind, setup: ThermalTestSetup, begin_s: float, end_s: float
) -> Iterator[Message]:
    if kind is ThermalTestKind.ETVE:
        for name, unit in log.units.items():
            moved = _speed(log, name) > 0.0
            if unit == "rpm" and bool(np.any(moved)):
                percent = significant(100.0 * float(np.mean(moved)), 2)
                values = {"channel": name, "percent": percent}
                yield Message("warning-thermal_test_turned", values)
    else:
        yield from _motion_warnings(log, setup.motion, begin_s, end_s)
    if kind is not ThermalTestKind.LINEAR:
        there = {name for name, _ in setup.probes.named}
        if missing := [name for name in ("X1", "X2", "Y1", "Y2", "Z") if name not in there]:
            values = {"probes": ", ".join(missing)}
            yield Message("warning-thermal_test_probes_missing", values)
    if not setup.ambient:
        yield Message("warning-thermal_test_without_ambient")
    tilts = kind is not ThermalTestKind.LINEAR and (setup.probes.x2 or setup.probes.y2)
    keys = ("probe_um", "fixture_um_per_k", *(["distance_mm"] if tilts else []))
    if lacking := [key for key in keys if getattr(setup.uncertainty, key) is None]:
        yield Message("warning-thermal_test_not_stated", {"keys": ", ".join(lacking)})


def _motion_warnings(
    log: ThermalLog, motion: ThermalTestMotion, begin_s: float, end_s: float
) -> Iterator[Message]:
    before = log.time_s < begin_s
    if motion.speed:
        speed = _speed(log, motion.speed)
        before &= ~np.isnan(speed)
        highest = float(np.fmax.reduce(speed))
        if motion.highest is not None and highest > (1.0 + SPEED_NOISE) * motion.highest:
            values = {"stated": motion.highest, "highest": significant(highest, 4)}
            yield Message("warning-thermal_test_highest_passed", values)
    if not bool(np.any(before)):
        yield Message("warning-thermal_test_moves_at_once")
    if log.duration_s - end_s < HOUR_S:
        minutes = significant((log.duration_s - end_s) / 60.0, 3)
        yield Message("warning-thermal_test_cooling_short", {"minutes": minutes})


def _gaps(
    log: ThermalLog, name: str, channel: str, begin_s: float, end_s: float
) -> Iterator[Message]:
    """Yield how long a quantity was not measured; refuse what leaves no range within 60 min."""
    known = ~np.isnan(log.column(channel))
    known_s = log.time_s[known & rows_between(log.time_s, begin_s, end_s)]
    edges_s = np.concatenate(([begin_s], known_s, [end_s]))
    gaps_s = np.diff(edges_s)
    longest = int(np.argmax(gaps_s))
    gap_s, at_s = float(gaps_s[longest]), float(edges_s[longest])
    told = {"quantity": name, "minutes": significant(gap_s / 60.0, 3)}
    told["at_min"] = significant(at_s / 60.0, 4)
    if gap_s > LONGEST_GAP_S:
        _refuse_set_aside(log, channel, at_s, at_s + gap_s)
        too_long = {**told, "most_min": LONGEST_GAP_S / 60.0}
        raise DataError.of(Message("error-thermal_test_gap", too_long, log.place()))
    if gap_s > max(TOLD_GAP_S, _FEW_ROWS * float(np.median(gaps_s))):
        yield Message("warning-thermal_test_gap", told)
