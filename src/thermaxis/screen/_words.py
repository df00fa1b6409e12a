"""The screen's words in English, German and Czech, and the loop's English said in each.

Words stand in ``words/AREA.toml``, each key with the three languages side by side, so that nobody
changes one and forgets another. What the loop says in English (states, reasons, answers) is
translated by ``words/phrases.toml``; what it does not hold stays English rather than being lost.
"""

import math
import re
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from importlib import resources
from string import Formatter
from typing import Final, NamedTuple, cast, final

from thermaxis.codes import Message, Value
from thermaxis.errors import ConfigurationError
from thermaxis.messages import LANGUAGES, keys, sentence

FREE_TEXT: Final = frozenset({"detail", "failure", "finding", "problem", "said", "why"})
"""Gaps that hold sentences of free text, in English where no phrase translates them."""
UNKNOWN: Final = "–"
"""What is shown for a number that is not known."""
_PHRASES: Final = "phrases"
_CODES: Final = {
    **{group: group for group in ("state", "reason", "quality", "sensor_cause", "outcome")},
    **{group: group for group in ("model_quality", "role", "priority", "request")},
    "event": "event_kind",
}
"""Groups of codes, and their kind in the catalogues."""
_LONGEST_PHRASE = 2000
_LONGEST_HEADER = 400
_NUMBER_ENDS = ("_um", "_mm", "_s", "_c", "_k")
_UNIT_OF_NAME = re.compile(r"_(?:um|C)$")
_NAMES: Final = frozenset({"acts_on", "names", "needed", "output"})
"""Gaps that hold names of outputs or inputs; of an alarm its ``name`` as well."""


class SaidAlarm(NamedTuple):
    """An alarm in one language."""

    text: str
    """What is wrong."""
    cause: str
    """Why, as far as is known."""
    remedy: str
    """What to do."""


class _Pattern(NamedTuple):
    """A phrase with gaps: the literal texts around them, and what stands in each."""

    texts: tuple[str, ...]
    """Literal texts; one more than there are gaps."""
    names: tuple[str, ...]
    """Names of the gaps."""
    said: Mapping[str, str]
    """The phrase by language."""

    def found_in(self, text: str) -> dict[str, str] | None:
        """Return what stands in the gaps of a text, or None where it is another phrase."""
        first, *inner, last = self.texts
        if not text.startswith(first):
            return None
        at, values = len(first), dict[str, str]()
        for name, literal in zip(self.names[:-1], inner, strict=True):
            behind = text.find(literal, at + 1)
            if behind < 0:
                return None
            values[name] = text[at:behind]
            at = behind + len(literal)
        end = len(text) - len(last)
        if end <= at or not text.endswith(last):
            return None
        values[self.names[-1]] = text[at:end]
        return values


