"""The catalogues: whole, alike in every language, and a sentence for every code."""

import re
from collections import Counter
from functools import cache
from importlib import resources

import pytest
from fluent.runtime import FluentResource
from fluent.syntax import ast
from fluent.syntax.visitor import Visitor

from thermaxis.compensation import (
    AnswerCode,
    Outcome,
    Quality,
    Reason,
    RequestKind,
    SampleQuality,
    SupervisorState,
    TouchOutcome,
)
from thermaxis.fleet import Cause
from thermaxis.messages import FREE_TEXT, LANGUAGES, keys, template
from thermaxis.runtime import ALARMS, PRIORITIES, LoopAnswer, Role
from thermaxis.thermal import FindingKind

FOLDER = resources.files("thermaxis.messages")
FILES = {
    language: {one.name for one in (FOLDER / language).iterdir() if one.name.endswith(".ftl")}
    for language in LANGUAGES
}
TRANSLATED = set.union(*(FILES[language] for language in LANGUAGES[1:]))
"""What a page of the screen shows; errors, findings and warnings of commands are English."""


CODES: dict[str, set[str]] = {
    "state": set(SupervisorState),
    "reason": set(Reason),
    "outcome": set(Outcome),
    "quality": set(SampleQuality),
    "sensor_cause": set(SampleQuality) - {"good", "redundant"},
    "model_quality": set(Quality),
    "request": set(RequestKind),
    "touch": set(TouchOutcome),
    "answer": {*AnswerCode, *LoopAnswer},
    "role": set(Role),
    "priority": set(PRIORITIES),
    "alarm": set(ALARMS),
    "log": {*FindingKind, "swapped_names"},
    "cause": set(Cause),
    "fault": set(Cause),
}


@cache
def files(language: str) -> dict[str, FluentResource]:
    """Read the files of a language."""
    folder = FOLDER / language
    return {name: FluentResource((folder / name).read_text("utf-8")) for name in FILES[language]}


class Gaps(Visitor):
    """What a message takes: its variables and functions with their options."""

    def __init__(self) -> None:
        self.variables: set[str] = set()
        self.calls: set[str] = set()
        self.selections: list[tuple[str, set[str]]] = []

    def visit_VariableReference(self, node: ast.VariableReference) -> None:  # noqa: N802 - as fluent calls it
        self.variables.add(node.id.name)

    def visit_FunctionReference(self, node: ast.FunctionReference) -> None:  # noqa: N802 - as fluent calls it
        args = [f"{one.name.name}={one.value.value}" for one in node.arguments.named]
        args += [
            one.id.name if isinstance(one, ast.VariableReference) else str(one.value)
            for one in node.arguments.positional
        ]
        self.calls.add(f"{node.id.name}({', '.join(args)})")
        self.generic_visit(node)

    def visit_SelectExpression(self, node: ast.SelectExpression) -> None:  # noqa: N802 - as fluent calls it
        forms = {one.key.name for one in node.variants if isinstance(one.key, ast.Identifier)}
        self.selections.append((node.selector.id.name, forms))
        self.generic_visit(node)


@cache
def gaps(language: str) -> dict[str, Gaps]:
    found: dict[str, Gaps] = {}
    for name, resource in files(language).items():
        for message in resource.body if name in TRANSLATED else ():
            if isinstance(message, ast.Message):
                parts = [
                    ("", message.value),
                    *((f".{a.id.name}", a.value) for a in message.attributes),
                ]
                for part, pattern in parts:
                    if pattern is not None:
                        found[message.id.name + part] = Gaps()
                        found[message.id.name + part].visit(pattern)
    return found


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_file_can_be_read_and_no_key_stands_twice(language: str) -> None:
    every = [(name, entry) for name, one in files(language).items() for entry in one.body]
    junk = [(name, entry.content) for name, entry in every if isinstance(entry, ast.Junk)]
    assert junk == []
    times = Counter(entry.id.name for _, entry in every if isinstance(entry, ast.Message))
    assert [key for key, count in times.items() if count > 1] == []
    messages = [entry for _, entry in every if isinstance(entry, ast.Message)]
    parts = {f"{entry.id.name}.{one.id.name}" for entry in messages for one in entry.attributes}
    assert keys(language) == parts | set(times)


