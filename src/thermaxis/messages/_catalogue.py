"""The catalogues: Fluent files in a folder for each language, and the functions in them."""

import re
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib import resources
from typing import Any, Final, Literal, NamedTuple, cast, get_args

from fluent.runtime import FluentBundle, FluentResource
from fluent.runtime.types import FluentNone, FluentNumber, FluentType, fluent_number

from thermaxis.codes import Message, Place, Value, printable
from thermaxis.messages._formats import (
    ABSENT,
    duration_text,
    number_text,
    short_names,
    three_digits,
)

Language = Literal["en", "de", "cs"]
"""Languages that have a catalogue; the first is complete and stands in for the others."""
LANGUAGES: Final[tuple[str, ...]] = get_args(Language)
"""The same, to be gone through."""
FREE_TEXT: Final = frozenset({"detail", "failure", "finding", "problem", "said", "why"})
"""Values that hold sentences of free text, as an operating system or a server has said them."""
ISOLATE, END_OF_ISOLATE = "\N{FIRST STRONG ISOLATE}", "\N{POP DIRECTIONAL ISOLATE}"
"""What stands around English within a sentence of another language; invisible where it is shown."""
_GAP: Final = re.compile(r"\$(\w+)")
_ENTRY: Final = re.compile(r"^([a-z][\w-]*) *=.*(?:\n(?:[ \t]+\S.*|(?=\n[ \t]+\S)))*", re.MULTILINE)
"""A sentence with its attributes: the lines that are indented after its first one."""
_NAMED: Final = re.compile(r"\bNAME\(\$(\w+)\)")
"""A value that is shown as a name."""
_ATTRIBUTE: Final = re.compile(r"^[ \t]+\.(\w+) *=", re.MULTILINE)
_OTHER: Final = re.compile(r"{ *([a-z]\w*-[\w-]+)[ .}]")
"""Another sentence within one."""
_LONGEST_VALUE: Final = 1000
_LARGEST_COUNT: Final = 10**15
"""From here on a number counts nothing: what formats counts raises far beyond it. [1]"""
_MOST_BITS: Final = 1000
"""A longer number is none that a program has counted, nor one of floating point. [1]"""


_Argument = str | FluentType


class AlarmSentences(NamedTuple):
    """Sentences of an alarm."""

    text: str
    cause: str
    """Why, as far as is known."""
    remedy: str


def sentence(
    key: str, values: Mapping[str, Value] | None = None, *, language: str = LANGUAGES[0]
) -> str:
    """Return the sentence of a code; values are shown as they are, never read as markup.

    Parameters
    ----------
    key : str
        Key in the catalogue: kind, hyphen, code, such as ``reason-input_bad``; a part of it after
        a point, such as ``alarm-late.remedy``.
    values : mapping, optional
        What the sentence says, by name. None means nothing.
    language : str
        One of `LANGUAGES`.

    Returns
    -------
    str
        The sentence; the English one where the language has none; key and values where there is
        no sentence at all, or a value is missing, as of a program that is newer than this one.
        What is English in a sentence of another language stands between `ISOLATE` and
        `END_OF_ISOLATE`.
    """
    values = values or {}
    for one in dict.fromkeys((language, LANGUAGES[0])):
        text = _formatted(key, {n: _named(n, value, one) for n, value in values.items()}, one)
        if text is not None:
            return text if one == language else isolated(text)
    said = ", ".join(f"{name}={_plain(value)}" for name, value in values.items())
    return printable(f"{key} ({said})" if said else key, _LONGEST_VALUE)


def sentence_of(message: Message, *, language: str = LANGUAGES[0]) -> str:
    """Return the sentence of a message, without its place."""
    return sentence(message.code, message.values, language=language)


def remedy_of(message: Message, *, language: str = LANGUAGES[0]) -> str:
    """Return what to do about a message; empty where the catalogue has nothing."""
    key = f"{message.code}.remedy"
    known = key in keys(LANGUAGES[0])
    return sentence(key, message.values, language=language) if known else ""


