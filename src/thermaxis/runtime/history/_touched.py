"""What a history tells of touches: minutes, with the displacement without correction."""

import polars as pl

from thermaxis.compensation import CompensationModel, TouchOutcome
from thermaxis.errors import DataError
from thermaxis.runtime._ports import DATUM, probe_name
from thermaxis.runtime.history._columns import TIME, input_column, output_column
from thermaxis.runtime.history._parts import MINUTE
from thermaxis.thermal import ThermalLog

BELIEVED = (TouchOutcome.BELIEVED.value, TouchOutcome.CONFIRMED.value)


def touched_log(cycles: pl.LazyFrame, model: CompensationModel, where: str) -> ThermalLog:
    """Return the minutes of recorded cycles as `relearn` takes them.

    Parameters
    ----------
    cycles : polars.LazyFrame
        Cycles with their columns, of a history or a lake.
    model : CompensationModel
        Its channels are wanted, as the model was given them, and its outputs where they were
        touched.
    where : str
        Name of the log.

    Returns
    -------
    ThermalLog
        Means over minutes. A touch shows the displacement plus the correction that acted at its
        time, by the machine's own word where that is recorded: the correction is taken away.
        Touches that were not believed are left out; a probe that is always there always counts.
        `datum` is 1 where one was set anew.

    Raises
    ------
    DataError
        If a channel was never recorded, or no cycle.
    """
    known = set(cycles.collect_schema().names())
    channels: dict[str, str] = {}
    for name in model.channels:
        columns = [c for c in (output_column(name, "used"), input_column(name)) if c in known]
        if not columns:
            raise DataError("no_matching_column", known=(name,), file=where)
        channels[name] = columns[0]
    minute = pl.col(TIME).dt.truncate("1m").alias(MINUTE)
    wanted = [pl.col(c).mean().alias(n) for n, c in channels.items()]
    told = [c for c in (touch_column(output.name) for output in model.outputs) if c in known]
    if told:
        wanted.append(pl.any_horizontal(pl.col(c) == DATUM for c in told).any().alias(DATUM))
    found = cycles.group_by(minute).agg(wanted).sort(MINUTE).collect()
    if not found.height:
        raise DataError("history_empty", file=where)
    for output in model.outputs:
        probe = input_column(probe_name(output.name))
        if probe in known:
            free = _free(cycles, output.name, probe, known)
            free = free.join_asof(found.select(MINUTE), left_on=TIME, right_on=MINUTE)
            free = free.group_by(MINUTE).agg(pl.mean(probe).alias(output.name))
            found = found.join(free, on=MINUTE, how="left", maintain_order="left")
    columns = {
        name: found[name].cast(pl.Float64).fill_null(float("nan")).to_numpy()
        for name in found.columns
        if name != MINUTE
    }
    time_s = found[MINUTE].dt.epoch("us").to_numpy() / 1e6
    return ThermalLog.from_columns(columns, time_s=time_s, name=where)


def _free(cycles: pl.LazyFrame, output: str, probe: str, known: set[str]) -> pl.DataFrame:
    """Return what a probe has shown without the correction that acted, by the time of the touch."""
    touch, age = touch_column(output), _text_column(probe, "age", "_s")
    shown = cycles.filter(pl.col(probe).is_not_null())
    if touch in known:
        shown = shown.filter(pl.col(touch).is_null() | pl.col(touch).is_in(BELIEVED))
    age_s = pl.col(age).fill_null(0.0) if age in known else pl.lit(0.0)
    at = pl.col(TIME) - pl.duration(microseconds=(1e6 * age_s).round().cast(pl.Int64))
    quantities = (output_column(output, q) for q in ("effective", "accepted", "correction"))
    acting = pl.coalesce([q for q in quantities if q in known]).alias("acting")
    both = [
        frame.collect().sort(TIME)
        for frame in (shown.select(at.alias(TIME), probe), cycles.select(TIME, acting))
    ]
    joined = both[0].join_asof(both[1], on=TIME)
    return joined.select(TIME, pl.col(probe) - pl.col("acting"))


def touch_column(output: str) -> str:
    """Return the column of what became of the touches of an output."""
    return _text_column(output, "touch")


def _text_column(name: str, quantity: str, end: str = "") -> str:
    """Return a column that has not the unit of its name: ``Z_touch``, ``probe_Z_age_s``."""
    return output_column(name, quantity).rpartition(f"_{quantity}")[0] + f"_{quantity}{end}"
