"""A program that only records: the tests end it in the middle of its work.

``python -m tests.system.history_writer URL RATE COUNT [LARGEST_FILE]`` records COUNT cycles at so
many in a second and says the number and the monotonic time of each after it was taken. With a
largest file [byte] every file that it writes is bounded, as on a full disk, until a line comes on
standard input; then it records as many cycles again, and ends.
"""

import asyncio
import resource
import sys
import time

from tests.unit.runtime.history_records import OUTPUTS, cycle_record
from thermaxis.runtime import CycleRecord, SystemClock
from thermaxis.runtime.history import HistorianSettings, SqlHistorian


def recorded(number: int) -> CycleRecord:
    """Return a cycle; an hour has 120 of them, so that hours end while records come."""
    return cycle_record(number, cycle_s=30.0)


async def record(historian: SqlHistorian, numbers: range, rate: float) -> None:
    begin_s = time.monotonic()
    for k, number in enumerate(numbers):
        await asyncio.sleep(max(0.0, begin_s + k / rate - time.monotonic()))
        historian.record(recorded(number))
        print(number, time.monotonic(), flush=True)


async def main(url: str, rate: float, count: int, largest: int | None) -> None:
    # Small batches, where many records come, empty the log into the database every few seconds.
    batch_s = HistorianSettings().batch_s if rate < 500.0 else 0.02
    settings = HistorianSettings(url=url, retry_s=0.2, batch_s=batch_s)
    historian = SqlHistorian(settings, SystemClock())
    whole = resource.getrlimit(resource.RLIMIT_FSIZE)
    if largest is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (largest, whole[1]))
    await historian.open(OUTPUTS)
    await record(historian, range(count), rate)
    if largest is not None:
        await asyncio.sleep(1.0)
        print("status", historian.status, flush=True)
        await asyncio.to_thread(sys.stdin.readline)
        resource.setrlimit(resource.RLIMIT_FSIZE, whole)
        await record(historian, range(count, 2 * count), rate)
    await historian.close(10.0)
    print("status", historian.status, flush=True)


if __name__ == "__main__":
    words = sys.argv[1:]
    limit = int(words[3]) if len(words) > 3 else None
    asyncio.run(main(words[0], float(words[1]), int(words[2]), limit))
