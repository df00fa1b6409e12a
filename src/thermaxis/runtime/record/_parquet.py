"""Complete logs of a recording as Parquet beside them: an eighth of the size, read at once."""

from collections.abc import Callable, Sequence
from pathlib import Path

from thermaxis.codes import Message
from thermaxis.runtime.host import whole_file
from thermaxis.runtime.record._files import SOURCES_FOLDER

_TIME_FORMAT = "%Y-%m-%dT%H:%M:%S%.3fZ"


def write_parquet(log: Path) -> list[Path]:
    """Write a log, and its file of sources, as Parquet; the CSV files stay."""
    return [
        _write(path, numbers=numbers)
        for path, numbers in ((log, True), (log.parent / SOURCES_FOLDER / log.name, False))
    ]


def _write(path: Path, *, numbers: bool) -> Path:
    import polars as pl  # noqa: PLC0415 - takes a tenth of a second, and most write no Parquet

    content = path.read_bytes()
    frame = pl.read_csv(content, comment_prefix="#", infer_schema=False)
    values = pl.exclude("time")
    frame = frame.with_columns(
        pl.col("time")
        .str.to_datetime(_TIME_FORMAT, time_unit="ms", strict=True)
        .dt.replace_time_zone("UTC"),
        values.cast(pl.Float64()) if numbers else values,
    )
    if not numbers:
        frame = frame.with_columns(
            pl.col("^.* source_time$")
            .str.to_datetime(_TIME_FORMAT, time_unit="ms", strict=True)
            .dt.replace_time_zone("UTC")
        )
    target = path.with_suffix(".parquet")
    for left in target.parent.glob(f".{target.name}.*.new"):  # of a recording that was killed
        left.unlink(missing_ok=True)
    with whole_file(target) as stream:
        frame.write_parquet(stream)
    return target


def parquet_writer(tell: Callable[[Message], None]) -> Callable[[Sequence[Path]], None]:
    """Return what writes complete logs as Parquet, and tells where it could not."""
    waiting: list[Path] = []

    def write_all(logs: Sequence[Path]) -> None:
        waiting.extend(logs)
        for log in list(waiting):
            try:
                write_parquet(log)
            except FileNotFoundError:
                waiting.remove(log)  # somebody has moved it away
            except OSError as error:
                values = {"file": log.name, "cause": error.strerror or str(error)}
                tell(Message("recording-parquet_unwritten", values))
            else:
                waiting.remove(log)

    return write_all
