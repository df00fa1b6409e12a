"""Records of cycles for the tests of the historian: plain, and every oddity that fits the types."""

import asyncio
import math
import time
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

from hypothesis import strategies as st

from thermaxis.compensation import (
    Answer,
    AnswerCode,
    CycleOutput,
    Outcome,
    Quality,
    Reason,
    Request,
    RequestKind,
    SampleQuality,
    SupervisorState,
)
from thermaxis.runtime import Applied, CycleRecord, EventRecord, SourceSample
from thermaxis.runtime.history import HistorianSettings, SqlHistorian

DEFAULTS = HistorianSettings()
BEGIN = datetime(2026, 11, 3, 6, 0, 0, tzinfo=UTC)
OUTPUTS = ("Z_um", "X_um")
CHANNELS = ("T_spindle_C", "T_table_C")
PARTS = (("spindle", "table"), ("spindle",))


def temperature_c(number: int) -> float:
    """Return what the spindle's sensor shows in a cycle: it warms, in tenths of a kelvin."""
    return round(20.0 + 8.0 * (1.0 - math.exp(-number / 900.0)), 1)


def cycle_record(
    number: int,
    *,
    cycle_s: float = 1.0,
    begin: datetime = BEGIN,
    utc: datetime | None = None,
    state: SupervisorState = SupervisorState.ACTIVE,
    good: bool = True,
) -> CycleRecord:
    """Return the record of one cycle; it follows from its number."""
    when = begin + timedelta(seconds=number * cycle_s) if utc is None else utc
    spindle_c = temperature_c(number)
    table_c = 20.0 + 0.1 * (number % 7)
    z_um, x_um = 3.25 * (spindle_c - 20.0), -0.5 * (table_c - 20.0)
    stamped = when - timedelta(milliseconds=20)
    samples = {
        "T_spindle_C": SourceSample(
            spindle_c, good, "Good" if good else "BadSensorFailure", 0.02, stamped
        ),
        "T_table_C": SourceSample(table_c, True, "Good", 0.02, stamped),
        "referenced": SourceSample(1.0, True, "Good", 0.02, None),
    }
    output = CycleOutput(
        time_s=1000.0 + number * cycle_s,
        state=state,
        since_s=1000.0,
        reasons=() if state is SupervisorState.ACTIVE else (Reason.INPUT_BAD, Reason.RECOVERING),
        correction_um=(-z_um, -x_um),
        wanted_um=(-z_um, -x_um),
        model_um=(z_um, x_um),
        contribution_um=((z_um - 1.0, 1.0), (x_um,)),
        weight=(1.0, 0.75),
        trim_um=(0.0, 2.0),
        before_um=(-z_um + 0.01, -x_um),
        elapsed_s=cycle_s,
        at_limit=(False, number % 2 == 0),
        values=(spindle_c, table_c),
        qualities=(SampleQuality.GOOD, SampleQuality.REDUNDANT),
        quality=Quality.GOOD,
        outcomes=(Outcome.DIAMETER_HELD,),
        answers=(),
    )
    return CycleRecord(
        number=number,
        utc=when,
        monotonic_s=1000.0 + number * cycle_s,
        samples=samples,
        output=output,
        applied={"Z_um": Applied(-z_um, -z_um, None), "X_um": Applied(-x_um, None, -x_um)},
        lateness_s=0.0005,
        channels=CHANNELS,
        parts=PARTS,
        diameter_mm=1500.0,
    )


def event_record(text: str, *, kind: str = "state", utc: datetime = BEGIN) -> EventRecord:
    """Return an event."""
    return EventRecord(
        utc, kind, "Anna", text, {"from": "Off", "value": 1.5, "on": True, "x": None}
    )


# ---- anything that the types allow --------------------------------------------------------------

floats = st.floats(allow_nan=False)  # NaN has a test of its own: it equals nothing
optional_floats = st.none() | floats
times = st.datetimes(timezones=st.just(UTC)).map(lambda moment: moment.replace(fold=0))
names = st.text(max_size=12)
statuses = st.text(max_size=30).filter(lambda text: "\0" not in text)


