"""Ctrl+C, SIGTERM and a closed terminal, which end what runs until it is told to end."""

import asyncio
import signal
from collections.abc import Callable, Generator
from contextlib import contextmanager

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def at_signals(
    act: Callable[[], object], hung_up: Callable[[], object] | None = None
) -> Generator[None]:
    """Call something at every such signal; where there are none, as on Windows, never.

    What outlives its terminal, as after nohup, goes on to.
    """
    loop = asyncio.get_running_loop()
    actions: dict[signal.Signals, Callable[[], object]] = dict.fromkeys(_SIGNALS, act)
    try:
        if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
            actions[signal.SIGHUP] = hung_up or act
        for number, action in actions.items():
            loop.add_signal_handler(number, action)
    except (
        AttributeError,
        NotImplementedError,
        RuntimeError,
    ):  # the latter outside of the main thread
        yield
        return
    try:
        yield
    finally:
        for number in actions:
            loop.remove_signal_handler(number)
