"""Ctrl+C and SIGTERM, which end what runs until it is told to end."""

import asyncio
import signal
from collections.abc import Callable, Generator
from contextlib import contextmanager

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def at_signals(act: Callable[[], None]) -> Generator[None]:
    """Call something at every such signal; where there are none, as on Windows, never."""
    loop = asyncio.get_running_loop()
    try:
        for number in _SIGNALS:
            loop.add_signal_handler(number, act)
    except (NotImplementedError, RuntimeError):  # the latter outside of the main thread
        yield
        return
    try:
        yield
    finally:
        for number in _SIGNALS:
            loop.remove_signal_handler(number)