@pytest.mark.parametrize("language", LANGUAGES[1:])
def test_every_language_says_the_same_with_the_same_values(language: str) -> None:
    assert FILES[language] == TRANSLATED
    assert {name for name in FILES["en"] if name.startswith("page")} <= TRANSLATED <= FILES["en"]
    assert gaps(language).keys() == gaps("en").keys()
    other = {
        key: (one.variables, one.calls)
        for key, one in gaps(language).items()
        if (one.variables, one.calls) != (gaps("en")[key].variables, gaps("en")[key].calls)
    }
    assert other == {}


def test_no_code_is_taken_for_free_text_which_stays_english() -> None:
    for key, one in gaps("en").items():
        codes = {c[len("CODE(") :].split(",")[0] for c in one.calls if c.startswith("CODE(")}
        assert codes.isdisjoint(FREE_TEXT), key


PLURALS = {"en": {"one", "other"}, "de": {"one", "other"}, "cs": {"one", "few", "other"}}


@pytest.mark.parametrize("language", LANGUAGES)
def test_what_is_counted_has_every_form_of_the_language(language: str) -> None:
    for key, one in gaps(language).items():
        for variable, forms in one.selections:
            assert forms == PLURALS[language], (key, variable)


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_code_has_a_sentence_and_every_sentence_a_code(language: str) -> None:
    found = keys(language)
    for kind, codes in CODES.items():
        said = {key.removeprefix(f"{kind}-") for key in found if key.startswith(f"{kind}-")}
        assert {one for one in said if "." not in one} == codes, kind
    alarms = {key for key in found if key.startswith("alarm-") and "." not in key}
    assert {f"{one}.{part}" for one in alarms for part in ("cause", "remedy")} <= found


# ---- language -----------------------------------------------------------------------------------

ALIKE = {
    "model": "the same word in Czech",
    "name": "the same word in German",
    "program": "the same word in Czech",
    "alarm": "the same word in both",
    "alarms": "the same word in Czech",
    "drift": "the same word in both",
    "details": "the same word in German",
    "start": "the same word in German",
    "status": "the same word in German",
    "position": "the same word in German",
    "export": "the same word in both",
    "offset": "the same word in both",
    "parameter": "the same word in German",
    "sensor": "the same word in German",
    "version": "the same word in German",
    "format": "the same word in German",
    "test": "the same word in both",
    "minimum": "the same word in both",
    "maximum": "the same word in both",
}
"""Words that are written alike."""
SAME = {f"common-language_{language}" for language in LANGUAGES}
"""Each language names itself."""
BARE = re.compile(r"\{\w+\}")


@cache
def texts_of(language: str) -> dict[str, str]:
    return {key: template(key, language=language) for key in keys(language)}


@pytest.mark.parametrize("language", LANGUAGES[1:])
def test_no_english_is_left_over_by_accident(language: str) -> None:
    odd: set[str] = set()
    for key, text in texts_of(language).items():
        bare = BARE.sub("", text)
        if text == texts_of("en")[key] and re.search(r"[a-z]{3}", bare) and key not in SAME:
            odd |= {key} if bare.strip(" .:,()+-0123456789").lower() not in ALIKE else set()
    assert odd == set()


@pytest.mark.parametrize("language", LANGUAGES[1:])
def test_sentences_end_as_the_english_ones_do(language: str) -> None:
    ends = (".", ":", "?")
    english = texts_of("en")
    texts = texts_of(language).items()
    odd = {key for key, text in texts if english[key].endswith(ends) != text.endswith(ends)}
    assert odd == set()


def test_no_text_has_spaces_at_its_ends_or_letters_of_another_language() -> None:
    german, czech = set("äöüßÄÖÜ"), set("áčďéěíňóřšťúůýžÁČĎÉĚÍŇÓŘŠŤÚŮÝŽ")
    foreign = {"en": german | czech, "de": czech, "cs": german - czech}
    for language in LANGUAGES:
        own = {key: text for key, text in texts_of(language).items() if key not in SAME}
        assert [key for key, text in own.items() if text != text.strip()] == []
        assert [key for key, text in own.items() if foreign[language] & set(text)] == []
