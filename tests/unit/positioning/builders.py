"""Runs with closed-form answers, for tests."""

from collections.abc import Sequence

import numpy as np

from thermaxis.codes import Message
from thermaxis.messages import sentence_of
from thermaxis.positioning import PositioningTest, TimeSource
from thermaxis.quantities import AxisKind


def run(
    deviation: np.ndarray,
    target: np.ndarray | None = None,
    *,
    kind: AxisKind = AxisKind.LINEAR,
    time_s: np.ndarray | None = None,
) -> PositioningTest:
    """Return a run with the given deviations; targets every 20 mm unless given."""
    targets = np.arange(deviation.shape[0]) * 20.0 if target is None else target
    order = None
    if time_s is not None:
        order = np.empty(time_s.size)
        order[np.argsort(time_s, axis=None)] = np.arange(1, time_s.size + 1)
        order = order.reshape(time_s.shape)
    return PositioningTest(
        kind=kind,
        target=targets,
        deviation=deviation,
        time_source=TimeSource.NONE if time_s is None else TimeSource.FILE,
        time_s=time_s,
        order=order,
    )


def closed_form(m: int, g: float, b: float, k: float) -> np.ndarray:
    """Return x = g (i - 1) ± b + k c_j, c = -2 ... 2: every figure has a closed form."""
    slope = g * np.arange(m)[:, None, None]
    reversal = np.array([b, -b])[None, None, :]
    scatter = k * np.arange(-2.0, 3.0)[None, :, None]
    return slope + reversal + scatter


def stop_times(m: int, n: int, step_s: float = 1.0) -> np.ndarray:
    """Return the times of a standard cycle with equal steps: up 1..m, down m..1."""
    up = np.arange(m)
    one = np.stack((up, 2 * m - 1 - up), axis=1)
    return step_s * (one[:, None, :] + 2.0 * m * np.arange(n)[None, :, None])


def codes_of(messages: Sequence[Message]) -> list[str]:
    """Return what is said, as codes without their kind; a sentence has all its values."""
    codes = [message.code for message in messages]
    assert not set(codes) & set(map(sentence_of, messages))
    return [code.partition("-")[2] for code in codes]


def values_said(messages: Sequence[Message], code: str) -> dict[str, object]:
    """Return the values of the one message with a code."""
    (values,) = (
        m.values for m, one in zip(messages, codes_of(messages), strict=True) if one == code
    )
    return dict(values)
