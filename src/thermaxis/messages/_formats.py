"""Numbers, times and names as sentences show them."""

import math
import re
from typing import Final

ABSENT: Final = "–"
"""What is shown for a number that is not known."""
_UNIT_OF_NAME: Final = re.compile(r"_(?:um|C)$")
_FIRST_WORD: Final = re.compile(r"[^\s:;,]*")
_NAME: Final = re.compile(r"[._/\\]\S|\d")
_SPACE: Final = "\N{NO-BREAK SPACE}"


def number_text(value: object, spec: str, language: str) -> str:
    """Return a number as it is shown, with a true minus and the decimal sign of the language.

    The format is Python's, such as ``.1f``, ``+.1f`` or ``g``. Zero has no sign; what is no finite
    number is `ABSENT`.
    """
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return ABSENT
    text = format(value, spec)
    if not any(digit in "123456789" for digit in text):
        text = text.lstrip("+-")
    text = text.replace("-", "−")
    return text if language == "en" else text.replace(".", ",")


def three_digits(value: object) -> int:
    """Return the decimals that show three digits of a number, two at most."""
    size = abs(value) if isinstance(value, int | float) else 0.0
    return 0 if size >= 100.0 else 1 if size >= 10.0 else 2


def duration_text(time_s: object) -> str:
    """Return a time in the two largest units that it has, such as ``1 h 30 min`` or ``45 s``.

    The same in every language; what is no finite number is `ABSENT`.
    """
    if not isinstance(time_s, int | float) or not math.isfinite(time_s):
        return ABSENT
    whole = max(0, math.floor(time_s + 0.5))
    if whole < 60:
        return f"{whole}{_SPACE}s"
    if whole < 3600:
        return _two_units(whole, 60, "min", "s", rough=whole >= 600)
    if whole < 86_400:
        return _two_units(whole // 60, 60, "h", "min")
    return _two_units(whole // 3600, 24, "d", "h")


def _two_units(count: int, base: int, large: str, small: str, *, rough: bool = False) -> str:
    first, rest = divmod(count, base)
    text = f"{first}{_SPACE}{large}"
    return text if rough or rest == 0 else f"{text} {rest}{_SPACE}{small}"


def short_names(names: str) -> str:
    """Return names without the unit at their end, which stands beside the value: ``Z`` of ``Z_um``.

    Several have ``", "`` between them.
    """
    return ", ".join(_UNIT_OF_NAME.sub("", name) for name in names.split(", "))


def as_sentence(text: str) -> str:
    """Return what stands within a sentence as one of its own: a large first letter and a full stop.

    What begins with the name of a file or a value keeps its first letter: with another one it would
    be another name.
    """
    first = _FIRST_WORD.match(text)
    named = first is not None and _NAME.search(first[0])
    begun = text if named else text[:1].upper() + text[1:]
    return begun if not text or text[-1] in ".!?" else f"{begun}."