def text_of(message: Message, *, language: str = LANGUAGES[0]) -> str:
    """Return place, sentence and remedy of a message.

    Such as ``run.csv, line 7: '3,x' is not a number. Correct it.``
    """
    place = place_text(message.place, language=language)
    text = sentence_of(message, language=language)
    remedy = remedy_of(message, language=language)
    return f"{place}: {text} {remedy}".strip() if place else f"{text} {remedy}".strip()


def alarm_sentences(
    code: str, values: Mapping[str, Value], *, language: str = LANGUAGES[0]
) -> AlarmSentences:
    """Return text, cause and remedy of an alarm.

    Of a code that has no sentence, code and values are the text, and there is nothing else.
    """
    key = f"alarm-{code}"
    text = sentence(key, values, language=language)
    if key not in keys(LANGUAGES[0]):
        return AlarmSentences(text, "", "")
    parts = (sentence(f"{key}.{part}", values, language=language) for part in ("cause", "remedy"))
    return AlarmSentences(text, *parts)


def place_text(place: Place, *, language: str = LANGUAGES[0]) -> str:
    """Return a place in words, its file first, such as ``run.csv, line 7, column Z_um``."""
    return ", ".join(
        sentence(f"place-{name}", {name: value}, language=language)
        for name, value in zip(place._fields, place, strict=True)
        if value not in {"", None}
    )


def template(key: str, *, language: str = LANGUAGES[0]) -> str:
    """Return a sentence whose values are filled in where it is shown, such as ``since {time}``."""
    gaps = _GAP.findall(_catalogue(language).entries.get(key.partition(".")[0], ""))
    return _formatted(key, {name: f"{{{name}}}" for name in gaps}, language) or key


def keys(language: str) -> frozenset[str]:
    """Return every key of the catalogue of a language, as `sentence` takes them."""
    return _catalogue(language).keys


def named_values(code: str) -> frozenset[str]:
    """Return which values of a message name something of the machine: what `NAME` shows of it."""
    return frozenset(_NAMED.findall(_catalogue(LANGUAGES[0]).entries.get(code, "")))


def _formatted(key: str, values: Mapping[str, _Argument], language: str) -> str | None:
    """Return a sentence of one catalogue; None where it has none, or a value is missing."""
    name, _, part = key.partition(".")
    bundle = _catalogue(language).read(name)
    if not bundle.has_message(name):
        return None
    entry = bundle.get_message(name)
    pattern = entry.attributes.get(part) if part else entry.value
    if pattern is None:
        return None
    text, errors = bundle.format_pattern(pattern, dict(values))
    return None if errors else str(text)


def isolated(text: str) -> str:
    """Return English as it stands within a sentence of another language."""
    return f"{ISOLATE}{text}{END_OF_ISOLATE}" if text else text


class _Catalogue(NamedTuple):
    """The sentences of a language, each parsed when it is first said: all take a fifth of 1 s."""

    bundle: FluentBundle
    entries: Mapping[str, str]
    keys: frozenset[str]

    def read(self, name: str) -> FluentBundle:
        """Return the bundle with a sentence, if there is one, and with those within it."""
        if name in self.entries and not self.bundle.has_message(name):
            self.bundle.add_resource(FluentResource(self.entries[name]))
            for other in _OTHER.findall(self.entries[name]):
                self.read(other)
        return self.bundle


@cache
def _catalogue(language: str) -> _Catalogue:
    folder = resources.files("thermaxis.messages") / language
    files = (file for file in folder.iterdir() if file.name.endswith(".ftl"))
    found = (entry for file in files for entry in _ENTRY.finditer(file.read_text("utf-8")))
    entries = {entry[1]: entry[0] for entry in found}
    parts = {f"{name}.{part}" for name, e in entries.items() for part in _ATTRIBUTE.findall(e)}
    bundle = FluentBundle([language], _functions(language), use_isolating=False)
    return _Catalogue(bundle, entries, frozenset({*entries, *parts}))


