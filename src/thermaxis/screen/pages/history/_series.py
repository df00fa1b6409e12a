"""Spans, steps and series of the history as pages draw them; nothing is asked here."""

import math
import re
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

from starlette.requests import HTTPConnection

from thermaxis.web import RefusedError

if TYPE_CHECKING:
    from thermaxis.runtime.history import HistoryReader, Trend

Json = dict[str, Any]
"""An object of JSON."""

LONGEST: Final = timedelta(days=3660)
"""Longest span of one question."""
_SINGLE_CYCLES: Final = 600
_DIGITS: Final = 7
_BAD_REQUEST: Final = 400
_UNIT_OF_NAME: Final = re.compile(r"_(um|mm|C|c|K|k|rpm|s|V|A|kW|W|Nm|bar|pct)$")
_SHOWN_UNITS: Final = {"um": "µm", "C": "°C", "c": "°C", "k": "K", "rpm": "1/min", "pct": "%"}
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


# ---- times --------------------------------------------------------------------------------------


def to_ms(moment: datetime) -> int:
    """Return a time as scripts count it, since 1970 in UTC. [ms]"""
    return (moment - _EPOCH) // timedelta(milliseconds=1)


def moment_of(text: str | None) -> datetime | None:
    """Return the time that a page states."""
    try:
        found = datetime.fromisoformat(text or "")
    except ValueError:
        return None
    if found.tzinfo is None or not 1970 < found.year < 2200:
        return None
    return found.astimezone(UTC)


def span_of(connection: HTTPConnection) -> tuple[datetime, datetime]:
    """Return the span that a request states as ``first`` and ``last``; refuse what is none."""
    first = moment_of(connection.query_params.get("first"))
    last = moment_of(connection.query_params.get("last"))
    if first is None or last is None or not timedelta(0) < last - first <= LONGEST:
        raise RefusedError(_BAD_REQUEST, "history-no_span")
    return first, last


# ---- series -------------------------------------------------------------------------------------


def unit_of(name: str) -> str:
    """Return the unit of a series as people write it."""
    found = _UNIT_OF_NAME.search(name)
    return _SHOWN_UNITS.get(found[1], found[1]) if found else ""


def points_within(first: datetime, last: datetime, cycle_s: float, points: int) -> int:
    """Return into how many steps a span is cut.

    No step is shorter than two cycles: one that has no value means that none was recorded. A
    span of few cycles is cut so finely that each has a step of its own.
    """
    cycles = (last - first) / timedelta(seconds=cycle_s)
    if cycles <= min(points, _SINGLE_CYCLES):
        return max(1, (last - first) // timedelta(milliseconds=1))
    return max(1, min(points, int(cycles / 2.0)))


def line_of(trend: "Trend", last: datetime, cycle_s: float) -> Json:
    """Return a trend as a page draws it: times in the middle of the steps, null in every gap."""
    found: Json = {
        "unit": unit_of(trend.name),
        "step_s": trend.step_us / 1e6,
        "t": [],
        "mean": [],
        "lowest": [],
        "highest": [],
    }
    longest_us = _longest_us(trend, cycle_s)
    last_ms, before_us = to_ms(last), math.inf
    rows = zip(trend.time_us, trend.mean, trend.lowest, trend.highest, strict=True)
    for time_us, *numbers in rows:
        if time_us - before_us > longest_us:
            gap_ms = int(before_us + time_us + trend.step_us) // 2000
            _append(found, gap_ms, (None, None, None))
        before_us = time_us
        _append(found, min((time_us + trend.step_us // 2) // 1000, last_ms), numbers)
    return found


def _longest_us(trend: "Trend", cycle_s: float) -> float:
    """Return the time between two values from which on there is a gap. [µs]"""
    times_us = trend.time_us
    apart = sorted(after - before for before, after in pairwise(times_us))
    usual_us = apart[len(apart) // 2] if apart else 0
    recorded_us = max(cycle_s * 1e6, usual_us if usual_us > trend.step_us else 0)
    return trend.step_us + 1.5 * recorded_us


def _append(found: Json, time_ms: int, numbers: Sequence[float | None]) -> None:
    found["t"].append(time_ms)
    for name, number in zip(("mean", "lowest", "highest"), numbers, strict=True):
        found[name].append(shortened(number))


def shortened(number: float | None) -> float | None:
    """Return a number with the digits that a chart or a table can show; None if it is none."""
    if number is None or not math.isfinite(number):
        return None
    return float(f"{number:.{_DIGITS}g}")


def lines_of(
    reader: "HistoryReader",
    names: Sequence[str],
    span: tuple[datetime, datetime],
    cycle_s: float,
    points: int,
) -> Json:
    """Return several trends by name, those of them that the history has."""
    known = reader.series()
    wanted = [name for name in dict.fromkeys(names) if name in known]
    if not wanted:
        return {}
    found = reader.trend(wanted, *span, points=points_within(*span, cycle_s, points))
    return {name: line_of(found[name], span[1], cycle_s) for name in wanted}
