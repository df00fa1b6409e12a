"""Numbers that must lie in a range; NaN lies in none."""

from collections.abc import Sequence

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError


def require_range(key: str, value: float, least: float, most: float, channel: str = "") -> None:
    """Refuse a number that is not from the least to the most."""
    if not least <= value <= most:
        place = Place(key=key, channel=channel)
        raise ConfigurationError("outside_range", value=value, least=least, most=most, place=place)


def require_positive(key: str, value: float, most: float, channel: str = "") -> None:
    """Refuse a number that is not above zero and at most so large."""
    if not 0.0 < value <= most:
        place = Place(key=key, channel=channel)
        raise ConfigurationError("not_positive_up_to", value=value, most=most, place=place)


def require_count(key: str, count: int, least: int, most: int, channel: str = "") -> None:
    """Refuse too few of something, or too many."""
    if not least <= count <= most:
        place = Place(key=key, channel=channel)
        raise ConfigurationError("outside_count", count=count, least=least, most=most, place=place)


def require_unique(key: str, names: Sequence[str], channel: str = "") -> None:
    """Refuse a name that stands twice."""
    for k, name in enumerate(names):
        if name in names[:k]:
            raise ConfigurationError(
                "stated_twice", name=name, place=Place(key=key, channel=channel)
            )
