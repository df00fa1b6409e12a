"""What a cycle is given of everything that was read."""

from collections.abc import Mapping

from thermaxis.compensation import Compensation, CycleReading, Sample
from thermaxis.runtime._offsets import Found
from thermaxis.runtime._ports import (
    NOT_READ,
    OTHER_COMPENSATION,
    SourceSample,
    interlock_name,
    redundant_name,
)
from thermaxis.runtime.loop._self_test import SELF_TEST
from thermaxis.runtime.loop._settings import LoopSettings


def reading_of(
    compensation: Compensation,
    settings: LoopSettings,
    samples: Mapping[str, SourceSample],
    found: Found,
    *,
    time_s: float,
    connected: bool,
    tested: bool,
) -> CycleReading:
    """Return the reading of a cycle, without requests."""
    redundant: tuple[Sample | None, ...] = ()
    if compensation.redundant:
        redundant = tuple(
            _sample(samples, redundant_name(c)) if c in compensation.redundant else None
            for c in compensation.judged
        )
    other: bool | None = False
    if settings.other_active is not None:
        other = _flag(samples.get(OTHER_COMPENSATION, NOT_READ), settings.other_active)
    met = [
        tested
        if name == SELF_TEST
        else _flag(
            samples.get(interlock_name(name), NOT_READ), settings.interlocks_met.get(name, True)
        )
        for name in compensation.interlocks
    ]
    return CycleReading(
        time_s,
        tuple([_sample(samples, name) for name in compensation.judged]),
        redundant,
        tuple(met),
        connected=connected,
        read_back_um=found.read_back_um,
        found_um=found.found_um,
        other_compensation=found.other_writer or other,
    )


def _flag(sample: SourceSample, meaning: bool) -> bool | None:  # noqa: FBT001 - the value that means yes
    """Return whether a flag has the value that is looked for; None where it was not read."""
    if not sample.good or sample.value is None:
        return None
    return (sample.value != 0.0) is meaning


def _sample(samples: Mapping[str, SourceSample], name: str) -> Sample:
    sample = samples.get(name, NOT_READ)
    return Sample(sample.value, sample.good, sample.age_s)
