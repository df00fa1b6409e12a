"""What the days of one machine say of its sensors and its model: minutes in, a result out."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import UTC, date, datetime
from enum import StrEnum
from typing import Final, final

import numpy as np
import polars as pl
from numpy.typing import NDArray

from thermaxis import __version__
from thermaxis.codes import Message, Place, message_as_json, remark
from thermaxis.compensation import CompensationModel, Provenance, TrainingLog
from thermaxis.errors import DataError
from thermaxis.files import model_sha256
from thermaxis.fleet._signs import Sign, TouchedDay, signs_of
from thermaxis.runtime import DATUM, probe_name
from thermaxis.runtime.history import DATUM_SET, MINUTE, input_column, output_column
from thermaxis.thermal import (
    MeasuredOutput,
    ThermalLog,
    TouchPlan,
    VerifiedOutput,
    check_log,
    relearn,
    verify,
    without_faults,
)

TOUCHED_S: Final = 86_400.0
"""The compensation is run with touches from so long before the day on. [s]"""
TOUCHED_EVERY_S: Final = 1800.0
"""A displacement that is measured in most minutes counts as touched so often. [s]"""


@final
class NightOutcome(StrEnum):
    """What became of a night."""

    VERIFIED = "verified"
    """The model was compared with what was measured."""
    UNVERIFIED = "unverified"
    """It was not: too little was measured, or a channel is missing. The remarks say why."""
    SET_ASIDE = "set_aside"
    """It failed twice; the remark is its error."""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class OutputNight:
    """One output of the model on the day: thermal displacement, correction taken off, and model."""

    rows: int
    """Minutes in which it was measured. [1]"""
    fit_percent: float | None
    """Fit of the free run, None where the measured displacement is constant. [%]"""
    uncompensated_um: float
    """Peak-to-peak of the measured displacement. [µm]"""
    rmse_um: float
    """Root mean square of what the free run leaves. [µm]"""
    mae_um: float
    """Mean of its magnitude. [µm]"""
    mean_um: float
    """Its mean. [µm]"""
    max_um: float
    """Its largest magnitude. [µm]"""
    touches: int
    """Touches of the day and the one before it. [1]"""
    held_mae_um: float
    """Mean absolute error at the day's measurements, corrected by what the last touch has shown.
    [µm]"""
    offset_mae_um: float
    """The same by the model with the offset that each touch renews. [µm]"""
    within_two_sigma: float | None
    """Share of the innovations within two standard deviations. [1]"""


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class NightResult:
    """What a night has found."""

    machine: str
    """Name of the machine."""
    day: date
    """The day that was looked at."""
    model_sha256: str
    """The model in force."""
    outcome: NightOutcome
    """What became of it."""
    minutes: int = 0
    """Minutes of the day. [1]"""
    sensors: tuple[Message, ...] = ()
    """What is seriously wrong with channels of the model."""
    outputs: Mapping[str, OutputNight] | None = None
    """Every output that was measured on the day, None where the model was not verified."""
    remarks: tuple[Message, ...] = ()
    """What the reader must know."""
    relearned: tuple[Message, ...] = ()
    """Why another model is proposed, or none; their place is the output."""
    proposal: CompensationModel | None = None
    """The model that is proposed in place of the one in force; None where it stays."""
    signs: tuple[Sign, ...] = ()
    """Figures by which causes are told apart when machines are judged."""
    touched: tuple[TouchedDay, ...] = ()
    """The same of outputs with touches, as least squares."""
    last_id: int = 0
    """Id of the last cycle of the day that the lake had; 0 where the night failed. [1]"""


@final
@dataclass(frozen=True, slots=True)
class StoredNight:
    """A night of a machine."""

    machine: str
    """Its name."""
    kind: str
    """Its kind."""
    day: date
    """The day that was looked at."""
    model_sha256: str
    """The model that was in force."""
    version: str
    """Version of the program."""
    result: Mapping[str, object]
    """What it has found, as JSON."""


def night_as_json(result: NightResult) -> dict[str, object]:
    """Return a result as JSON has it, without what names its night."""
    return {
        "outcome": str(result.outcome),
        "minutes": result.minutes,
        "sensor_codes": [message_as_json(one) for one in result.sensors],
        "outputs": {name: asdict(one) for name, one in (result.outputs or {}).items()},
        "remark_codes": [message_as_json(one) for one in result.remarks],
        "relearn_codes": [message_as_json(one) for one in result.relearned],
        "signs": [asdict(one) for one in result.signs],
        "touched": [asdict(one) for one in result.touched],
        "proposal_sha256": None if result.proposal is None else model_sha256(result.proposal),
    }


def night(
    machine: str,
    model: CompensationModel,
    minutes: Sequence[pl.DataFrame],
    day: date,
    *,
    channels: Mapping[str, str] | None = None,
) -> NightResult | None:
    """Judge the sensors of a machine, its model by what was measured on a day, and propose another.

    The thermal displacement is what the probe shows less the correction in force. The model runs
    free from the first of the days on; only the last one counts.

    Parameters
    ----------
    machine : str
        Its name.
    model : CompensationModel
        The model in force.
    minutes : sequence of polars.DataFrame
        Minutes of a history in the order of recording: those of the day and of days before it.
    day : date
        The day, UTC.
    channels : mapping of str to str, optional
        Column by channel or output of the model. Default: names of their own; for an output that
        of its probe.

    Returns
    -------
    NightResult or None
        What was found; None where there is no minute of the day.
    """
    begin = datetime(day.year, day.month, day.day, tzinfo=UTC)
    table, remarks = _joined(minutes)
    day_rows = table.height - table.filter(pl.col(MINUTE) < begin).height
    if not day_rows:
        return None
    log = _log_of(table, model, channels or {}, machine)
    found = check_log(log.select(list(model.channels)))
    judged = NightResult(
        machine=machine,
        day=day,
        model_sha256=model_sha256(model),
        outcome=NightOutcome.UNVERIFIED,
        minutes=day_rows,
        sensors=tuple(one.message for one in found if one.serious),
        remarks=tuple(remarks),
    )
    measured = [o.name for o in model.outputs if _is_measured(log, o.name, day_rows)]
    log = without_faults(log)
    if DATUM_SET in table.columns:
        anew = (table[DATUM_SET].fill_null(0) > 0).cast(pl.Float64).to_numpy()
        log = replace(log, columns={**log.columns, DATUM: anew}, units={**log.units, DATUM: ""})
    touched = {name: _touched_rows(log, name) for name in measured}
    signs, days = signs_of(log, model, touched, day_rows)
    judged = replace(judged, signs=signs, touched=days)
    try:
        outputs = {name: _output(model, log, name, day_rows) for name in measured}
        if not outputs:
            return replace(judged, remarks=(*remarks, remark("nothing_measured")))
        judged = replace(judged, outcome=NightOutcome.VERIFIED, outputs=outputs)
        return _relearned(judged, model, log)
    except DataError as error:
        return replace(judged, remarks=(*remarks, error.message))


def _relearned(judged: NightResult, model: CompensationModel, log: ThermalLog) -> NightResult:
    """Learn from the days before, and propose what the touches of the day show to be better.

    Not of doubtful sensors, which the log without faults does not show any more.
    """
    found = relearn(log, model)
    doubtful = dict.fromkeys(one.place.channel for one in judged.sensors)
    first = Message("relearn-sensors_first", {"names": ", ".join(doubtful)})
    why = tuple(
        replace(o.why if o.taken is None or not doubtful else first, place=Place(channel=o.name))
        for o in found.outputs
    )
    if found.model is None or doubtful:
        return replace(judged, relearned=why)
    origin = Provenance(
        method=f"relearnt from {judged.model_sha256}",
        program=f"thermaxis {__version__}",
        date=judged.day.isoformat(),
        logs=(*model.provenance.logs, TrainingLog(judged.machine[-200:], "", log.rows)),
    )
    return replace(judged, relearned=why, proposal=replace(found.model, provenance=origin))


def _joined(minutes: Sequence[pl.DataFrame]) -> tuple[pl.DataFrame, list[Message]]:
    """Return each minute once, in order: of one that came twice the means by their counts."""
    if not minutes:
        return pl.DataFrame(schema={MINUTE: pl.Datetime("us", "UTC")}), []
    table = pl.concat(minutes, how="diagonal_relaxed")
    if bool(table[MINUTE].is_sorted()) and table[MINUTE].n_unique() == table.height:
        return table, []
    names = [name.removesuffix("_mean") for name in table.columns if name.endswith("_mean")]
    joined = [pl.col(name).sum() for name in (DATUM_SET,) if name in table.columns]
    for name in names:
        count = pl.col(f"{name}_count").cast(pl.Int64)
        joined += [
            ((pl.col(f"{name}_mean") * count).sum() / count.sum()).alias(f"{name}_mean"),
            count.sum(),
        ]
    back = int((table[MINUTE].diff().dt.total_seconds() < 0).sum() or 0)
    said = [remark("clock_went_back", count=back)] if back else []
    return table.group_by(MINUTE).agg(joined).sort(MINUTE), said


def _log_of(
    table: pl.DataFrame, model: CompensationModel, channels: Mapping[str, str], name: str
) -> ThermalLog:
    """Return channels of the model and the displacement without correction of its outputs."""

    def mean(column: str) -> pl.Expr:
        known = f"{column}_mean" in table.columns
        return (pl.col(f"{column}_mean") if known else pl.lit(None)).cast(pl.Float64)

    columns = {channel: mean(channels.get(channel, channel)) for channel in model.channels}
    for output in (output.name for output in model.outputs):
        probe = channels.get(output, input_column(probe_name(output)))
        acting = [mean(output_column(output, q)) for q in ("effective", "accepted", "correction")]
        columns[output] = mean(probe) - pl.coalesce(*acting, 0.0)
    found = table.select(
        (pl.col(MINUTE) - pl.col(MINUTE).first()).dt.total_seconds().alias("time_s"),
        *(value.fill_null(np.nan).alias(column) for column, value in columns.items()),
    )
    values = {column: found[column].to_numpy() for column in found.columns}
    return ThermalLog.from_columns(values, start=table[MINUTE][0], name=name)


def _is_measured(log: ThermalLog, output: str, rows: int) -> bool:
    """Return whether a day tells of the model: its first value is where the displacement begins."""
    return int(np.count_nonzero(~np.isnan(log.columns[output][-rows:]))) > 1


def _is_often(log: ThermalLog, output: str) -> bool:
    return bool(np.mean(~np.isnan(log.columns[output])) > 0.5)


def _touched_rows(log: ThermalLog, output: str) -> NDArray[np.intp]:
    """Return the rows of the touches; of what is measured in most minutes as often as touched."""
    rows = np.flatnonzero(~np.isnan(log.columns[output]))
    if not _is_often(log, output):
        return rows
    return rows[np.unique(log.time_s[rows] // TOUCHED_EVERY_S, return_index=True)[1]]


def _output(model: CompensationModel, log: ThermalLog, name: str, rows: int) -> OutputNight:
    often = _is_often(log, name)
    plan = TouchPlan(every_s=TOUCHED_EVERY_S) if often else TouchPlan(channels={name: name})
    first_s = float(log.time_s[-rows]) - TOUCHED_S
    newest = log.span(int(np.searchsorted(log.time_s, first_s)), log.rows)
    free = _verified(model, log, name, rows, None)
    figures, left_um = free.figures, free.residual_um[free.counted]
    touched = _verified(model, newest, name, rows, plan).touched
    if touched is None:
        raise TypeError("a verification with touches has their figures")
    return OutputNight(
        rows=figures.rows,
        fit_percent=figures.fit_percent,
        uncompensated_um=figures.uncompensated_um,
        rmse_um=figures.rmse_um,
        mae_um=figures.mae_um,
        mean_um=float(np.mean(left_um)),
        max_um=figures.max_um,
        touches=touched.touches,
        held_mae_um=touched.probe_and_hold.mae_um,
        offset_mae_um=touched.with_offset.mae_um,
        within_two_sigma=touched.within_two_sigma,
    )


def _verified(
    model: CompensationModel, log: ThermalLog, name: str, rows: int, touches: TouchPlan | None
) -> VerifiedOutput:
    span, measured = (log.rows - rows, log.rows), [MeasuredOutput(name, name)]
    (found,) = verify(model, [log], measured, rows=span, touches=touches).logs
    return found.outputs[0]
