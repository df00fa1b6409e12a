"""What carries a naming: the signs of its causes night by night, with their limits."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import date
from math import expm1, sqrt
from typing import Final, final

from thermaxis.fleet._judging import CAUSES, GROWS, JUDGED_DAYS, LEAST, Cause, Judgement
from thermaxis.fleet._night import StoredNight
from thermaxis.fleet._signs import SignKind, figure_of

_SHARES: Final[Mapping[SignKind, Callable[[float], float]]] = {
    SignKind.SWAP: lambda share: 100.0 * share,
    SignKind.GAIN: lambda share: 100.0 * share,
    SignKind.TIME_CONSTANT: lambda log: 100.0 * expm1(log),
    SignKind.REST: lambda log: 100.0 * expm1(log),
}
"""Percent of a sign's figure. [%]"""
_UNITS: Final = {SignKind.LEVEL: "K", SignKind.MEAN: "µm"}


@final
@dataclass(frozen=True, slots=True)
class Evidence:
    """A sign of a cause for which a machine is named, over the nights that were judged together."""

    cause: Cause
    """The cause."""
    of: str
    """The part, channel or output."""
    unit: str
    """Unit of what follows."""
    days: tuple[date, ...]
    """Days of the nights, but for those of which not even `JUDGED_DAYS` together would tell."""
    departures: tuple[float, ...]
    """How far it departs from its own past, by night; that of judging is drawn to the sisters'."""
    twice_std: tuple[tuple[float, float], ...]
    """The same less and plus two standard deviations."""
    limits: tuple[float | None, float]
    """Departures between these are no reason to look at a machine; None: nor is any below."""


def evidence_of(judgement: Judgement, nights: Iterable[StoredNight]) -> list[Evidence]:
    """Return what carries a judgement, the likeliest cause first.

    Of a sensor that stands still there is none: it has no figure; nor where no night tells.

    Parameters
    ----------
    judgement : Judgement
        Of a machine that is named.
    nights : iterable of StoredNight
        Its nights, in the order of days.
    """
    latest = {night.day: night for night in nights}
    last = latest.get(judgement.day)
    some = [
        night
        for day, night in latest.items()
        if last is not None
        and 0 <= (judgement.day - day).days < JUDGED_DAYS
        and night.model_sha256 == last.model_sha256
    ]
    kinds = {cause: kind for kind, cause in CAUSES.items()}
    found: list[Evidence] = []
    for cause, said in zip(judgement.causes, judgement.evidence, strict=True):
        of = said.place.channel
        if cause in kinds:
            one = _evidence(some, cause, kinds[cause], of, judgement.output)
            found += [one] if one is not None else []
    return found


def _evidence(
    nights: Iterable[StoredNight], cause: Cause, kind: SignKind, of: str, output: str
) -> Evidence | None:
    figures: dict[date, tuple[float, float, float]] = {}
    for night in nights:
        found = figure_of(night.result, kind, output, of)
        if found is not None:
            figure, anew = found
            if anew:  # the zero is another one: what was before tells nothing
                figures.clear()
            figures[night.day] = figure
    least = LEAST[kind]
    most = least * sqrt(JUDGED_DAYS)
    if not any(std <= most for _, std, _ in figures.values()):
        return None
    scaled = _SHARES.get(kind, float)
    _, _, past = next(iter(figures.values()))
    told = [(day, value - past, 2.0 * std) for day, (value, std, _) in figures.items()
            if std <= most]  # fmt: skip
    return Evidence(
        *(cause, of, _UNITS.get(kind, "%")),
        days=tuple(day for day, *_ in told),
        departures=tuple(scaled(level) for _, level, _ in told),
        twice_std=tuple((scaled(d - s), scaled(d + s)) for _, d, s in told),
        limits=(None if kind in GROWS else scaled(-least), scaled(least)),
    )
