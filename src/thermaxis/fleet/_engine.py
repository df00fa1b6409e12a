"""Many nights at once: `concurrent.futures.Executor` is the engine, in this process or Dask's.

Nothing durable is in an engine. Results come as they are ready; whoever ends them ends nothing that
was stored.
"""

from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from itertools import islice
from typing import Any, Final, NamedTuple, TypeVar

from thermaxis.errors import DataError

TRIES: Final = 2
"""A job that has failed so often is set aside. [1]"""
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


def results_of(
    engine: Engine, work: Callable[[_J], _R], jobs: Iterable[_J]
) -> Iterator[tuple[_J, _R | BaseException]]:
    """Yield every job with its result, as they come; with its error where it failed twice.

    Raises
    ------
    DataError
        If the engine is lost.
    """
    waiting = iter(jobs)
    running: dict[Future[_R], tuple[_J, int]] = {}

    def submit(job: _J, tried: int) -> None:
        running[engine.executor.submit(work, job)] = job, tried

    try:
        while True:
            for job in islice(waiting, engine.window - len(running)):
                submit(job, 1)
            if not running:
                return
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                job, tried = running.pop(future)
                if future.cancelled():
                    raise DataError("scheduler_lost")
                error = future.exception()
                if error is None:
                    yield job, future.result()
                elif tried < TRIES:
                    submit(job, tried + 1)
                else:
                    yield job, error
    finally:
        for future in running:
            future.cancel()


@contextmanager
def serial_engine() -> Generator[Engine]:
    """Work in this process, one job after the other."""
    with ThreadPoolExecutor(1) as executor:
        yield Engine(executor, 1)


@contextmanager
def dask_engine(scheduler: str = "", workers: int = 2) -> Generator[Engine]:
    """Work in processes of this computer, or of a cluster that exists.

    Of one's own cluster a worker has one job at a time and 1 GB of memory; a worker that dies is
    replaced, and its job is given to another one once before that counts as a try.

    Raises
    ------
    DataError
        If the scheduler cannot be reached.
    """
    import distributed as d  # noqa: PLC0415  it takes a second, and one computer does without
    from dask import config  # noqa: PLC0415  see above

    distributed: Any = d
    rules: dict[str, Any] = {
        "distributed.scheduler.allowed-failures": 1,
        "distributed.scheduler.worker-saturation": 1.0,
        "distributed.comm.timeouts.connect": "10s",
    }
    with ExitStack() as stack:
        stack.enter_context(config.set(rules))
        address: Any = scheduler or stack.enter_context(
            distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address=None,
                memory_limit=_MEMORY,
                silence_logs=50,
            )
        )
        try:
            client: Any = stack.enter_context(distributed.Client(address))
        except (OSError, ValueError) as error:
            raise DataError("scheduler_out_of_reach", cause=str(error)) from error
        threads = sum(client.nthreads().values()) if scheduler else workers
        yield Engine(client.get_executor(pure=False), _AT_ONCE * max(threads, 1))
