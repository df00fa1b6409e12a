"""What the page of the model draws of it: numbers only, no request and no template here."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from typing import Final, NamedTuple

from thermaxis.compensation import CompensationModel, Output, Part
from thermaxis.screen.pages.history import Json

SETTLED_TIME_CONSTANTS: Final = 5.0
"""A step is shown until so many of the slowest time constants: less than 1 % of it is left. [1]"""
MOST_RECORDS: Final = 4.0
"""... but no longer than so many of the longest training record: the rest is a guess. [1]"""
STEP_POINTS: Final = 160
"""Points of a step on an even grid, and as many on a geometric one: fast sections are seen. [1]"""
SHORTEST_STEP_SAMPLES: Final = 10.0
"""A step is shown for so many sample times at least. [1]"""
_FASTEST_SHARE = 1e-3
_SAME_SHARE = 1e-6


class StepShown(NamedTuple):
    """Step of one output, as it is drawn."""

    time_s: tuple[float, ...]
    """Times after the step, from 0. [s]"""
    known: int
    """Points within the longest training record; all of them where it is not known. [1]"""
    response_um_per_k: Mapping[str, tuple[float, ...]]
    """Displacement by part. [µm/K]"""


def step_response_um_per_k(part: Part, time_s: float, input_filter_s: float = 0.0) -> float:
    """Return what a part says some time after its input rose by one kelvin and stayed.

    References
    ----------
    Step of first-order sections side by side: Ljung, System Identification, 2nd ed., section 4.3;
    the parts are those of Mareš and Horejš 2021, equations (3) and (8), in parallel form.
    """
    acting_s = time_s - part.delay_s
    if acting_s < 0.0:
        return 0.0
    direct = part.direct_gain_um_per_k
    if input_filter_s > 0.0:
        direct *= _lag(acting_s, input_filter_s)
    return direct + math.fsum(
        s.gain_um_per_k * _two_lags(acting_s, s.time_constant_s, input_filter_s)
        for s in part.sections
    )


def _lag(time_s: float, tau_s: float) -> float:
    return -math.expm1(-time_s / tau_s)


def _two_lags(time_s: float, tau_s: float, filter_s: float) -> float:
    """Return the step of a lag behind the input's filter. [1]"""
    if filter_s <= 0.0:
        return _lag(time_s, tau_s)
    apart_s = tau_s - filter_s
    if abs(apart_s) <= _SAME_SHARE * tau_s:
        share = 2.0 * time_s / (tau_s + filter_s)
        return 1.0 - (1.0 + share) * math.exp(-share)
    return (tau_s * _lag(time_s, tau_s) - filter_s * _lag(time_s, filter_s)) / apart_s


def longest_record_s(model: CompensationModel) -> float | None:
    """Return the length of the longest log that the model was made from."""
    rows = max((log.rows for log in model.provenance.logs), default=0)
    return rows * model.sample_time_s if rows > 0 else None


def step_of(model: CompensationModel, output: Output) -> StepShown:
    """Return the steps of an output's parts."""
    record_s = longest_record_s(model)
    times = _times_of(model, output.parts, record_s)
    known = len(times) if record_s is None else sum(t <= record_s for t in times)
    return StepShown(
        times,
        known,
        {
            part.name: tuple(step_response_um_per_k(part, t, model.input_filter_s) for t in times)
            for part in output.parts
        },
    )


def _times_of(
    model: CompensationModel, parts: Sequence[Part], record_s: float | None
) -> tuple[float, ...]:
    """Return an even and a geometric grid, with every delay and the end of the record in it."""
    taus = [s.time_constant_s for part in parts for s in part.sections]
    delay_s = max(part.delay_s for part in parts)
    last_s = delay_s + SETTLED_TIME_CONSTANTS * (
        max(taus, default=0.0) + max(model.input_filter_s, 0.0)
    )
    last_s = max(last_s, SHORTEST_STEP_SAMPLES * model.sample_time_s)
    if record_s is not None:
        last_s = min(last_s, MOST_RECORDS * record_s)
    even = (last_s * k / STEP_POINTS for k in range(STEP_POINTS + 1))
    early = [last_s * _FASTEST_SHARE ** (1.0 - k / STEP_POINTS) for k in range(STEP_POINTS)]
    late = [part.delay_s + t for part in parts if part.delay_s > 0.0 for t in early]
    times = {*even, *early, *late, *_both_sides(parts)}
    if record_s is not None:
        times.add(record_s)
    return tuple(sorted(t for t in times if t <= last_s))


def _both_sides(parts: Iterable[Part]) -> Iterable[float]:
    """Yield the last time before each delay has passed and the first one behind it."""
    for part in parts:
        if part.delay_s > 0.0:
            yield math.nextafter(part.delay_s, 0.0)
            yield part.delay_s


def is_held(part: Part, diameter_mm: float | None) -> bool:
    """Return whether a diameter lies outside the points of a part's gain: the end value holds."""
    points = part.gain_by_diameter
    if diameter_mm is None or not points:
        return False
    return not points[0].diameter_mm <= diameter_mm <= points[-1].diameter_mm


def charts_of(model: CompensationModel, diameter_mm: float | None) -> Json:
    """Return what the charts of a model are drawn of."""
    return {
        "record_s": longest_record_s(model),
        "diameter_mm": diameter_mm,
        "outputs": [
            {
                "name": output.name,
                "parts": [
                    asdict(part) | {"dc_gain_um_per_k": part.dc_gain_um_per_k}
                    for part in output.parts
                ],
                "step": step_of(model, output)._asdict(),
            }
            for output in model.outputs
        ],
    }
