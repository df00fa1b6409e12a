"""The page of the sensors: what is read, how much it is worth, and the rules it is judged by."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from itertools import pairwise
from statistics import median
from typing import TYPE_CHECKING, Final, NamedTuple

from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from thermaxis.runtime import (
    DIAMETER,
    MachineConfiguration,
    Role,
    interlock_name,
    probe_name,
    redundant_name,
)
from thermaxis.screen.access import needs, parts_of, render
from thermaxis.screen.pages.history import Json
from thermaxis.web import answer_json

if TYPE_CHECKING:
    from thermaxis.screen.access import ScreenParts
    from thermaxis.screen.feed import StatusSnapshot

LEAST_VALUES: Final = 30
"""Below so many values no noise is told. Default: the standard deviation of 30 values is known to
about 15 %. [1]"""
NOISE_SPAN_S: Final = 300.0
"""Noise is that of the last five minutes: longer spans hold more of the warming. [s]"""
GAP_S: Final = 5.0
"""Values that are farther apart are not joined by a line... [s]"""
GAP_CYCLES: Final = 3.0
"""... if they are so many cycles apart, too. [1]"""
_NEIGHBOURS = 3.0
_MS = 1000.0

Values = Sequence[tuple[float, float]]
"""Times [s] and raw values, in the order of time."""


class Noise(NamedTuple):
    """How much a sensor scatters."""

    deviation_k: float | None
    """Standard deviation; None where too few values are known. [K]"""
    values: int
    """Values that it is taken from. [1]"""


def routes(parts: "ScreenParts") -> list[BaseRoute]:
    """Return the routes of the page."""
    del parts
    return [
        Route("/sensors", _page, methods=["GET"]),
        Route("/sensors/values", _values, methods=["GET"]),
    ]


def noise_of(values: Values) -> Noise:
    """Return how much a sensor scatters, as its slow changes do not count.

    Half the mean square of the differences from value to value: a temperature that drifts by much
    less than its noise between two values leaves it unchanged. Differences across a gap are left
    out.

    A source that repeats a value until it has a new one makes it smaller than the sensor's own.

    References
    ----------
    von Neumann, Kent, Bellinson and Hart 1941, The mean square successive difference, Annals of
    Mathematical Statistics 12, 153-162.
    """
    recent = [(t, v) for t, v in values if t >= values[-1][0] - NOISE_SPAN_S]
    if len(recent) < LEAST_VALUES:
        return Noise(None, len(recent))
    longest_s = _NEIGHBOURS * median(b[0] - a[0] for a, b in pairwise(recent))
    squares = [(b[1] - a[1]) ** 2 for a, b in pairwise(recent) if b[0] - a[0] <= longest_s]
    return Noise(math.sqrt(math.fsum(squares) / (2.0 * len(squares))), len(recent))


def facts_of(configuration: MachineConfiguration) -> Json:
    """Return what the configuration says of sensors, interlocks and flags."""
    other = configuration.other_compensation
    return {
        "channels": [
            {
                "name": name,
                "redundant": redundant_name(name)
                if name in configuration.rules.redundant
                else None,
                "rules": asdict(rules),
            }
            for name, rules in configuration.rules.sensors.items()
        ],
        "interlocks": [
            {"name": name, "signal": interlock_name(name), "met": flag.value}
            for name, flag in configuration.interlocks.items()
        ],
        "other_compensation": None if other is None else other.value,
        "diameter_read": configuration.diameter is not None,
        "others": [
            *([] if configuration.diameter is None else [DIAMETER]),
            *(probe_name(output) for output in configuration.probes),
        ],
    }


def values_of(told: "StatusSnapshot", values: Values, gap_s: float) -> Json:
    """Return noise and raw values of the last minutes, null between two that are far apart."""
    noise = noise_of(values) if values else Noise(None, 0)
    times: list[float] = []
    shown: list[float | None] = []
    if told.received_utc is not None:
        begin_ms = (told.received_utc.timestamp() - told.received_s) * _MS
        for k, (at_s, value) in enumerate(values):
            if k and at_s - values[k - 1][0] > gap_s:
                times.append(round(begin_ms + at_s * _MS) - 1)
                shown.append(None)
            times.append(round(begin_ms + at_s * _MS))
            shown.append(value)
    return {"noise_k": noise.deviation_k, "count": noise.values, "t": times, "y": shown}


@needs(Role.VIEWER, page=True)
async def _page(request: Request) -> Response:
    parts = parts_of(request)
    return render(request, "sensors.html", page="sensors", **facts_of(parts.configuration))


@needs(Role.VIEWER)
async def _values(request: Request) -> Response:
    """Tell noise and the last minutes of every channel and its redundant sensor."""
    parts = parts_of(request)
    rules, feed = parts.configuration.rules, parts.feed
    gap_s = max(GAP_S, GAP_CYCLES * rules.cycle_s)
    values = {
        name: values_of(feed.latest, feed.recent(name), gap_s)
        for name in (*rules.sensors, *map(redundant_name, rules.redundant))
    }
    return answer_json({"least": LEAST_VALUES, "values": values})