def some(values: st.SearchStrategy[object], most: int = 3) -> st.SearchStrategy[tuple[object, ...]]:
    """Return tuples of values."""
    return st.lists(values, max_size=most).map(tuple)


def enumeration(kind: type) -> st.SearchStrategy[object]:
    """Return members of an enumeration."""
    return st.sampled_from(list(kind))


samples = st.builds(
    SourceSample, optional_floats, st.booleans(), statuses, optional_floats, st.none() | times
)
requests = st.builds(
    Request,
    kind=enumeration(RequestKind),
    who=names,
    output=names,
    value=optional_floats,
    duration_s=optional_floats,
    text=names,
    identity=st.integers(),
)
answers = st.builds(
    Answer,
    requests,
    st.booleans(),
    enumeration(AnswerCode),
    st.dictionaries(names, st.floats(allow_nan=False) | names | some(names), max_size=2),
)
outputs = st.builds(
    CycleOutput,
    time_s=floats,
    state=enumeration(SupervisorState),
    since_s=floats,
    reasons=some(enumeration(Reason)),
    correction_um=some(floats),
    wanted_um=some(floats),
    model_um=some(floats),
    contribution_um=some(some(floats)),
    weight=some(floats),
    trim_um=some(floats),
    before_um=some(floats),
    elapsed_s=floats,
    at_limit=some(st.booleans()),
    values=some(optional_floats),
    qualities=some(enumeration(SampleQuality)),
    quality=enumeration(Quality),
    outcomes=some(enumeration(Outcome)),
    answers=some(answers, 2),
)
cycle_records: st.SearchStrategy[CycleRecord] = st.builds(
    CycleRecord,
    number=st.integers(-(2**63), 2**63 - 1),
    utc=times,
    monotonic_s=floats,
    samples=st.dictionaries(names, samples, max_size=4),
    output=outputs,
    applied=st.dictionaries(
        names, st.builds(Applied, optional_floats, optional_floats, optional_floats), max_size=3
    ),
    lateness_s=floats,
    channels=some(names),
    parts=some(some(names)),
    diameter_mm=optional_floats,
)


def url_of(path: Path) -> str:
    """Return the URL of a file of SQLite."""
    return f"sqlite:///{path}"


class CountingClock:
    """A clock whose time of day is set by the test."""

    def __init__(self, utc: datetime = BEGIN) -> None:
        self.now = utc

    def monotonic_s(self) -> float:
        """Return zero: the historian waits in real time."""
        return 0.0

    def utc(self) -> datetime:
        """Return the time of day."""
        return self.now

    async def sleep_until(self, monotonic_s: float) -> None:
        """Return at once."""


def threadless(
    path: Path, settings: HistorianSettings = DEFAULTS, outputs: Sequence[str] = OUTPUTS
) -> SqlHistorian:
    """Return a historian that stores when it is told to, and closes hours itself."""
    one = SqlHistorian(
        replace(settings, url=settings.url or url_of(path)), CountingClock(), beside=False
    )
    one._columns.outputs = tuple(outputs)
    return one


async def drained(one: SqlHistorian, most_s: float) -> bool:
    """Wait until everything is stored; return whether it is."""
    end_s = time.monotonic() + most_s
    while one.status.waiting or one._backlog.unstated.number:
        if time.monotonic() > end_s:
            return False
        await asyncio.to_thread(time.sleep, 0.01)
    return True


def write_history(
    path: Path,
    records: Sequence[CycleRecord] = (),
    events: Sequence[EventRecord] = (),
    *,
    outputs: Sequence[str] = OUTPUTS,
    settings: HistorianSettings = DEFAULTS,
) -> None:
    """Write records and events as one run of the program leaves them."""
    one = threadless(path, settings, outputs)
    for record in records:
        one.record(record)
    for event in events:
        one.event(event)
    assert one.attempt()
    one.attempt()
    assert one.status == (True, 0, 0, None)
    one.disconnect()