@final
@dataclass(frozen=True, slots=True)
class Words:
    """Every word of the screen."""

    sentences: Mapping[str, Mapping[str, str]]
    """By key (``AREA.key``) and language."""
    said: Mapping[str, Mapping[str, Mapping[str, str]]]
    """Words of codes, by group, code and language; of phrases by what they are in English."""
    _patterns: Mapping[str, tuple[_Pattern, ...]] = field(repr=False)

    @classmethod
    def read(cls) -> "Words":
        """Read the files that are installed with the screen.

        Returns
        -------
        Words
            Every word.

        Raises
        ------
        ConfigurationError
            If a file is no TOML, or a key has not exactly the three languages: the installation
            is damaged.
        """
        sentences: dict[str, Mapping[str, str]] = {}
        said: dict[str, Mapping[str, Mapping[str, str]]] = {}
        folder = resources.files("thermaxis.screen") / "words"
        for file in sorted(folder.iterdir(), key=lambda one: one.name):
            area, dot, ending = file.name.rpartition(".")
            if not dot or ending != "toml":
                continue
            try:
                tables = tomllib.loads(file.read_text("utf-8"))
            except tomllib.TOMLDecodeError as error:
                raise _damaged(f"no TOML: {error}", file.name) from None
            if area == _PHRASES:
                said = {group: _phrases_of(rows, group) for group, rows in tables.items()}
            else:
                sentences.update(_sentences_of(tables, area))
        patterns = {group: tuple(_patterns_of(phrases)) for group, phrases in said.items()}
        said |= {group: _codes_of(key) for group, key in _CODES.items()}
        return cls(sentences, said, patterns)

    def say(self, language: str, key: str, /, **values: str) -> str:
        """Return the words of a key.

        Parameters
        ----------
        language : str
            One of `LANGUAGES`.
        key : str
            Key, such as ``operator.hold``.
        **values : str
            What stands for the placeholders, numbers as they are to be shown.

        Returns
        -------
        str
            The words.

        Raises
        ------
        KeyError
            If there is no such key, language or value; it names it.
        """
        return self.sentences[key][language].format_map(values)

    def catalog(self, language: str) -> dict[str, str]:
        """Return the words of every key, placeholders as they are.

        Parameters
        ----------
        language : str
            One of `LANGUAGES`.

        Returns
        -------
        dict of str to str
            By key; alarms as ``alarms.CODE.text``, ``.cause`` and ``.remedy``.
        """
        return {key: said[language] for key, said in self.sentences.items()}

    def phrases(self, language: str) -> dict[str, dict[str, str]]:
        """Return what the loop says, by its English.

        Parameters
        ----------
        language : str
            One of `LANGUAGES`.

        Returns
        -------
        dict
            By group and English phrase. A phrase with ``{name}`` in it is a pattern: what stands
            there in English stands at the same name in the translation. Those that say most come
            first, so that the first that fits is the right one.
        """
        return {
            group: {english: one[language] for english, one in phrases.items()}
            for group, phrases in self.said.items()
        }

    def phrase(self, language: str, group: str, english: str) -> str:
        """Return what the loop says in a language.

        Parameters
        ----------
        language : str
            One of `LANGUAGES`.
        group : str
            Group of phrases, such as ``reason``; ``reasons`` for several, joined by ``"; "``.
        english : str
            What the loop said.

        Returns
        -------
        str
            The translation; the English where there is none.
        """
        if group not in self.said and group[:-1] in self.said:
            parts = english.split("; ")
            return "; ".join(self.phrase(language, group[:-1], part) for part in parts)
        exact = self.said.get(group, {}).get(english)
        if exact is not None:
            return exact[language]
        if len(english) > _LONGEST_PHRASE:
            return english
        for pattern in self._patterns.get(group, ()):
            values = pattern.found_in(english)
            if values is not None:
                return self._filled(language, pattern.said[language], values)
        return english

    def alarm(self, language: str, code: str, values: Mapping[str, object]) -> SaidAlarm | None:
        """Return an alarm in a language.

        Parameters
        ----------
        language : str
            One of `LANGUAGES`.
        code : str
            The alarm's code.
        values : mapping of str to object
            Its numbers and texts, as the loop's JSON has them.

        Returns
        -------
        SaidAlarm or None
            None where the code is not known, or a value is missing: then the loop's English is
            all there is, as of a loop that is newer than this screen.
        """
        said: list[str] = []
        for part in SaidAlarm._fields:
            template = self.sentences.get(f"alarms.{code}.{part}")
            if template is None or not gaps_of(template[language]) <= set(values):
                return None
            said.append(self._filled(language, template[language], values, of_alarm=True))
        return SaidAlarm(*said)

    def _filled(
        self, language: str, template: str, values: Mapping[str, object], *, of_alarm: bool = False
    ) -> str:
        """Return a template with its gaps filled, numbers by their format and the language."""
        shown: list[str] = []
        for literal, name, spec, _ in Formatter().parse(template):
            shown.append(literal)
            if name is not None:
                value = values[name]
                if not isinstance(value, str):
                    shown.append(number_text(value, spec or "", language))
                elif name in _NAMES or (of_alarm and name == "name"):
                    shown.append(short_names(value))
                else:
                    shown.append(self._value(language, name, value))
        return "".join(shown)

    def _value(self, language: str, name: str, value: str) -> str:
        """Return a text that stands in a gap: a phrase of its own, a number, or as it is."""
        if name in self.said or name[:-1] in self.said:
            return self.phrase(language, name, value)
        return local_number(value, language) if name.endswith(_NUMBER_ENDS) else value


def short_names(names: str) -> str:
    """Return outputs and inputs as pages name them: the unit stands beside the value."""
    return ", ".join(_UNIT_OF_NAME.sub("", name) for name in names.split(", "))


def number_text(value: object, spec: str, language: str) -> str:
    """Return a number as it is shown."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return UNKNOWN
    text = format(value, spec)
    return local_number(
        text if any(c in "123456789" for c in text) else text.lstrip("+-"), language
    )


def local_number(text: str, language: str) -> str:
    """Return a number's text with the decimal sign of a language and a true minus."""
    text = text.replace("-", "−")
    return text if language == "en" else text.replace(".", ",")


