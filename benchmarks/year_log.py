"""A year of 1 Hz with 8 channels, Parquet: read and reduced to means over a minute.

The file (31.5 million rows) is made in a temporary directory, a month at a time; it is read in a
process of its own, whose time and peak memory count.
"""

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROWS, CHANNELS, CHUNK = 31_536_000, 8, 2_628_000
SAMPLE_TIME_S = 60.0
LIMIT_S, LIMIT_GIB = 60.0, 4.0


def write_year(path: Path) -> None:
    """Write the year in twelve parts, with a value missing now and then and a lost hour."""
    import polars as pl

    rng = np.random.default_rng(2026)
    parts: list[Path] = []
    for part, first in enumerate(range(0, ROWS, CHUNK)):
        second = np.arange(first, min(first + CHUNK, ROWS), dtype=np.int64)
        second = second[(second < 7_000_000) | (second >= 7_003_600)]
        columns: dict[str, object] = {"time": (second + 1_767_225_600) * 1_000_000}
        for channel in range(CHANNELS):
            day = 2.0 * np.pi * second / 86_400.0
            values = 22.0 + channel + 2.0 * np.sin(day - 0.3 * channel)
            values = np.round(values + rng.normal(0.0, 0.02, second.size), 2)
            values[rng.integers(0, second.size, second.size // 1000)] = np.nan
            columns[f"T{channel + 1}_C"] = values
        frame = pl.DataFrame(columns).with_columns(pl.col("time").cast(pl.Datetime("us", "UTC")))
        parts.append(path.with_name(f"part{part}.parquet"))
        frame.write_parquet(parts[-1])
    pl.scan_parquet(parts).sink_parquet(path)
    for part_path in parts:
        part_path.unlink()


def read_year(path: Path) -> int:
    """Read and reduce the file; print what it took and the means of the first channel."""
    from thermaxis.files import read_thermal_log

    since = time.perf_counter()
    log = read_thermal_log(path, sample_time_s=SAMPLE_TIME_S)
    seconds = time.perf_counter() - since
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024.0 / 2.0**30
    first = log.columns["T1_C"]
    truth = 22.0 + 2.0 * np.sin(2.0 * np.pi * (log.time_s + 29.5) / 86_400.0)
    error = float(np.nanmax(np.abs(first - truth)))
    print(json.dumps({"s": seconds, "gib": peak, "rows": log.rows, "error_k": error}))
    return 0


def main() -> int:
    """Make the file, read it in a child, print, and return 1 if the promise is not kept."""
    if len(sys.argv) > 1:
        return read_year(Path(sys.argv[1]))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "year.parquet"
        write_year(path)
        print(f"{ROWS} rows of {CHANNELS} channels, {path.stat().st_size / 1e6:.0f} MB")
        child = subprocess.run(
            [sys.executable, __file__, str(path)], check=True, capture_output=True, text=True
        )
    found = json.loads(child.stdout)
    print(f"read and reduced: {found['s']:.1f} s (at most {LIMIT_S:g} s)")
    print(f"peak memory:      {found['gib']:.2f} GiB (at most {LIMIT_GIB:g} GiB)")
    print(f"{found['rows']} means, largest error {found['error_k']:.4f} K")
    kept = found["s"] < LIMIT_S and found["gib"] < LIMIT_GIB and found["error_k"] < 0.05
    return 0 if kept else 1


if __name__ == "__main__":
    raise SystemExit(main())
