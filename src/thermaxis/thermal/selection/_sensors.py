"""Which candidate channels cannot be trusted, and how noisy they are.

A wrong sensor is found before a model is blamed.
"""

from collections import Counter
from collections.abc import Sequence
from itertools import chain

import numpy as np

from thermaxis.thermal._arrays import FloatArray
from thermaxis.thermal.log import (
    Experiment,
    FindingKind,
    InputDefinition,
    ThermalLog,
    check_log,
)

MOST_LOST = 0.2
"""Share of a log without a value, or stuck, from which a channel is not learnt from. [1]"""
_WITHOUT_VALUES = {FindingKind.MISSING, FindingKind.RARE}
_CLIPPED = 5.0
"""Second differences beyond so many standard deviations are steps or spikes. [1]"""
_NORMAL_MEDIAN = 1.4826


def faulty_candidates(
    logs: Sequence[ThermalLog], inputs: Sequence[InputDefinition]
) -> tuple[str, ...]:
    """Return the inputs that a model must not learn from.

    Returns
    -------
    tuple of str
        Names of those of which `check_log` finds a channel constant in all logs, or in one of them
        swapped, or stuck or missing in more than a fifth of it. One that is noisy stays: its direct
        gain is held back.
    """
    faulty, constant = set[str](), list[set[str]]()
    for log in logs:
        names = dict.fromkeys(log.name_of(c) for one in inputs for c in one.channels)
        findings = check_log(log.select(list(names)))
        constant.append({f.channel for f in findings if f.kind is FindingKind.CONSTANT})
        lost = (f for f in findings if f.certain or f.kind in _WITHOUT_VALUES)
        faulty |= {f.channel for f in lost if f.extent > MOST_LOST}
        swapped = (f.channel.split(",") for f in findings if f.kind is FindingKind.SWAPPED)
        pairs = Counter(chain.from_iterable(swapped))
        faulty |= {name for name, count in pairs.items() if count == 1}  # others jump all the time
    faulty |= set[str].intersection(*constant)
    return tuple(
        one.name
        for one in inputs
        if any(log.name_of(channel) in faulty for log in logs for channel in one.channels)
    )


def sensor_noise_k(experiments: Sequence[Experiment]) -> FloatArray:
    """Return the white noise of every input, standard deviation, (k,). [K]

    Notes
    -----
    Second differences of white noise have six times its variance, and neighbouring ones a
    covariance of minus four times. What a temperature does between rows makes the first larger
    and the second less negative, so that the smaller of both estimates is taken: a cooler that
    switches every few rows is less of a noise. Steps and spikes are clipped at five standard
    deviations.
    """
    return np.array(
        [_noise_of([e.u[:, i] for e in experiments]) for i in range(experiments[0].inputs)]
    )


def _noise_of(series: Sequence[FloatArray]) -> float:
    seconds = [np.diff(values, 2) for values in series]
    every = np.concatenate(seconds)
    every = np.abs(every[~np.isnan(every)])
    if every.size == 0:
        return 0.0
    scale = _NORMAL_MEDIAN * float(np.median(every))
    limit = _CLIPPED * scale if scale > 0 else float(np.max(every))
    clipped = [np.clip(second, -limit, limit) for second in seconds]
    own = np.concatenate([c**2 for c in clipped])
    neighbours = np.concatenate([c[1:] * c[:-1] for c in clipped])
    if bool(np.all(np.isnan(neighbours))):
        return 0.0
    variance = min(float(np.nanmean(own)) / 6.0, -float(np.nanmean(neighbours)) / 4.0)
    return max(variance, 0.0) ** 0.5
