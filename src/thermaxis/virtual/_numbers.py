"""Numbers that a virtual machine can have."""

import math
from dataclasses import fields

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError


def require_numbers(
    part: object, *, positive: tuple[str, ...] = (), not_negative: tuple[str, ...] = ()
) -> None:
    """Refuse a dataclass with a number that is not finite, or has the wrong sign."""
    for entry in fields(part):  # pyright: ignore[reportArgumentType] - called with dataclasses only
        value, place = getattr(part, entry.name), Place(key=entry.name)
        if not isinstance(value, int | float):
            continue
        if not math.isfinite(value):
            raise ConfigurationError("not_finite", place=place)
        if entry.name in positive and not value > 0:
            raise ConfigurationError("not_positive", value=value, place=place)
        if entry.name in not_negative and value < 0:
            raise ConfigurationError("negative", value=value, place=place)
