"""One name for one thing, times in hours, names as written: in the program and on pages."""

import errno
import os
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from tests.unit.screen.engineer_bench import KnownFeed, application, lathe, parts_with
from tests.unit.screen.page_script import said_by
from thermaxis.errors import ThermaxisError
from thermaxis.messages import duration_text
from thermaxis.runtime.historian import printable_cause
from thermaxis.runtime.status._alarms import _sentence
from thermaxis.screen import LANGUAGES, Words, _words
from thermaxis.screen._words import short_names
from thermaxis.screen.pages import probe_page as _probe_page

STATIC = Path(_words.__file__).parent / "static"
WORDS = Words.read()
SECONDS = (0.0, 0.4, 44.5, 59.4, 60.0, 61.0, 599.0, 600.0, 3599.0, 3600.0, 5400.0, 28_800.0, 9e5)
NAMES = ("Z_um", "T_spindle_C", "Z_um, X_um", "um", "Z_umf", "", "probe.Z_um")
SENTENCES = {
    "lathe.json: this is no model": "lathe.json: this is no model.",
    "models/lathe: gone": "models/lathe: gone.",
    "2 of 3 are there": "2 of 3 are there.",
    "node_9 is read only!": "node_9 is read only!",
    "the trim is added": "The trim is added.",
    "žádná porucha": "Žádná porucha.",
    "": "",
}
ENGLISH = (
    ("reason", "input_bad"),
    ("quality", "too_fast"),
    ("request", "hold"),
    ("left_out", "expansion coefficient: not stated in the budget"),
)
SCRIPT = """
import { readFileSync } from "node:fs";
const given = JSON.parse(readFileSync(0, "utf8"));
const texts = { words: { textContent: JSON.stringify(given.texts) } };
globalThis.document = {
  documentElement: { lang: given.language },
  getElementById: (id) => texts[id] ?? null,
  addEventListener: () => {},
};
const { asSentence, duration, phrase, shortNames } = await import(given.words);
const { labelOf } = await import(given.series);
console.log(JSON.stringify([
  given.seconds.map(duration),
  given.names.map(shortNames),
  given.sentences.map(asSentence),
  given.english.map(([group, text]) => phrase(group, text)),
  given.labels.map(labelOf),
]));
"""
LABELS = {
    "T_spindle_C": "T_spindle",
    "T_spindle_C.redundant": "T_spindle.redundant",
    "Z_um.correction": f"Z {WORDS.say('en', 'history.correction')}",
    "probe.Z_um": f"Z {WORDS.say('en', 'history.probe')}",
    "Z_um.part.a_um": f"Z {WORDS.say('en', 'history.part', name='a_um')}",
    "Z_um.of_the_future": "Z.of_the_future",
}


def by_script(language: str) -> list[list[str]]:
    given: dict[str, Any] = {
        "language": language,
        "texts": {"words": WORDS.catalog(language), "phrases": WORDS.phrases(language)},
        "words": (STATIC / "words.js").as_uri(),
        "series": (STATIC / "history_series.js").as_uri(),
        "seconds": SECONDS,
        "names": NAMES,
        "sentences": list(SENTENCES),
        "english": ENGLISH,
        "labels": list(LABELS),
    }
    return said_by(SCRIPT, given)


@pytest.mark.system
@pytest.mark.parametrize("language", LANGUAGES)
def test_pages_and_program_say_times_and_names_alike(language: str) -> None:
    times, names, sentences, phrases, labels = by_script(language)
    assert times == [duration_text(time_s) for time_s in SECONDS]
    assert names == [short_names(name) for name in NAMES]
    assert sentences == list(SENTENCES.values())
    assert phrases == [WORDS.phrase(language, group, text) for group, text in ENGLISH]
    if language == "en":
        assert labels == list(LABELS.values())


def test_a_time_is_told_in_the_units_that_people_read() -> None:
    said = [duration_text(time_s).replace("\N{NO-BREAK SPACE}", " ") for time_s in SECONDS]
    assert said == [
        *("0 s", "0 s", "45 s", "59 s", "1 min", "1 min 1 s", "9 min 59 s", "10 min"),
        *("59 min", "1 h", "1 h 30 min", "8 h", "10 d 10 h"),
    ]


def test_the_probes_of_a_page_are_named_as_everywhere_and_asked_for_by_their_own_name() -> None:
    parts = parts_with(lathe(), KnownFeed(None))
    page = TestClient(application(parts, _probe_page.routes(parts))).get("/probe").text
    assert '<option value="Z_um">Z</option>' in page


@pytest.mark.parametrize(("text", "said"), [(a, b) for a, b in SENTENCES.items() if a])
def test_a_finding_of_the_self_test_keeps_the_name_that_it_begins_with(
    text: str, said: str
) -> None:
    assert _sentence(text) == said


def test_no_kind_of_an_error_reaches_people_with_what_the_history_says() -> None:
    assert printable_cause(OSError("disk I/O error\nat row 3")) == "disk I/O error"
    assert printable_cause(KeyError("FURTHER")) == "'FURTHER' is missing"
    assert len(printable_cause(ValueError("x" * 5000))) == 300


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (TimeoutError(), "it took too long"),
        (ConnectionResetError(), "the connection was cut by the other side"),
        (ConnectionRefusedError(), "the connection was refused"),
        (BrokenPipeError(" \n"), "the other side has closed the connection"),
        (MemoryError(), "there is not enough memory"),
        (ValueError(), "ValueError without a text"),
        (KeyError(), "KeyError without a text"),
    ],
)
def test_an_error_without_a_text_is_told_by_its_kind(error: BaseException, said: str) -> None:
    assert printable_cause(error) == said


def test_the_place_of_a_file_is_not_told_to_whoever_looks(tmp_path: Path) -> None:
    place = tmp_path / "secret-folder" / "history.sqlite"
    with pytest.raises(OSError, match="secret-folder") as raised:
        place.open()
    assert printable_cause(raised.value) == os.strerror(errno.ENOENT)
    denied = PermissionError(errno.EACCES, "Permission denied", str(place), None, "/elsewhere")
    assert printable_cause(denied) == "Permission denied"
    assert printable_cause(ThermaxisError("it is torn", where=str(place))) == "it is torn"