# ---- values -------------------------------------------------------------------------------------


class _Number(FluentType):
    """A number that counts nothing: a decimal, or a negative one."""

    def __init__(self, value: float, language: str) -> None:
        self.value = value
        self._language = language

    def format(self, locale: object) -> str:  # noqa: ARG002 the language is known
        """Return the number with as many digits as it needs."""
        return number_text(self.value, "g", self._language)


class _Several(FluentType):
    """Several texts or codes."""

    def __init__(self, parts: tuple[str, ...]) -> None:
        self.parts = parts

    def format(self, locale: object) -> str:  # noqa: ARG002 words were chosen before
        """Return them one after another, whole sentences without a sign between them."""
        whole = all(part.endswith(".") for part in self.parts)
        return (" " if whole else "; ").join(self.parts)


def _named(name: str, value: Value, language: str) -> _Argument:
    """Return a value by its name: free text is English."""
    found = _argument(value, language)
    free = name in FREE_TEXT and isinstance(found, str) and isinstance(value, str) and found
    return isolated(str(found)) if free and language != LANGUAGES[0] else found


def _argument(value: Value, language: str) -> _Argument:
    """Return a value as a catalogue's functions and selections take it."""
    if value is None or (isinstance(value, int) and value.bit_length() > _MOST_BITS):
        return ABSENT
    if isinstance(value, Message):
        said, place = (
            sentence_of(value, language=language),
            place_text(value.place, language=language),
        )
        return f"{place}: {said}" if place else said
    if isinstance(value, tuple):
        return _Several(tuple(str(_argument(part, language)) for part in value))
    if isinstance(value, str):
        return printable(value, _LONGEST_VALUE)
    if isinstance(value, int) and 0 <= value < _LARGEST_COUNT:
        return fluent_number(value, useGrouping=False)
    return _Number(float(value), language)


def _plain(value: Value) -> str:
    return value.code if isinstance(value, Message) else str(value)


def _number(argument: object) -> object:
    """Return the number of an argument; a text is none."""
    return argument.value if isinstance(argument, _Number) else argument


def _parts(argument: _Argument) -> Iterable[str]:
    return argument.parts if isinstance(argument, _Several) else (str(argument),)


def _functions(language: str) -> dict[str, Callable[[Any], FluentType]]:
    """Return the functions that a catalogue may call.

    ``FIXED($x, decimals: 1)`` a number, without decimals three digits of it, ``SIGNED`` the same
    with its sign, ``DURATION($x_s)`` a time, ``NAME($x)`` names without units,
    ``CODE($x, "reason")`` the sentences of codes.
    """

    def fixed(
        argument: _Argument, decimals: FluentNumber | None = None, sign: str = ""
    ) -> _Argument:
        number = _number(argument)
        places = three_digits(number) if decimals is None else decimals
        return _unknown(argument) or number_text(number, f"{sign}.{places:d}f", language)

    def signed(argument: _Argument, decimals: FluentNumber | None = None) -> _Argument:
        return fixed(argument, decimals, "+")

    def duration(argument: _Argument) -> _Argument:
        return _unknown(argument) or duration_text(_number(argument))

    def name(argument: _Argument) -> _Argument:
        return _unknown(argument) or ", ".join(short_names(one) for one in _parts(argument))

    def code(argument: _Argument, group: str) -> _Argument:
        if isinstance(argument, FluentNone):
            return argument
        known = keys(LANGUAGES[0])
        every = ((one, f"{group}-{one}") for one in _parts(argument))
        return "; ".join(
            sentence(key, language=language) if key in known else one for one, key in every
        )

    # Fluent takes texts from functions as well; its annotation says less.
    return cast(
        "dict[str, Callable[[Any], FluentType]]",
        {"FIXED": fixed, "SIGNED": signed, "DURATION": duration, "NAME": name, "CODE": code},
    )


def _unknown(argument: _Argument) -> _Argument | None:
    """Return an argument that is not there, as Fluent marks it."""
    return argument if isinstance(argument, FluentNone) else None
