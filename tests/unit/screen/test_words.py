"""The words of the screen: complete in three languages, used, and true to what the loop says."""

import json
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from string import Formatter
from typing import Any

import pytest
from hypothesis import given, strategies as st

from tests.unit.screen.page_script import said_by
from thermaxis.compensation import (
    SampleQuality,
    SupervisorState,
)
from thermaxis.errors import ConfigurationError
from thermaxis.messages import alarm_sentences
from thermaxis.runtime import AlarmCode, Role
from thermaxis.screen import LANGUAGES, Words, _words
from thermaxis.screen._words import (
    SaidAlarm,
    gaps_of,
    language_of,
    local_number,
    number_text,
)

PAGES = ("operator", "model", "sensors", "history", "probe", "positioning")
SCREEN = Path(_words.__file__).parent
RUNTIME = SCREEN.parent / "runtime"
WORDS = Words.read()
FOREIGN = ("de", "cs")

SAME = {
    "common.language_en": "each language names itself",
    "common.language_de": "each language names itself",
    "common.language_cs": "each language names itself",
}
"""Keys whose words are the same in several languages, and why, beside the words of `ALIKE`."""
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

COMPOSED = {
    "common.page_": (
        (*PAGES, "login"),
        "the page's name from its address",
    ),
    "common.language_": (LANGUAGES, "one entry for each language"),
    "history.length_": (
        ("1h", "8h", "1d", "7d", "30d", "all"),
        "the lengths of a span that the page's template lists",
    ),
    "operator.state_": (
        tuple(state.value.lower() for state in SupervisorState),
        "the state that the loop tells",
    ),
    "common.role_": (tuple(Role), "the role of a log-in"),
    "alarms.": (
        tuple(f"{code}.{part}" for code in AlarmCode for part in SaidAlarm._fields),
        "the alarm's code",
    ),
}
"""Keys that are put together at run time: their beginning, how they end, and from what."""


# ---- completeness -------------------------------------------------------------------------------


def every_text() -> Iterator[tuple[str, dict[str, str]]]:
    for key, said in WORDS.sentences.items():
        yield key, dict(said)
    for group, phrases in WORDS.said.items():
        for english, said in phrases.items():
            yield f"{group}: {english}", dict(said)


TEXTS = dict(every_text())


def gaps_with_formats(template: str) -> Counter[tuple[str, str]]:
    parts = Formatter().parse(template)
    return Counter((name, spec or "") for _, name, spec, _ in parts if name is not None)


@pytest.mark.parametrize("language", FOREIGN)
def test_every_text_has_the_same_gaps_with_the_same_formats_in_every_language(
    language: str,
) -> None:
    wrong = [
        key
        for key, said in TEXTS.items()
        if gaps_with_formats(said[language]) != gaps_with_formats(said["en"])
    ]
    assert wrong == []


def test_gaps_are_plain_names_with_few_formats_that_a_script_can_fill() -> None:
    for key, said in TEXTS.items():
        for text in said.values():
            for _, name, spec, conversion in Formatter().parse(text):
                if name is None:
                    continue
                assert name.isidentifier(), key
                assert conversion is None, key
                assert spec in {"", ".0f", ".1f", "+.1f"}, key


@pytest.mark.parametrize("language", FOREIGN)
def test_no_english_is_left_over_by_accident(language: str) -> None:
    same = {
        key: said["en"]
        for key, said in TEXTS.items()
        if said[language] == said["en"] and re.search(r"[a-z]{3}", strip_gaps(said["en"]))
    }
    odd = {
        key
        for key, text in same.items()
        if key not in SAME and strip_gaps(text).strip(" .:,()+-0123456789").lower() not in ALIKE
    }
    assert odd == set()


def strip_gaps(text: str) -> str:
    return "".join(literal for literal, *_ in Formatter().parse(text))


@pytest.mark.parametrize("language", FOREIGN)
def test_sentences_end_as_the_english_ones_do(language: str) -> None:
    ends = {
        key: (said["en"][-1], said[language][-1])
        for key, said in TEXTS.items()
        if said["en"].endswith((".", ":", "?")) != said[language].endswith((".", ":", "?"))
    }
    assert ends == {}


