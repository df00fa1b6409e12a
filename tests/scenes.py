"""Tests that are scenes: coroutines, each run to its end in a loop of events of its own."""

import asyncio
import functools
from collections.abc import Awaitable, Callable

LONGEST_S = 50.0
"""Longest time of a scene: less than the bound of a test. [s]"""


def scene(play: Callable[..., Awaitable[None]]) -> Callable[..., None]:
    """Make a test of a coroutine; its parameters stay those that pytest fills in."""

    @functools.wraps(play)
    def test(*given: object, **named: object) -> None:
        async def bounded() -> None:
            async with asyncio.timeout(LONGEST_S):
                await play(*given, **named)

        asyncio.run(bounded())

    return test
