"""Every error has a sentence that says all its values, and every sentence an error."""

import ast
import inspect
import pickle
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from fluent.runtime import FluentResource
from fluent.syntax import ast as fluent
from fluent.syntax.visitor import Visitor

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError, DataError, MeasurementFileError, ThermaxisError
from thermaxis.messages import keys, template

ROOT = Path(__file__).parents[3] / "src" / "thermaxis"


OF_PLACE = set(inspect.signature(ThermaxisError).parameters)
"""What an error takes besides its values."""
OTHERS = {"ValueError", "PydanticCustomError", "ArgumentTypeError"}
"""Errors of others."""


class Variables(Visitor):
    def __init__(self) -> None:
        self.names: set[str] = set()

    def visit_VariableReference(self, node: fluent.VariableReference) -> None:  # noqa: N802 - as fluent calls it
        self.names.add(node.id.name)


@cache
def variables(kind: str, files: str) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for file in sorted((ROOT / "messages" / "en").glob(files)):
        for entry in FluentResource(file.read_text("utf-8")).body:
            assert not isinstance(entry, fluent.Junk), (file.name, entry.content)
            if isinstance(entry, fluent.Message):
                code = entry.id.name.removeprefix(f"{kind}-")
                assert code not in found, f"{code} stands twice"
                visitor = Variables()
                visitor.visit(entry)
                found[code] = visitor.names
    return found


def sentences_of_errors() -> dict[str, set[str]]:
    return variables("error", "errors_*.ftl")


@cache
def code() -> tuple[Counter[str], tuple[tuple[str, str, ast.Call], ...]]:
    """Return how often each text stands in the code, and file, name and node of every call."""
    texts: Counter[str] = Counter()
    calls: list[tuple[str, str, ast.Call]] = []
    for file in sorted(ROOT.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                texts[node.value] += 1
            elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.args:
                calls.append((str(file.relative_to(ROOT)), node.func.id, node))
    return texts, tuple(calls)


def codes_of(node: ast.expr) -> Iterator[str]:
    """Yield the codes that an expression may be: a text, or one of two."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    elif isinstance(node, ast.IfExp):
        yield from codes_of(node.body)
        yield from codes_of(node.orelse)


def raised() -> Iterator[tuple[str, str, set[str] | None]]:
    """Yield place, code and names of values of every call of an error's class with a code."""
    for file, name, node in code()[1]:
        if name.endswith("Error") and name not in OTHERS:
            given = {one.arg for one in node.keywords}
            known = None if None in given else {one for one in given if one} - OF_PLACE
            for said in codes_of(node.args[0]):
                if said.isidentifier():
                    yield f"{file}:{node.lineno}", said, known


def test_every_error_that_is_raised_has_a_sentence_for_all_its_values() -> None:
    sentences, every = sentences_of_errors(), list(raised())
    wrong = [
        (place, said, "no sentence" if said not in sentences else values ^ sentences[said])
        for place, said, values in every
        if said not in sentences or (values is not None and values != sentences[said])
    ]
    assert len(every) > 500
    assert wrong == []


def test_every_sentence_is_that_of_an_error_or_of_what_is_said_of_a_run() -> None:
    constants, sentences = code()[0], sentences_of_errors()
    assert [one for one in sentences if not constants[one] + constants[f"error-{one}"]] == []
    assert set(variables("", "positioning.ftl")) - set(constants) == set()


def test_an_error_is_a_code_values_and_a_place_and_reads_as_a_sentence() -> None:
    for kind in (ThermaxisError, DataError, ConfigurationError, MeasurementFileError):
        error = kind("unknown_key", name="[red]x", known=("a", "b"), place=Place("m.toml", 7))
        assert (error.code, error.values["name"], error.place.line) == ("unknown_key", "[red]x", 7)
        assert str(error) == "m.toml, line 7: '[red]x' is not a key here. Keys are a; b."
        assert str(pickle.loads(pickle.dumps(error))) == str(error)  # noqa: S301 our own
        assert str(error.at(Place(key="--axis"))).startswith("--axis: '[red]x'")


MADE = ("warning-", "flag-", "rule-")
"""Kinds of messages that a result carries."""


def test_every_message_that_is_made_has_a_sentence_and_every_sentence_is_made() -> None:
    constants, calls = code()
    made = {one for _, name, node in calls if name == "Message" for one in codes_of(node.args[0])}
    assert made - keys("en") == set()
    carried = {key for key in keys("en") if key.startswith(MADE) and "." not in key}
    assert {key for key in carried if template(key) == key} == set()
    assert {k for k in carried if not {k, k.partition("-")[2]} & constants.keys()} == set()


def test_errors_have_sentences_in_english() -> None:
    assert {key for key in keys("en") if key.startswith("error-") and "." not in key} == {
        f"error-{one}" for one in sentences_of_errors()
    }


@pytest.mark.parametrize(
    ("kind", "files", "function"),
    [
        ("finding", "findings_*.ftl", "finding"),
        ("advice", "advice_*.ftl", "advice"),
        ("remark", "remarks_*.ftl", "remark"),
        ("warning", "warnings_tables.ftl", "table_warning"),
    ],
)
def test_every_finding_has_a_sentence_for_all_its_values_and_every_sentence_a_finding(
    kind: str, files: str, function: str
) -> None:
    sentences, (constants, calls) = variables(kind, files), code()
    wrong = [
        (file, node.lineno, said)
        for file, name, node in calls
        for said in (codes_of(node.args[0]) if name == function else ())
        if sentences.get(said) != {one.arg for one in node.keywords if one.arg}
    ]
    assert wrong == []
    assert set(sentences) - constants.keys() == set()
