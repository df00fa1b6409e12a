"""Name what is wrong with an axis, with the number behind each finding.

Every finding has passed two gates: a statistical test, so that noise does not become a fault, and
a practical threshold, so that a fault that nobody would repair is not named. Faults of the axis
come first, ordered by what they add to the accuracy A of the axis without drift; then what
concerns its thermal state; last what the choice of the targets hides.

The tests share a probability of 5 % of naming anything on a healthy axis: 2 % for the spread and
0.5 % for each of the others.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

import numpy as np

from thermaxis.codes import Message
from thermaxis.positioning.diagnosis._drift import Explained, channel_on, explanation, turns_of
from thermaxis.positioning.diagnosis._levels import (
    FEWEST_TARGETS,
    LEAST_EFFECT,
    LEVEL,
    Axis,
    axis_of,
    upper_tail,
)
from thermaxis.positioning.diagnosis._periods import (
    AT_MULTIPLES,
    VISIBLE,
    Periodic,
    candidate_periods,
    stated_periods,
    strongest_period,
    visibility,
    waves_of,
)
from thermaxis.positioning.diagnosis._reversal import Shape, reversal_shape, without_step
from thermaxis.positioning.diagnosis._spread import (
    frozen_targets,
    spreads_with_drift,
    spreads_without_drift,
    within_one_step,
)
from thermaxis.positioning.run import FloatArray, PositioningTest
from thermaxis.quantities import AxisKind

if TYPE_CHECKING:
    from thermaxis.positioning.drift import DriftResult

LEAST_SCALE_UM_PER_M = 5.0
"""Straight-line error that is no finding: half a kelvin of steel, which a run hardly knows
better. [µm/m]"""
LEAST_SCALE_ARCSEC_PER_TURN = 2.0
"""The same for a rotary axis; own choice. [arcsec per 360 deg]"""
LEAST_SPREAD_RATIO = 1.5
"""Spread over that of the other targets that is no finding; own choice. [1]"""
STEEL_PPM_PER_K = 11.5
"""Expansion coefficient where the file states none: steel, as scales and screws are stated.
[ppm/K]"""


@final
@dataclass(frozen=True, slots=True)
class Finding:
    """What the diagnosis found, with its number."""

    finding: str
    """Key that stays: scale_error, once_per_turn_error, periodic_error, backlash, backlash_step,
    backlash_variation, spread, frozen_readings, drift_reversal, temperature_channel or
    hidden_period."""
    value: float
    """The number behind it: straight-line error, amplitude once per turn or of the periodic error,
    mean reversal value, step of the reversal value, its range along the axis, standard deviation
    at the target (frozen_readings: of the others), way back of the drift, drift per kelvin, or
    hidden period. [unit in `unit`]"""
    unit: str
    """Unit of the number as printed."""
    message: Message
    p_value: float | None
    """Probability of so much or more by chance alone, all places that were searched counted;
    for scale_error, once_per_turn_error, backlash and drift_reversal if the true value were at its
    threshold. None where nothing was tested. [1]"""


@final
@dataclass(frozen=True, slots=True)
class _Ranked:
    finding: Finding
    group: int
    """0 fault of the axis, 1 thermal state, 2 choice of the targets. [1]"""
    effect: float
    """Contribution to the accuracy. [µm or arcsec]"""


def _named_source(axis: Axis, period: float) -> Message:
    stated = stated_periods(axis.test)
    linear = axis.test.kind is AxisKind.LINEAR
    if stated and period == stated[0] / 2.0:
        return Message("diagnosis-half_the_pitch")
    if period in stated:
        return Message("diagnosis-period_stated")
    return Message("diagnosis-screw_pitch" if linear else "diagnosis-worm_wheel_pitch")


def _amounts(amounts: Iterable[float], unit: str) -> tuple[Message, ...]:
    return tuple(Message("diagnosis-amount", {"amount": one, "unit": unit}) for one in amounts)


def _periodic_findings(axis: Axis, found: Periodic | None) -> list[_Ranked]:
    if found is None:
        return []
    values = {
        **axis.units,
        "amplitude": found.amplitude,
        "period": found.period,
        "source": _named_source(axis, found.period),
    }
    message = Message("finding-periodic_error", values)
    if found.others:
        others = _amounts(found.others, axis.units["position_unit"])
        message = Message("finding-periodic_error_ambiguous", {**values, "others": others})
    finding = Finding("periodic_error", found.amplitude, axis.unit, message, found.p_value)
    return [_Ranked(finding, 0, 2.0 * found.amplitude)]


def _hidden_findings(test: PositioningTest, found: Periodic | None) -> list[_Ranked]:
    """Warn of periods at whose multiples the targets stand."""
    target = test.target
    if target.size < 3:
        return []
    stated = stated_periods(test)
    tried = [p for p in stated or candidate_periods(test) if p <= test.measured_length]
    if stated:
        hidden = [p for p in tried if visibility(target, p)[0] < VISIBLE]
    else:
        hidden = [
            p for p in tried if np.hypot(*np.mean(waves_of(target, p), axis=0)) > AT_MULTIPLES
        ]
    if not hidden or (found is not None and found.period in hidden):
        return []
    unit = test.kind.units.position
    message = Message(
        "finding-hidden_period_stated" if stated else "finding-hidden_period_common",
        {"periods": _amounts(hidden, unit)},
    )
    return [_Ranked(Finding("hidden_period", hidden[0], unit, message, None), 2, 0.0)]


def _expansion(test: PositioningTest) -> tuple[float, Message]:
    """Return the expansion coefficient [ppm/K] and where it comes from."""
    stated = test.environment.get("expansion_coefficient_ppm_per_k")
    for value in () if stated is None else (stated.start, stated.end):
        if value is not None and np.isfinite(value) and value > 0.0:
            return value, Message("diagnosis-coefficient_stated")
    return STEEL_PPM_PER_K, Message("diagnosis-coefficient_of_steel")


def _weights(axis: Axis, found: Periodic | None) -> FloatArray:
    """Return weights of the levels in the slope and, of a full turn, in its cosine and sine."""
    periods = ([360.0, 180.0] if axis.full_turn else []) + ([found.period] if found else [])
    waves = [waves_of(axis.target, period) for period in periods]
    along = (axis.target - np.mean(axis.target)) * (not axis.closed)
    columns = np.column_stack((along, np.ones_like(along), *waves))
    weights = np.asarray(np.linalg.pinv(columns), dtype=np.float64)
    if axis.closed:  # both ends are one place: only their difference is a slope
        weights[0, [0, -1]] = -1.0 / axis.length, 1.0 / axis.length
    return weights[[0, 2, 3]] if axis.full_turn else weights[:1]


def _turn_findings(axis: Axis, found: Periodic | None) -> list[_Ranked]:
    """Name the error that repeats with every turn of a rotary axis."""
    if not axis.full_turn:
        return []
    weights = _weights(axis, found)[1:]
    wave = weights @ axis.mean
    amplitude = float(np.hypot(*wave))
    unsure = float(np.linalg.norm(weights @ axis.mean_covariance @ weights.T, 2)) ** 0.5
    p_value = upper_tail((amplitude - LEAST_EFFECT) / max(unsure, 1e-12), axis.free)
    if p_value >= LEVEL:
        return []
    values = {"amplitude": amplitude, "unit": axis.unit}
    message = Message("finding-once_per_turn_error", values)
    finding = Finding("once_per_turn_error", amplitude, axis.unit, message, p_value)
    return [_Ranked(finding, 0, 2.0 * amplitude)]


def _line(axis: Axis, found: Periodic | None) -> tuple[float, float]:
    """Return slope and standard uncertainty of the least-squares line. [µm/mm or arcsec/deg]"""
    weight = _weights(axis, found)[0]
    slope = float(weight @ axis.mean)
    variance = float(weight @ axis.mean_covariance @ weight)
    if axis.drift is None:
        return slope, float(np.sqrt(variance))
    since = float(axis.drift.slope[0])  # levels are those at t0; go back to the first reading
    return slope + since, float(np.sqrt(variance)) + float(axis.drift.slope_std[0])


def _scale_findings(axis: Axis, found: Periodic | None) -> list[_Ranked]:
    slope, uncertainty = _line(axis, found)
    linear = axis.test.kind is AxisKind.LINEAR
    per, unit = (1000.0, f"{axis.unit}/m") if linear else (360.0, f"{axis.unit} per turn")
    least = (LEAST_SCALE_UM_PER_M if linear else LEAST_SCALE_ARCSEC_PER_TURN) / per
    least = max(least, LEAST_EFFECT / axis.length)
    p_value = upper_tail((abs(slope) - least) / max(uncertainty, 1e-12), axis.free)
    if p_value >= LEVEL:
        return []
    drift_included = axis.drift is None
    state = Message("diagnosis-drift_included" if drift_included else "diagnosis-first_reading")
    if linear:
        ppm_per_k, source = _expansion(axis.test)
        message = Message(
            "finding-scale_error_linear",
            {
                "slope_um_per_m": slope * per,
                "over_length_um": slope * axis.length,
                "length_mm": axis.length,
                "state": state,
                "temperature_error_K": abs(slope) * per / ppm_per_k,
                "expansion_ppm_per_K": ppm_per_k,
                "source": source,
            },
        )
    else:
        message = Message(
            "finding-scale_error_rotary",
            {
                "slope_arcsec_per_turn": slope * per,
                "over_length_arcsec": slope * axis.length,
                "length_deg": axis.length,
                "state": state,
            },
        )
    finding = Finding("scale_error", slope * per, unit, message, p_value)
    return [_Ranked(finding, 0, abs(slope) * axis.length)]


def _shape_findings(axis: Axis, shape: Shape) -> list[_Ranked]:
    first, last = float(shape.fitted[0]), float(shape.fitted[-1])
    if shape.step_after is not None:
        k = shape.step_after
        step = last - first
        message = Message(
            "finding-backlash_step",
            {
                **axis.units,
                "step": step,
                "before": float(axis.target[k - 1]),
                "behind": float(axis.target[k]),
                "first": first,
                "last": last,
            },
        )
        finding = Finding("backlash_step", step, axis.unit, message, shape.p_value)
        return [_Ranked(finding, 0, abs(step))]
    size = float(np.ptp(shape.fitted))
    if size < LEAST_EFFECT:
        return []
    low, high = int(np.argmin(shape.fitted)), int(np.argmax(shape.fitted))
    message = Message(
        "finding-backlash_variation",
        {
            **axis.units,
            "range": size,
            "lowest": float(shape.fitted[low]),
            "lowest_at": float(axis.target[low]),
            "highest": float(shape.fitted[high]),
            "highest_at": float(axis.target[high]),
        },
    )
    finding = Finding("backlash_variation", size, axis.unit, message, shape.p_value)
    return [_Ranked(finding, 0, size)]


def _backlash_findings(axis: Axis, shape: Shape | None) -> list[_Ranked]:
    """Name the mean reversal value, and what is not the same everywhere."""
    if axis.reversal is None or shape is None:
        return []
    findings = _shape_findings(axis, shape)
    mean = float(np.mean(axis.reversal))
    uncertainty = float(np.sqrt(np.mean(axis.reversal_covariance)))
    p_value = upper_tail((abs(mean) - LEAST_EFFECT) / max(uncertainty, 1e-12), axis.free)
    everywhere = float(np.min(shape.fitted * np.sign(mean)))  # what is left without the variation
    if p_value >= LEVEL or everywhere < LEAST_EFFECT:
        return findings
    cause = Message("diagnosis-lost_motion" if mean < 0.0 else "diagnosis-too_much_compensation")
    state = Message("diagnosis-drift_included" if axis.drift is None else "diagnosis-without_drift")
    values = {"unit": axis.unit, "mean": mean, "state": state, "cause": cause}
    message = Message("finding-backlash", values)
    finding = Finding("backlash", mean, axis.unit, message, p_value)
    return [*findings, _Ranked(finding, 0, everywhere)]


def _spread_findings(axis: Axis) -> list[_Ranked]:
    """Name targets that scatter more than the others."""
    test, drift = axis.test, axis.drift
    if test.target.size < FEWEST_TARGETS or test.repeats_exactly:
        return []
    named = spreads_with_drift(test) if drift is None else spreads_without_drift(drift)
    found: list[_Ranked] = []
    for spread in named:
        if spread.ratio < LEAST_SPREAD_RATIO or within_one_step(test, spread.target):
            continue
        compared = Message("diagnosis-unlike_others")
        if np.isfinite(spread.ratio):
            compared = Message("diagnosis-times_others", {"ratio": spread.ratio})
        code = "finding-spread"
        if drift is None:
            code = "finding-spread_drift_included"
        elif spread.target + 1 in drift.suspects:
            code = "finding-spread_drifts_otherwise"
        values = {
            **axis.units,
            "target": spread.target + 1,
            "position": float(test.target[spread.target]),
            "compared": compared,
            "std": spread.std,
        }
        finding = Finding("spread", spread.std, axis.unit, Message(code, values), spread.p_value)
        more = spread.std * (1.0 - 1.0 / spread.ratio)
        found.append(_Ranked(finding, 0, 4.0 * more))
    return found


def _frozen_findings(test: PositioningTest) -> list[_Ranked]:
    """Name targets that repeat exactly where the others scatter: no readings at all."""
    if test.target.size < FEWEST_TARGETS or test.repeats_exactly:
        return []
    found: list[_Ranked] = []
    for i, others, p_value in frozen_targets(test):
        units = test.kind.units
        values = {
            "target": i + 1,
            "position": float(test.target[i]),
            "position_unit": units.position,
            "unit": units.deviation,
            "readings": int(np.sum(test.readings[i])),
            "others": others,
        }
        message = Message("finding-frozen_readings", values)
        finding = Finding("frozen_readings", others, units.deviation, message, p_value)
        found.append(_Ranked(finding, 0, np.inf))
    return found


def _after(drift: "DriftResult", test: PositioningTest, index: int) -> Message:
    """Return how long after the start a point of the drift's curve lies."""
    time = float(drift.time_s[index] - drift.time_s[0])
    if test.time_s is None:
        return Message("diagnosis-readings", {"readings": round(time)})
    minutes = {"amount": float(round(time / 60.0)), "unit": "min"}
    hours = {"amount": round(time / 3600.0, 1), "unit": "h"}
    return Message("diagnosis-amount", minutes if time < 7200.0 else hours)


