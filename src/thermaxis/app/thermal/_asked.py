"""What a page asks for, as words of commands: each checked, none of them an option of its own."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, cast

from thermaxis.app._rooms import Json, file_stem
from thermaxis.web import RefusedError

MOST_NAMES: Final = 40
"""Most inputs, outputs or logs of one request. [1]"""
_EXTENSIONS = (".csv", ".txt", ".parquet", ".xlsx", ".mat", ".tdms")
_NAME = r"[^\x00-\x1f\x7f]{1,200}"
_SIZE = r"[0-9]{1,7}(\.[0-9]{1,6})?"
_SIGNED = rf"-?{_SIZE}"
_IDENTIFY: Final[Mapping[str, tuple[str, str]]] = {
    "method": ("--method", "modal|oe|arx|averages|static"),
    "sample_time": ("--sample-time", rf"{_SIZE} ?(s|min|h)?"),
    "span": ("--span", r"[0-9.]{0,12}(s|min|h)?:[0-9.]{0,12}(s|min|h)?"),
}
"""Options: the command's word, and what may stand there."""
_EXPORT: Final[Mapping[str, tuple[str, str]]] = {
    "dialect": ("--dialect", "st|scl|c"),
    "cycle_s": ("--cycle-s", _SIZE),
    "limit_um": ("--limit", _SIZE),
    "rate_um_per_s": ("--rate", _SIZE),
    "plausible_c": ("--plausible", rf"{_SIGNED}:{_SIGNED}"),
    "reference": ("--reference", "stated"),
}
_BAD_REQUEST = 400


def identify_words(asked: Json) -> list[str]:
    """Return outputs, inputs and options of an identification."""
    words = [f"--output={_text(one, 'outputs')}" for one in names_of(asked, "outputs")]
    choose = asked.get("choose") is True
    for one in _list(asked, "inputs"):
        if not isinstance(one, dict):
            raise no_option("inputs")
        found = cast("Json", one)
        plus, minus = _text(found.get("plus"), "inputs"), found.get("minus") or ""
        if choose:
            words.append(f"--candidates={plus}")
            continue
        name = _text(found.get("name") or plus, "inputs")
        less = f"-{_text(minus, 'inputs')}" if minus else ""
        words.append(f"--input={name.replace('=', ' ')}={plus}{less}")
    return [*words, *_options(asked, _IDENTIFY)]


def export_words(asked: Json) -> list[str]:
    """Return the options of an export."""
    return _options(asked, _EXPORT)


def names_of(asked: Json, key: str) -> list[str]:
    """Return texts of a list, each once."""
    return list(dict.fromkeys(_text(one, key) for one in _list(asked, key)))


def stored_name(given: str) -> str:
    """Return a name for an uploaded log that no command takes for an option."""
    suffix = Path(given).suffix.lower()
    stem = file_stem(given).strip("-")
    return f"{stem or 'log'}{suffix if suffix in _EXTENSIONS else '.csv'}"


def no_option(key: str) -> RefusedError:
    """Return the refusal of what the page never sends."""
    return RefusedError(_BAD_REQUEST, "positioning-bad_option", option=key)


def _options(asked: Json, options: Mapping[str, tuple[str, str]]) -> list[str]:
    words: list[str] = []
    for key, (word, pattern) in options.items():
        value = asked.get(key) or ""
        if value and not (isinstance(value, str) and re.fullmatch(pattern, value, re.ASCII)):
            raise no_option(key)
        words += [f"{word}={value}"] if value else []
    return words


def _list(asked: Json, key: str) -> list[Any]:
    found = asked.get(key, [])
    if not isinstance(found, list) or len(cast("list[Any]", found)) > MOST_NAMES:
        raise no_option(key)
    return cast("list[Any]", found)


def _text(value: object, key: str) -> str:
    if not isinstance(value, str) or not re.fullmatch(_NAME, value):
        raise no_option(key)
    return value
