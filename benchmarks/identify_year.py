"""What `thermaxis identify` takes for a year of minutes: memory, and time beyond reading.

    python benchmarks/identify_year.py             touched each half hour, and measured each minute
    python benchmarks/identify_year.py 30          so many days

The machine has two sources of heat (lags of 2,400 and 9,000 s) and a hall; sensors fail now and
then and show tenths of a kelvin. The command runs in a process of its own; processor time counts
from when the log is read, without imports.
"""

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

DAYS = 365
LIMIT_S, LIMIT_MB = 2.0, 500.0
EVERY = (30, 1)
INPUTS = ("spindle=T_spindle_C-T_column_C", "table=T_table_C-T_column_C")


def lagged(u: np.ndarray, lag_s: float) -> np.ndarray:
    """Return an input of minutes behind a first-order lag."""
    from scipy.signal import lfilter

    alpha = -np.expm1(-60.0 / lag_s)
    return np.asarray(lfilter([alpha], [1.0, alpha - 1.0], u))


def write_year(path: Path, days: int, every: int) -> None:
    """Write a log of minutes, touched in one of so many rows."""
    import polars as pl

    rng, rows = np.random.default_rng(1), days * 1440
    hall = 22.0 + 2.0 * np.sin(2.0 * np.pi * np.arange(rows) / 1440.0)
    load = np.repeat(rng.choice([0.0, 0.3, 0.6, 1.0], rows // 60 + 1, p=(0.4, 0.2, 0.2, 0.2)), 60)
    rises = {"spindle": 12.0 * lagged(load, 1200.0), "table": 4.0 * lagged(load[::-1], 5400.0)}
    rises = {name: rise[:rows] for name, rise in rises.items()}
    z = 1.5 * rises["spindle"] + 2.0 * lagged(rises["spindle"], 2400.0)
    z += rng.normal(-2.5 * lagged(rises["table"], 9000.0), 0.5)
    z[np.arange(rows) % every > 0] = np.nan
    columns = {"T_column_C": hall, **{f"T_{n}_C": hall + r for n, r in rises.items()}}
    columns = {name: np.round(rng.normal(v, 0.03), 1) for name, v in columns.items()}
    for column in columns.values():
        column[rng.integers(0, rows, rows // 1000)] = np.nan
    columns["T_table_C"][1000:1400] = np.nan
    times = (np.arange(rows, dtype=np.int64) * 60 + 1_767_225_600) * 1_000_000
    frame = pl.DataFrame({"time": times, **columns, "Z_um": z}, nan_to_null=True)
    frame.with_columns(pl.col("time").cast(pl.Datetime("us", "UTC"))).write_parquet(path)


def identify(path: Path) -> int:
    """Identify; print time beyond reading and the peak of the memory."""
    from thermaxis.cli import main
    from thermaxis.cli.thermal import identify as command
    from thermaxis.thermal import identify as _needed  # noqa: F401  loads what the command needs

    read, ends = command.read_logs, [0.0]

    def reading(*arguments: object, **options: object) -> object:
        found = read(*arguments, **options)
        ends[0] = time.process_time()
        return found

    command.read_logs = reading
    inputs = [word for one in INPUTS for word in ("--input", one)]
    code = main(["identify", str(path), "--output", "Z_um", *inputs, "--json", "-"])
    peak_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    found = {"s": time.process_time() - ends[0], "mb": peak_kb * 1024 / 1e6}
    sys.stderr.write(json.dumps(found))
    return code


def main() -> int:
    """Make the logs, identify each in a child, print, return 1 if the promise is not kept."""
    if len(sys.argv) == 2 and sys.argv[1].endswith(".parquet"):
        return identify(Path(sys.argv[1]))
    days, kept = int(sys.argv[1]) if len(sys.argv) > 1 else DAYS, True
    print(f"{days} days of minutes; asked: {LIMIT_S:g} s beyond reading, {LIMIT_MB:g} MB")
    for every in EVERY:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "year.parquet"
            write_year(path, days, every)
            words = [sys.executable, __file__, str(path)]
            child = subprocess.run(words, check=True, capture_output=True, text=True)
        found = json.loads(child.stderr)
        print(f"measured each {every:2} min: {found['s']:.2f} s, {found['mb']:.0f} MB")
        kept = kept and found["s"] <= LIMIT_S and found["mb"] <= LIMIT_MB
    return 0 if kept else 1


if __name__ == "__main__":
    raise SystemExit(main())