def _drift_reversal_findings(axis: Axis) -> list[_Ranked]:
    """Name the place among first, middle and last target where the drift turns back most."""
    drift, test = axis.drift, axis.test
    if drift is None or not drift.significant or drift.changes:  # what jumps is no warming
        return []
    middle = float(np.mean(test.target))
    places = (middle, float(test.target[0]), float(test.target[-1]))
    found = [turn for place in places for turn in turns_of(drift, place, place - middle)]
    if not found:
        return []
    turn = max(found, key=lambda turn: turn.shorter)
    beyond = (turn.shorter - LEAST_EFFECT) / max(turn.uncertainty, 1e-12)
    p_value = min(1.0, 2 * len(places) * upper_tail(beyond, axis.free))
    if p_value >= LEVEL:
        return []
    message = Message(
        "finding-drift_reversal",
        {
            **axis.units,
            "position": round(turn.position, 1),
            "there": turn.there,
            "after": _after(drift, test, turn.at),
            "back": turn.back,
        },
    )
    finding = Finding("drift_reversal", turn.back, axis.unit, message, p_value)
    return [_Ranked(finding, 1, turn.shorter)]


def is_temperature(name: str) -> bool:
    """Return whether a channel is a temperature, by its name."""
    lower = name.lower()
    return "temp" in lower or lower.endswith("_c")


