"""Problems of a configuration, findings and failures: every code has a sentence for its values."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from thermaxis.messages import LANGUAGES, keys, sentence

KINDS = {
    "problem": "error",
    "add": "error",
    "refused": "error",
    "_fault": "error",
    "ok": "self_test",
    "warning": "self_test",
    "error": "self_test",
    "advice": "advice",
}
"""Functions of the runtime that make a message, and the kind of its code."""


def made(root: Path) -> Iterator[tuple[str, str, set[str]]]:
    """Yield place, key and names of values of every message that is made with a plain code."""
    for file in sorted((root / "src" / "thermaxis" / "runtime").rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.Call) or not node.args:
                continue
            name = getattr(node.func, "id", getattr(node.func, "attr", ""))
            code, given = node.args[0], {one.arg for one in node.keywords}
            if name in KINDS and isinstance(code, ast.Constant) and None not in given:
                key = f"{KINDS[name]}-{code.value}"
                yield f"{file.name}:{node.lineno}", key, {one for one in given if one} - {"place"}


def test_every_message_of_the_runtime_has_a_sentence_that_says_all_its_values(root: Path) -> None:
    every = [one for one in made(root) if one[1] in keys("en")]
    assert len(every) > 70
    for place, key, names in every:
        values = {name: f"<{name}>" for name in names}
        said = sentence(key, values)
        if f"{key}.remedy" in keys("en"):
            said += sentence(f"{key}.remedy", values)
        assert key not in said, place
        for name in names:
            assert f"<{name}>" in said or "–" in said, (place, name)


@pytest.mark.parametrize("language", LANGUAGES)
def test_what_forbids_a_correction_can_be_said_with_what_to_do(language: str) -> None:
    every = {key for key in keys("en") if key.startswith("self_test-")}
    assert len(every) > 50
    assert every <= keys(language)