def test_no_text_has_spaces_at_its_ends_or_signs_that_cannot_be_shown() -> None:
    texts = [(key, text) for key, said in TEXTS.items() for text in said.values()]
    assert [key for key, text in texts if text != text.strip()] == []
    # a number may be kept together with its unit
    assert [key for key, text in texts if not text.replace("\u00a0", " ").isprintable()] == []


def test_the_languages_use_letters_of_their_own_and_of_no_other() -> None:
    german, czech = set("äöüßÄÖÜ"), set("áčďéěíňóřšťúůýžÁČĎÉĚÍŇÓŘŠŤÚŮÝŽ")
    own = {key: said for key, said in TEXTS.items() if key not in SAME}
    assert [key for key, said in own.items() if czech & set(said["de"])] == []
    assert [key for key, said in own.items() if (german - czech) & set(said["cs"])] == []


# ---- use ----------------------------------------------------------------------------------------

AREAS = {key.split(".")[0] for key in WORDS.sentences} | set(PAGES)
KEY = re.compile(rf"""["'`]((?:{"|".join(sorted(AREAS))})\.[a-z0-9_]*)(["'`]|\$?\{{)( ?[~+])?""")
FILES = [
    *sorted(SCREEN.rglob("*.py")),
    *sorted(SCREEN.glob("pages/*.html")),
    *sorted(SCREEN.glob("static/*.js")),
]
NO_KEYS = {"js", "css", "html", "toml", "json"}
"""Endings of files, whose names look like keys."""
NO_BEGINNINGS = {"probe.": "names of signals", "history.": "names of exported files"}
"""What begins as a key does, and is none."""


def named_in_sources() -> tuple[dict[str, set[str]], dict[str, set[str]]]:
    """Return keys, and beginnings of keys, with the files that name them."""
    keys: dict[str, set[str]] = {}
    beginnings: dict[str, set[str]] = {}
    for file in FILES:
        for key, end, joined in KEY.findall(file.read_text("utf-8")):
            if key.split(".")[1] in NO_KEYS:
                continue
            if key in NO_BEGINNINGS:
                continue
            begins = end.endswith("{") or (joined and key.endswith(("_", ".")))
            (beginnings if begins else keys).setdefault(key, set()).add(file.name)
    return keys, beginnings


NAMED, BEGUN = named_in_sources()


def test_every_key_that_a_page_or_a_script_names_has_words() -> None:
    assert {key: files for key, files in NAMED.items() if key not in WORDS.sentences} == {}


def test_every_composed_key_is_declared_with_how_it_ends_and_has_words() -> None:
    assert {begun: files for begun, files in BEGUN.items() if begun not in COMPOSED} == {}
    keys = [f"{begun}{end}" for begun, (ends, _) in COMPOSED.items() for end in ends]
    assert [key for key in keys if key not in WORDS.sentences] == []


def test_every_group_of_phrases_that_a_script_names_exists() -> None:
    groups = {
        group
        for file in FILES
        for group in re.findall(r"""\bphrase\((?:\w+, )?["'](\w+)["']""", file.read_text("utf-8"))
    }
    assert groups >= {"reason", "quality"}
    assert groups <= set(WORDS.said)


def test_every_key_is_used_somewhere() -> None:
    composed = {f"{begun}{end}" for begun, (ends, _) in COMPOSED.items() for end in ends}
    assert sorted(set(WORDS.sentences) - set(NAMED) - composed) == []


@pytest.mark.parametrize("language", FOREIGN)
def test_what_an_uncertainty_is_without_is_translated(language: str) -> None:
    source = (SCREEN.parent / "positioning" / "uncertainty" / "_uncertainty.py").read_text("utf-8")
    terms = (
        "instrument and environment: no budget was given",
        "environmental variation: it would count the drift twice",
        "environmental variation: not stated in the budget",
        "scatter: one reading does not tell it",
        "drift: it is not known",
    )
    for term in terms:
        assert f'"{term}"' in source
        assert WORDS.phrase(language, "left_out", term) != term
    said = WORDS.phrase(language, "left_out", "expansion coefficient: not stated in the budget")
    assert WORDS.phrase(language, "term", "expansion coefficient") in said
    assert "expansion" not in said