def _temperature_findings(axis: Axis) -> list[_Ranked]:
    """Name the temperature that runs like the common drift, not only like a straight line."""
    drift, test = axis.drift, axis.test
    if drift is None or not drift.significant or drift.changes:  # what jumps is no warming
        return []
    if float(np.ptp(drift.common)) < LEAST_EFFECT:
        return []
    names = [name for name in test.channels if is_temperature(name)]
    tried: list[Explained] = []
    for name in names:
        channel = channel_on(test, test.channels[name], drift.time_s)
        explained = None if channel is None else explanation(name, channel, drift.common)
        if explained is not None and explained.p_value * len(names) < LEVEL:
            tried.append(explained)
    if not tried:
        return []
    best = max(tried, key=lambda e: abs(e.correlation))
    values = {
        "channel": best.name,
        "correlation": best.correlation,
        "gain": best.gain,
        "unit": axis.unit,
    }
    message = Message("finding-temperature_channel", values)
    if best.lag:
        values_delayed = {**values, "delay": _after(drift, test, best.lag)}
        message = Message("finding-temperature_channel_delayed", values_delayed)
    p_value = best.p_value * len(names)
    finding = Finding("temperature_channel", best.gain, f"{axis.unit}/K", message, p_value)
    return [_Ranked(finding, 1, float(np.ptp(drift.common)))]


