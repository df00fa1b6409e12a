"""What the scripts of the pages say in the same way as the server does."""

import json
from pathlib import Path
from typing import Any

from tests.unit.screen.page_script import said_by
from thermaxis.screen import _words
from thermaxis.screen._words import FREE_TEXT

STATIC = Path(_words.__file__).parent / "static"
BENCH = """
const texts = {
  "operator-facts": "{}",
  words: JSON.stringify({ phrases: { reason: GIVEN } }),
};
globalThis.document = {
  documentElement: { lang: "en" },
  getElementById: (id) => ({ textContent: texts[id] }),
};
const { FREE_TEXT } = await import("file://STATIC/english.js");
const { reasonsSaid } = await import("file://STATIC/operator_parts.js");
process.stdout.write(JSON.stringify((() => { BODY })()));
"""


def said(body: str, reasons: dict[str, str] | None = None) -> Any:
    """Return what a script says that has the modules' functions."""
    text = BENCH.replace("STATIC", str(STATIC)).replace("GIVEN", json.dumps(reasons or {}))
    return said_by(text.replace("BODY", body))


def test_the_gaps_of_free_text_are_the_same_in_the_page_and_in_the_server() -> None:
    assert set(said("return FREE_TEXT;")) == FREE_TEXT


def test_a_reason_that_begins_with_a_name_keeps_its_first_letter() -> None:
    reasons = {"x": "model.json does not fit", "y": "an operator holds it", "z": "Wait!"}
    assert said("return reasonsSaid({ reasons: ['x', 'y', 'z'] });", reasons) == [
        "model.json does not fit.",
        "An operator holds it.",
        "Wait!",
    ]