# ---- alarms -------------------------------------------------------------------------------------

ALARM_WORDS = {
    str(code): SaidAlarm(*(WORDS.sentences[f"alarms.{code}.{p}"]["en"] for p in SaidAlarm._fields))
    for code in AlarmCode
}
"""English words of every alarm, with their gaps."""
ALARM_VALUES: dict[str, float | str] = {
    "name": "Z_um",
    "acts_on": "Z_um",
    "quality": SampleQuality.TOO_FAST.value,
    "sensor_cause": SampleQuality.TOO_FAST.value,
    "status": "Good",
    "finding": "The node is read only.",
    "file": "a.state.json",
    "failure": "the disk is full",
    "hold": 5.0,
    "hold_unit": "min",
    "left": 30.0,
    "left_unit": "s",
}


@given(
    st.sampled_from(sorted(ALARM_WORDS)),
    st.floats(min_value=-1e6, max_value=1e6, allow_nan=False),
    st.sampled_from(LANGUAGES),
)
def test_an_alarm_filled_here_is_the_one_of_the_catalogues(
    code: str, number: float, language: str
) -> None:
    names = gaps_of("".join(ALARM_WORDS[code]))
    values = {name: ALARM_VALUES.get(name, number) for name in names}
    values |= {name: round(number) for name in names & {"lost", "waiting"}}
    values["quality"] = SampleQuality.TOO_FAST.value
    if code == "history_lost":  # the catalogue counts, which a page's words do not
        return
    said = WORDS.alarm(language, code, json.loads(json.dumps(values)))
    assert said == alarm_sentences(code, values, language=language)


@pytest.mark.parametrize("language", FOREIGN)
def test_every_alarm_is_said_in_every_language_with_every_number_of_it(language: str) -> None:
    for code, words in ALARM_WORDS.items():
        names = gaps_of("".join(words))
        values = {name: ALARM_VALUES.get(name, -1234.5) for name in names}
        said = WORDS.alarm(language, code, values)
        assert said is not None
        for sentence, english in zip(said, words, strict=True):
            numbers = gaps_of(english) - set(ALARM_VALUES)
            assert len(re.findall("−1234(?:,5)?", sentence)) == len(numbers)
            assert sentence.isprintable()
            assert sentence != english or english == "{failure}"


WORDS_BY_SCRIPT = """
import { readFileSync } from "node:fs";
const given = JSON.parse(readFileSync(0, "utf8"));
const texts = { words: { textContent: JSON.stringify(given.texts) } };
globalThis.document = {
  documentElement: { lang: given.language },
  getElementById: (id) => texts[id] ?? null,
  addEventListener: () => {},
};
const { alarmWords, number, phrase, signed } = await import(given.script);
const said = (given.alarms ?? []).map(alarmWords).map((one) => [one.text, one.cause, one.remedy]);
const phrases = (given.english ?? []).map(([group, english]) => phrase(group, english));
const three = (one) => [number(one, 0), number(one, 1), signed(one, 1)];
const numbers = (given.numbers ?? []).map(three);
console.log(JSON.stringify(given.english ? [phrases, numbers] : said));
"""


@pytest.mark.system
@pytest.mark.parametrize("language", LANGUAGES)
def test_the_script_of_a_page_says_every_alarm_as_this_program_does(language: str) -> None:
    alarms: list[dict[str, Any]] = []
    for number in (-12.34, 0.0, 7.06, None):
        for code, words in ALARM_WORDS.items():
            names = gaps_of("".join(words))
            alarms.append(
                {"code": code, "values": {name: ALARM_VALUES.get(name, number) for name in names}}
            )
    alarms.append({"code": "of the future", "text": "New.", "cause": "Old.", "remedy": "Wait."})
    code = next(code for code in sorted(ALARM_WORDS) if gaps_of("".join(ALARM_WORDS[code])))
    alarms.append({"code": code, "values": {}, "text": "A.", "cause": "B.", "remedy": "C."})
    assert WORDS.alarm(language, code, {}) is None
    given = {
        "language": language,
        "texts": {"words": WORDS.catalog(language), "phrases": WORDS.phrases(language)},
        "script": (SCREEN / "static" / "words.js").as_uri(),
        "alarms": alarms,
    }
    *by_script, future, short = said_by(WORDS_BY_SCRIPT, given)
    assert future == ["New.", "Old.", "Wait."]
    assert short == ["A.", "B.", "C."]  # a value is missing
    for alarm, said in zip(alarms, by_script, strict=False):
        here = WORDS.alarm(language, alarm["code"], alarm["values"])
        assert here is not None
        assert said == list(here)


