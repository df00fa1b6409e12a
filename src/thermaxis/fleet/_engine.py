"""Many nights at once: `concurrent.futures.Executor` is the engine, in this process or Dask's.

Nothing durable is in an engine. Results come as they are ready; whoever ends them ends nothing that
was stored.
"""

import faulthandler
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from itertools import islice
from typing import Any, Final, NamedTuple, TypeVar

from thermaxis.errors import DataError

TRIES: Final = 2
"""A job that has failed so often is set aside. [1]"""
_LONGEST_S: Final = 600.0
_PATIENCE_S: Final = 1800.0
_AT_ONCE: Final = 4
_MEMORY: Final = "1GB"
_J = TypeVar("_J")
_R = TypeVar("_R")


class Engine(NamedTuple):
    """What does the work."""

    executor: Executor
    """It takes a job."""
    window: int
    """Jobs that it is given at once: it always has the next ones, and never all. [1]"""
    longest_s: float = 0.0
    """A job that takes longer ends its process, and with it fails; 0 for none. [s]"""
    patience_s: float | None = None
    """Where no job ends for so long there is no worker; None for where there is one. [s]"""


def results_of(
    engine: Engine, work: Callable[[_J], _R], jobs: Iterable[_J]
) -> Iterator[tuple[_J, _R | BaseException]]:
    """Yield every job with its result, as they come; with its error where it failed twice.

    It is tried again at the end, alone: what ends its worker takes no other job along twice.

    Raises
    ------
    DataError
        If the engine is lost, or ends no job for long.
    """
    waiting = iter(jobs)
    running: dict[Future[_R], tuple[_J, int]] = {}
    again: deque[tuple[_J, int]] = deque()

    def submit(job: _J, tried: int) -> None:
        future = engine.executor.submit(_in_time, engine.longest_s, work, job)
        running[future] = job, tried

    try:
        while True:
            for job in islice(waiting, engine.window - len(running)):
                submit(job, 1)
            if not running:
                if not again:
                    return
                submit(*again.popleft())
            ended = wait(running, engine.patience_s, FIRST_COMPLETED).done
            if not ended:
                raise DataError("scheduler_idle", took_s=engine.patience_s)
            for future in ended:
                job, tried = running.pop(future)
                if future.cancelled():
                    raise DataError("scheduler_lost")
                error = future.exception()
                if error is None:
                    yield job, future.result()
                elif tried < TRIES:
                    again.append((job, tried + 1))
                else:
                    yield job, error
    finally:
        for future in running:
            future.cancel()


def _in_time(longest_s: float, work: Callable[[_J], _R], job: _J) -> _R:
    """Work, and end this process where it takes too long: nothing else ends what hangs in C."""
    if longest_s:
        faulthandler.dump_traceback_later(longest_s, exit=True)
    try:
        return work(job)
    finally:
        faulthandler.cancel_dump_traceback_later()


@contextmanager
def serial_engine() -> Generator[Engine]:
    """Work in this process, one job after the other."""
    with ThreadPoolExecutor(1) as executor:
        yield Engine(executor, 1)


@contextmanager
def dask_engine(
    scheduler: str = "",
    workers: int = 2,
    *,
    longest_s: float = _LONGEST_S,
    memory: str = _MEMORY,
) -> Generator[Engine]:
    """Work in processes of this computer, or of a cluster that exists.

    Parameters
    ----------
    scheduler : str
        Address of a Dask scheduler. Default: a cluster of one's own, on this computer.
    workers : int
        Processes of one's own cluster, with one job at a time each. One that dies is replaced, and
        its job has failed. [1]
    longest_s : float
        A job that takes longer ends its worker, after the lines on which it stood were written to
        the standard error. [s]
    memory : str
        A worker of one's own cluster that has more is ended.

    Raises
    ------
    DataError
        If the scheduler cannot be reached, or no certificates are stated for one of TLS.
    """
    import distributed as d  # noqa: PLC0415  it takes a second, and one computer does without
    from dask import config  # noqa: PLC0415  see above

    distributed: Any = d
    rules: dict[str, Any] = {
        "distributed.comm.timeouts.connect": "10s",
        # what starts a worker again is given up after so long, however busy the computer is
        "distributed.deploy.lost-worker-timeout": "1000 days",
        "distributed.scheduler.allowed-failures": 0,
        "distributed.scheduler.worker-saturation": 1.0,
        "distributed.worker.profile.enabled": False,
        # who has much memory goes on or ends; one that waits for less would wait for ever
        **{f"distributed.worker.memory.{what}": False for what in ("target", "spill", "pause")},
    }
    with ExitStack() as stack:
        stack.enter_context(config.set(rules))
        for logger in ("distributed", "distributed.client"):  # what is wrong is an error, said once
            stack.enter_context(distributed.utils.silence_logging_cmgr("critical", logger))
        try:
            address: Any = scheduler or stack.enter_context(
                distributed.LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    host="127.0.0.1",
                    dashboard_address="127.0.0.1:0",  # None would ask for port 8787
                    memory_limit=memory,
                    silence_logs=50,
                )
            )
            client: Any = stack.enter_context(distributed.Client(address))
        except (OSError, ValueError, RuntimeError, TypeError) as error:  # of TLS the last two
            if scheduler.startswith("tls:") and isinstance(error, TypeError):
                raise DataError("scheduler_without_certificates") from error
            raise DataError("scheduler_out_of_reach", cause=str(error)) from error
        threads = sum(client.nthreads().values()) if scheduler else workers
        executor = client.get_executor(pure=False)
        yield Engine(executor, _AT_ONCE * max(threads, 1), longest_s, _PATIENCE_S)
