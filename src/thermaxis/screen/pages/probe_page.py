"""What a probe measures with the compensation, and what it would measure without it.

A displacement and a correction both count positive away from the workpiece, so that the probe
shows the drift plus the offset that acts: without the offset it would show

    uncompensated = probe - effective

with the offset that the machine accepted where it does not say which one acts. While the
compensation is off, the loop reads no offset back, and there is no such number. The two are held
against each other over the time in which the correction acted: how it came from zero to where it
was wanted is no movement of the machine.
"""

from collections.abc import Mapping
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import BaseRoute, Route

from thermaxis.runtime import Role, probe_name
from thermaxis.screen.access import needs, parts_of, render
from thermaxis.screen.pages.history import (
    LENGTHS,
    Json,
    found_in_history,
    line_of,
    points_of,
    points_within,
    shortened,
    span_of,
    to_ms,
)
from thermaxis.web import answer_json, refuse

if TYPE_CHECKING:
    from thermaxis.runtime.history import HistoryReader, Trend
    from thermaxis.screen.access import ScreenParts

MOST_CYCLES: Final = 200_000
"""Cycles up to which each is compared by itself; longer spans by the means of minutes. [1]"""
COMPENSATED, UNCOMPENSATED, MODEL = "compensated", "uncompensated", "model"
_NOT_FOUND = 404
_LARGEST_UM = 1e9
_ARRIVED_UM = 1.0
"""An offset is where it is wanted within a control's whole micrometre."""

Column = NDArray[np.float64]
"""Numbers by time."""


class Compared(NamedTuple):
    """A probe beside the offset and the model, by time."""

    time_us: NDArray[np.int64]
    """Times since 1970. [µs]"""
    compensated_um: Column
    """What the probe measured; NaN where it measured nothing. [µm]"""
    uncompensated_um: Column
    """The same without the offset; NaN also where the offset is not known. [µm]"""
    model_um: Column
    """What the model says of the displacement without an offset. [µm]"""
    acted: NDArray[np.bool_]
    """Whether the compensation was active, and had been where it was wanted since then; not where
    a touch was not believed, as one of a chip tells nothing of the correction."""


def routes(parts: "ScreenParts") -> list[BaseRoute]:
    """Return the routes of the probe's page."""
    del parts
    return [
        Route("/probe", _page, methods=["GET"]),
        Route("/probe/values", _values, methods=["GET"]),
    ]


@needs(Role.VIEWER, page=True)
async def _page(request: Request) -> Response:
    parts = parts_of(request)
    configuration = parts.configuration
    probes = tuple(configuration.probes)
    return render(
        request,
        "probe.html",
        page="probe",
        probes=probes,
        lengths=LENGTHS,
        file=configuration.path.name,
        output=next(iter(configuration.outputs), "Z_um"),
    )


@needs(Role.VIEWER)
async def _values(request: Request) -> Response:
    parts, name = parts_of(request), request.query_params.get("name", "")
    if name not in parts.configuration.probes:
        return refuse(request, _NOT_FOUND, "probe-unknown")
    asked = span_of(request), parts.configuration.rules.cycle_s, points_of(request)
    return answer_json(
        await found_in_history(request, lambda reader: comparison(reader, name, *asked))
    )


# ---- comparison ---------------------------------------------------------------------------------