def test_an_alarm_has_decimal_sign_and_minus_of_the_language() -> None:
    values = {"name": "Z_um", "correction_um": -12.5}
    german, english = (
        WORDS.alarm("de", "standing_offset", values),
        WORDS.alarm("en", "standing_offset", values),
    )
    assert german is not None
    assert english is not None
    assert "−12,5 µm" in german.text
    assert "−12.5 µm" in english.text


def test_a_number_that_is_not_known_is_a_dash() -> None:
    said = WORDS.alarm("cs", "standing_offset", {"name": "Z_um", "correction_um": None})
    assert said is not None
    assert said.text == "V Z zůstává posun – µm a kompenzace je vypnuta."


def test_an_alarm_of_a_newer_loop_is_left_in_its_english() -> None:
    assert WORDS.alarm("de", "of the future", {}) is None
    assert WORDS.alarm("de", "limit", {"name": "Z_um"}) is None
    assert WORDS.alarm("de", "", {}) is None


def test_a_name_that_looks_like_a_gap_stays_a_name() -> None:
    said = WORDS.alarm("de", "sensor_unread", ALARM_VALUES | {"name": "{hold}{0.x}"})
    assert said is not None
    assert said.text == "Sensor {hold}{0.x}: der Wert ist gesprungen."


# ---- the class ----------------------------------------------------------------------------------


def test_words_are_filled_and_a_missing_key_is_named() -> None:
    assert WORDS.say("de", "common.no_data_since", time="06:00") == "KEINE DATEN seit 06:00"
    with pytest.raises(KeyError, match=r"operator\.no_such_key"):
        WORDS.say("de", "operator.no_such_key")
    with pytest.raises(KeyError, match="time"):
        WORDS.say("de", "common.no_data_since")
    with pytest.raises(KeyError, match="fr"):
        WORDS.say("fr", "common.log_in")


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_catalogue_of_a_page_has_every_key_and_phrase(language: str) -> None:
    catalog = WORDS.catalog(language)
    assert set(catalog) == set(WORDS.sentences)
    assert catalog["common.log_in"] == WORDS.say(language, "common.log_in")
    phrases = WORDS.phrases(language)
    assert phrases["state"]["Off"] == WORDS.phrase(language, "state", "Off")
    assert json.loads(json.dumps(phrases)) == phrases


def test_patterns_of_a_group_come_with_the_one_that_says_most_first() -> None:
    for phrases in (WORDS.phrases("de")["left_out"],):
        lengths = [len(strip_gaps(english)) for english in phrases]
        assert lengths == sorted(lengths, reverse=True)


