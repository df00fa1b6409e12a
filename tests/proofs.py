"""Which cases of a grid run at each change, where all of them test one branch at length."""

from collections.abc import Iterable
from typing import Any

import pytest


def quick_first(number: int, cases: Iterable[Any]) -> list[Any]:
    """Return cases of which only the first ones run at each change; the others are proofs."""
    found = list(cases)
    return found[:number] + [
        pytest.param(*(case if isinstance(case, tuple) else (case,)), marks=pytest.mark.proof)
        for case in found[number:]
    ]