def comparison(
    reader: "HistoryReader",
    name: str,
    span: tuple[datetime, datetime],
    cycle_s: float,
    points: int,
) -> Json:
    """Compare a probe's displacement with and without the compensation.

    Spans of up to `MOST_CYCLES` cycles are compared cycle by cycle. Longer ones are compared by
    means over whole minutes, of which peak to peak is a little less; where the probe was there in
    a part of a step only, the offset is that of the whole step.
    """
    if (span[1] - span[0]) / timedelta(seconds=cycle_s) <= MOST_CYCLES:
        compared, means_s = by_cycle(reader, name, span), 0.0
        steps = points_within(*span, cycle_s, points)
        step_us = max(1, -(-((span[1] - span[0]) // timedelta(microseconds=1)) // steps))
        first_us = to_ms(span[0]) * 1000
    else:
        compared, step_us = by_minute(reader, name, span, points)
        means_s, first_us = step_us / 1e6, int(compared.time_us[0])
    trends = _trends_of(compared, first_us, step_us)
    return {
        "first": to_ms(span[0]),
        "last": to_ms(span[1]),
        "series": {key: line_of(trend, span[1], cycle_s) for key, trend in trends.items()},
        "figures": figures_of(compared),
        "means_s": means_s,
    }


def figures_of(compared: Compared) -> Json:
    """Return peak to peak with and without the compensation.

    Only times are counted at which the correction acted and both are known, so that the figures
    compare the same.
    """
    both = np.isfinite(compared.compensated_um) & np.isfinite(compared.uncompensated_um)
    both &= compared.acted
    times = compared.time_us[both]
    with_it, without = (
        _range(compared.compensated_um[both]),
        _range(compared.uncompensated_um[both]),
    )
    model = compared.model_um[both]
    ratio = None if with_it is None or not without else with_it / without
    return {
        "values": int(times.size),
        "first": int(times.min()) // 1000 if times.size else None,
        "last": int(times.max()) // 1000 if times.size else None,
        "compensated_um": shortened(with_it),
        "uncompensated_um": shortened(without),
        "model_um": shortened(_range(model[np.isfinite(model)])),
        "ratio": shortened(ratio),
    }


def _range(values: Column) -> float | None:
    return float(values.max() - values.min()) if values.size else None


def by_cycle(reader: "HistoryReader", name: str, span: tuple[datetime, datetime]) -> Compared:
    """Return the comparison of every cycle of a span, in the order of time."""
    from thermaxis.runtime.history import BELIEVED, TIME, touch_column  # noqa: PLC0415 - heavy

    names = _columns(name)
    known = reader.series()
    wanted, touch = [one for one in names if one in known], touch_column(name)
    wanted += [touch] if touch in reader.retried(reader.columns) else []
    cycles = reader.retried(lambda: reader.cycles(*span, wanted).sort(TIME).collect())
    nothing: Column = np.full(cycles.height, np.nan)

    def column(one: str) -> Column:
        values = cycles[one].to_numpy() if one in wanted else nothing
        return np.where(np.abs(values) <= _LARGEST_UM, values, np.nan)

    found = _compared(cycles[TIME].dt.epoch("us").to_numpy(), *map(column, names))
    if touch not in wanted:
        return found
    outcome = cycles[touch]
    believed = (outcome.is_null() | outcome.is_in(BELIEVED)).to_numpy()
    return found._replace(acted=found.acted & believed)


def _columns(name: str) -> tuple[str, ...]:
    """Return the columns that are compared, in the order in which `_compared` takes them."""
    from thermaxis.runtime.history import (  # noqa: PLC0415 - heavy
        ACTIVE,
        input_column,
        output_column,
    )

    of_output = (output_column(name, q) for q in ("effective", "accepted", "model", "wanted"))
    return input_column(probe_name(name)), *of_output, ACTIVE


def _compared(
    time_us: NDArray[np.int64],
    probe: Column,
    effective: Column,
    accepted: Column,
    model: Column,
    wanted: Column,
    active: Column,
) -> Compared:
    """Put the offset where it belongs: the one that acts, or else the one that was accepted."""
    offset = np.where(np.isfinite(effective), effective, accepted)
    at = np.arange(time_us.size)
    on = active == 1.0
    arrived = on & (np.abs(offset - wanted) <= _ARRIVED_UM)
    arrived_at, off_at = (
        np.maximum.accumulate(np.where(there, at, -1)) for there in (arrived, ~on)
    )
    return Compared(time_us, probe, probe - offset, model, arrived_at > off_at)


def by_minute(
    reader: "HistoryReader", name: str, span: tuple[datetime, datetime], points: int
) -> tuple[Compared, int]:
    """Return the comparison of means over whole minutes."""
    names = _columns(name)
    known = reader.series()
    trends = reader.trend([one for one in names if one in known], *span, points=points)
    times = sorted({time_us for trend in trends.values() for time_us in trend.time_us})
    times = times or [to_ms(span[0]) * 1000]
    place = {time_us: k for k, time_us in enumerate(times)}
    columns = {one: np.full(len(times), np.nan) for one in names}
    for one, trend in trends.items():
        columns[one][[place[time_us] for time_us in trend.time_us]] = trend.mean
    step_us = max((trend.step_us for trend in trends.values()), default=60_000_000)
    return _compared(np.array(times, np.int64), *(columns[one] for one in names)), step_us


def _trends_of(compared: Compared, first_us: int, step_us: int) -> Mapping[str, "Trend"]:
    """Return lines of the comparison, in steps."""
    columns = zip((COMPENSATED, UNCOMPENSATED, MODEL), compared[1:4], strict=True)
    return {key: _trend_of(compared.time_us, column, first_us, step_us) for key, column in columns}


def _trend_of(time_us: NDArray[np.int64], values: Column, first_us: int, step_us: int) -> "Trend":
    from thermaxis.runtime.history import Trend  # noqa: PLC0415 - heavy

    there = np.isfinite(values)
    step, kept = (time_us[there] - first_us) // step_us, values[there]
    numbers, begins, counts = np.unique(step, return_index=True, return_counts=True)
    if not numbers.size:
        return Trend("", step_us, (), (), (), ())

    def told(column: NDArray[Any]) -> tuple[Any, ...]:
        return tuple(column.tolist())

    return Trend(
        "",
        step_us,
        told(first_us + numbers * step_us),
        told(np.minimum.reduceat(kept, begins)),
        told(np.add.reduceat(kept, begins) / counts),
        told(np.maximum.reduceat(kept, begins)),
    )