@pytest.mark.parametrize(
    ("content", "what"),
    [
        ("[hold]\nen = 'Hold'\nde = 'Halten'\n", "not a text in each"),
        ("[hold]\nen = 'Hold'\nde = 'Halten'\ncs = ''\n", "not a text in each"),
        ("[hold]\nen = 'Hold'\nde = 'Halten'\ncs = 'x'\nfr = 'x'\n", "not a text in each"),
        ("hold = 'Hold'\n", "no table of languages"),
        ("[hold\n", "no TOML"),
        ("[hold]\nen = 'a'\n[hold]\nen = 'b'\n", "no TOML"),
    ],
)
def test_a_damaged_file_of_words_is_told_by_its_place(
    content: str, what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "words"
    folder.mkdir()
    (folder / "odd.toml").write_text(content, "utf-8")
    monkeypatch.setattr(_words.resources, "files", lambda _: tmp_path)
    with pytest.raises(ConfigurationError, match=what) as told:
        Words.read()
    assert "odd" in told.value.where


def test_a_phrase_that_stands_twice_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "words"
    folder.mkdir()
    one = "[[state]]\nen = 'Off'\nde = 'Aus'\ncs = 'Vypnuto'\n"
    (folder / "phrases.toml").write_text(one + one, "utf-8")
    monkeypatch.setattr(_words.resources, "files", lambda _: tmp_path)
    with pytest.raises(ConfigurationError, match="twice"):
        Words.read()


@pytest.mark.parametrize(
    ("cookie", "header", "language"),
    [
        (None, None, "en"),
        (None, "", "en"),
        ("cs", "de", "cs"),
        ("fr", "de", "de"),
        (None, "de-AT,de;q=0.9,en;q=0.8", "de"),
        (None, "en;q=0.2, cs ; q = 0.7", "cs"),
        (None, "fr, sk;q=0.9, cs;q=0.4, de;q=0.3", "cs"),
        (None, "de;q=0, cs;q=0.1", "cs"),
        (None, "de;q=0", "en"),
        (None, "de, de-AT;q=0.1, cs;q=0.5", "de"),
        (None, "de;q=x, cs;q=2", "en"),
        (None, "de,cs", "de"),
        (None, "DE-ch", "de"),
        (None, "den", "en"),
        (None, "*;q=0.5", "en"),
        (None, "," * 10_000 + "de", "en"),
        (None, "de;q=nan", "en"),
    ],
)
def test_the_language_is_the_chosen_one_else_what_the_browser_likes_best(
    cookie: str | None, header: str | None, language: str
) -> None:
    assert language_of(cookie, header, "en") == language


@given(st.text(max_size=60), st.sampled_from(LANGUAGES))
def test_no_header_breaks_the_choice_of_a_language(header: str, default: str) -> None:
    assert language_of(header, header, default) in LANGUAGES


@pytest.mark.parametrize(
    ("value", "spec", "language", "shown"),
    [
        (1.25, "+.1f", "en", "+1.2"),
        (-0.75, "+.1f", "de", "−0,8"),
        (3, ".0f", "cs", "3"),
        (-0.04, "+.1f", "cs", "0,0"),
        (0.0, "+.1f", "en", "0.0"),
        (float("nan"), ".1f", "en", "–"),
        (float("inf"), ".1f", "en", "–"),
        (None, ".1f", "de", "–"),
        (True, ".1f", "de", "–"),
    ],
)
def test_numbers_are_shown_as_the_language_writes_them(
    value: object, spec: str, language: str, shown: str
) -> None:
    assert number_text(value, spec, language) == shown


@given(st.floats(allow_nan=False, allow_infinity=False, width=32))
def test_a_local_number_is_the_same_number(value: float) -> None:
    for language in LANGUAGES:
        text = local_number(f"{value:.3f}", language)
        assert float(text.replace("−", "-").replace(",", ".")) == float(f"{value:.3f}")


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_script_of_a_page_says_every_phrase_and_number_as_this_program_does(
    language: str,
) -> None:
    english: list[tuple[str, str]] = []
    for group, phrases in WORDS.said.items():
        for one in phrases:
            names = gaps_of(one)
            for value in ("", "-2.5", "Z_um", "an operator holds it", "a {gap}", "x" * 3000):
                filled = one.format_map(dict.fromkeys(names, value))
                english += [(group, filled)]
        english += [(group, text) for text in ("", "constructor", "toString", "something new")]
    numbers = [-2.5, -0.5, -0.05, -0.04, 0.0, 0.25, 0.35, 0.5, 1.5, 2.5, 12.25, 1e9, None]
    given = {
        "language": language,
        "texts": {"words": WORDS.catalog(language), "phrases": WORDS.phrases(language)},
        "script": (SCREEN / "static" / "words.js").as_uri(),
        "english": english,
        "numbers": numbers,
    }
    phrases_said, numbers_said = said_by(WORDS_BY_SCRIPT, given)
    wrong = [
        (group, one, said, WORDS.phrase(language, group, one))
        for (group, one), said in zip(english, phrases_said, strict=True)
        if said != WORDS.phrase(language, group, one)
    ]
    assert wrong == []
    assert numbers_said == [
        [number_text(one, spec, language) for spec in (".0f", ".1f", "+.1f")] for one in numbers
    ]
