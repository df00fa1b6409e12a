"""Times that are promised of a computer without other work, judged on one that has some."""

import time
from typing import Final

LONGEST_S: Final = 120.0
"""What must come about is waited for so long, also on a slow computer. [s]"""


def slowness() -> float:
    """Return how many times longer the clock takes than the processor: 1 where nobody else works.

    Returns
    -------
    float
        At least 1. [1]
    """
    began_s, computing_s = time.monotonic(), time.thread_time()
    while time.thread_time() - computing_s < 0.3:
        pass
    return max(1.0, (time.monotonic() - began_s) / 0.3)


def in_time(took_s: float, limit_s: float) -> bool:
    """Return whether a time was kept that is promised of a computer without other work.

    Parameters
    ----------
    took_s : float
        What it took. [s]
    limit_s : float
        The time that is promised; where others work, it is longer by as much as they take. [s]

    Returns
    -------
    bool
        Whether it was kept.
    """
    return took_s <= limit_s or took_s <= limit_s * slowness()