def gaps_of(template: str) -> set[str]:
    """Return the names of a template's placeholders."""
    return {name for _, name, _, _ in Formatter().parse(template) if name is not None}


def language_of(cookie: str | None, accept_language: str | None, default: str) -> str:
    """Return the language of a visitor.

    References
    ----------
    RFC 9110, 12.5.4 (Accept-Language) and 12.4.2 (weights).
    """
    if cookie in LANGUAGES:
        return cast("str", cookie)
    liked: dict[str, float] = {}
    for entry in (accept_language or "")[:_LONGEST_HEADER].split(","):
        tag, *parameters = (part.strip().lower() for part in entry.split(";"))
        language = tag.split("-")[0]
        if language in LANGUAGES:
            liked[language] = max(liked.get(language, 0.0), _weight(parameters))
    best = max(liked, key=lambda one: liked[one], default=None)
    return best if best is not None and liked[best] > 0.0 else default


def _weight(parameters: list[str]) -> float:
    """Return the weight of an entry; 0 where it is none."""
    for parameter in parameters:
        name, _, text = parameter.partition("=")
        if name.strip() == "q":
            try:
                weight = float(text)
            except ValueError:
                return 0.0
            return weight if 0.0 <= weight <= 1.0 else 0.0
    return 1.0


def _codes_of(kind: str) -> dict[str, Mapping[str, str]]:
    begin = f"{kind}-"
    return {
        key.removeprefix(begin): {one: sentence(key, language=one) for one in LANGUAGES}
        for key in keys(LANGUAGES[0])
        if key.startswith(begin)
    }


def free_text(language: str, values: Mapping[str, Value]) -> list[str]:
    """Return what of a sentence's values is free text, and so English in every language."""
    if language == LANGUAGES[0]:
        return []
    found = [text for name, text in values.items() if name in FREE_TEXT and isinstance(text, str)]
    for inner in values.values():
        if isinstance(inner, Message):
            found += free_text(language, inner.values)
    return list(dict.fromkeys(filter(None, found)))


# ---- files --------------------------------------------------------------------------------------


def _damaged(what: str, where: str) -> ConfigurationError:
    return ConfigurationError(what, where=where, remedy="Install the program again")


def _sentences_of(table: Mapping[str, object], key: str) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield the keys of a table and of those in it."""
    if "en" in table:
        yield key, _three(table, key)
        return
    for name, inner in table.items():
        if not isinstance(inner, dict):
            raise _damaged("this is no table of languages", f"{key}.{name}")
        yield from _sentences_of(cast("dict[str, object]", inner), f"{key}.{name}")


def _phrases_of(rows: object, group: str) -> dict[str, Mapping[str, str]]:
    found: dict[str, Mapping[str, str]] = {}
    for row in cast("list[object]", rows if isinstance(rows, list) else [rows]):
        if not isinstance(row, dict):
            raise _damaged("this is no table of languages", f"{_PHRASES}, {group}")
        said = _three(cast("dict[str, object]", row), f"{_PHRASES}, {group}")
        if said["en"] in found:
            raise _damaged(f"a phrase stands twice: {said['en']}", f"{_PHRASES}, {group}")
        found[said["en"]] = said
    return dict(sorted(found.items(), key=lambda one: _literal_length(one[0]), reverse=True))


def _literal_length(template: str) -> int:
    """Return how much of a template is no gap: a phrase that says more is tried first. [1]"""
    return sum(len(literal) for literal, _, _, _ in Formatter().parse(template))


def _three(table: Mapping[str, object], where: str) -> dict[str, str]:
    """Return a text in each language."""
    texts = {name: text for name, text in table.items() if isinstance(text, str) and text}
    if set(texts) != set(LANGUAGES) or len(table) != len(LANGUAGES):
        raise _damaged(f"not a text in each of {', '.join(LANGUAGES)}", where)
    return texts


def _patterns_of(phrases: Mapping[str, Mapping[str, str]]) -> Iterator[_Pattern]:
    """Yield the phrases that have gaps, those with most literal text first."""
    for english in sorted(phrases, key=_literal_length, reverse=True):
        parts = list(Formatter().parse(english))
        names = tuple(name for _, name, _, _ in parts if name is not None)
        if names:
            texts = [literal for literal, _, _, _ in parts]
            if len(texts) == len(names):
                texts.append("")
            yield _Pattern(tuple(texts), names, phrases[english])