def _ordered(found: Sequence[_Ranked]) -> tuple[Finding, ...]:
    return tuple(r.finding for r in sorted(found, key=lambda r: (r.group, -r.effect)))


def diagnose(test: PositioningTest, drift: "DriftResult | None") -> tuple[Finding, ...]:
    """Name what is wrong with an axis, the largest effect on its accuracy first.

    Parameters
    ----------
    drift : DriftResult or None
        Its drift-free levels; None where they do not exist: then the plain means are used,
        and nothing is said of the drift.

    Returns
    -------
    tuple of Finding
        Faults of the axis by their effect on the accuracy A: the straight-line error over the
        length, twice the amplitude of a periodic error, a step or range of the reversal value,
        the reversal value that is there everywhere, four times the additional standard
        deviation of a target. Then what the drift shows; last the periods that the targets
        hide. Empty for a healthy axis, and where fewer than three targets or no noise is known.

    Notes
    -----
    With fewer than five targets only the straight-line error and the mean reversal value are
    looked at, with fewer than seven no periodic error. A periodic error that depends on the
    approach, or has no candidate's period, is not found. A step of the reversal value that
    sits in one approach alone is taken out before lines and periods are fitted.

    References
    ----------
    N. R. Lomb 1976, J. D. Scargle 1982 (periodogram of unequal intervals); W. G. Cochran 1941
    (largest variance as a fraction of all); M. S. Bartlett 1946 (correlation of correlated
    series); all from memory. The thresholds are own choices, stated with their names.
    """
    axis = axis_of(test, drift)
    if axis is None:
        return _ordered(_hidden_findings(test, None))
    shape = None if axis.reversal is None else reversal_shape(axis, axis.reversal)
    level = without_step(axis, shape)
    found = strongest_period(level)
    return _ordered(
        [
            *_scale_findings(level, found),
            *_turn_findings(level, found),
            *_periodic_findings(level, found),
            *_backlash_findings(axis, shape),
            *_spread_findings(axis),
            *_frozen_findings(test),
            *_drift_reversal_findings(axis),
            *_temperature_findings(axis),
            *_hidden_findings(test, found),
        ]
    )
