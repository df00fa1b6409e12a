"""What pages say: every key has a sentence, English is marked, scripts write as the server."""

import re
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from hypothesis import given, strategies as st

from tests.unit.screen.feed_parts import text_of
from tests.unit.screen.page_script import said_by
from tests.unit.screen.stand import Somebody
from thermaxis.app.axis._forms import forms
from thermaxis.board import Need
from thermaxis.codes import Message
from thermaxis.files.settings import HEADER_GROUPS
from thermaxis.fleet import Cause, NightOutcome
from thermaxis.messages import (
    ISOLATE,
    LANGUAGES,
    duration_text,
    isolated,
    keys,
    number_text,
    sentence,
    short_names,
    template,
)
from thermaxis.positioning import FIGURE_KEYS
from thermaxis.runtime import EventRecord, Role
from thermaxis.screen.access import Answer, Outcome
from thermaxis.screen.feed import parse_status, said_status
from thermaxis.screen.pages.history import said_event
from thermaxis.web import asset_folder, language_of, modules_of, sentences_of

STATIC = asset_folder()
NOW = datetime(2026, 11, 20, tzinfo=UTC)
FINDING = "The server does not know the node. Look at the address."
PAGES = ("operator", "model", "sensors", "history", "probe", "positioning", "thermal", "login")

# ---- use ----------------------------------------------------------------------------------------

HEADLINES = [key.removeprefix("headline-") for key in keys("en") if key.startswith("headline-")]
COMPOSED = {
    "common-page_": (*PAGES, "fleet"),
    "common-language_": LANGUAGES,
    "history-length_": ("1h", "8h", "1d", "7d", "30d", "all"),
    "positioning-": ("head", "limits", "budget"),
    "positioning-decimal_": ("point", "comma"),
    "positioning-date_order_": ("day", "month", "year"),
    "positioning-figure_": tuple(key.lower() for key in FIGURE_KEYS),
    "positioning-cycle_": ("standard", "pilgrim", "step"),
    "positioning-rule_": ("simple", "iso14253"),
    "positioning-drift_": ("none", "line", "smooth"),
    "positioning-picture_": (
        *("run", "trend", "plan", "log", "model"),
        *("run_more", "trend_more", "plan_more", "log_more", "model_more"),
    ),
    "room-step_": (
        *("waiting", "reading", "checking", "identifying", "simulating", "joining", "report"),
    ),
    "form-": (
        *(table for tables in forms().values() for table in tables),
        *(
            f"{table}_{key}"
            for tables in forms().values()
            for table, fields in tables.items()
            for key, _, _ in fields
            if table != "limits" or key == "decision_rule"
        ),
    ),
    "thermal-line_": ("measured", "simulated", "residual"),
    "thermal-method_": ("modal", "oe", "arx", "averages", "static"),
    "thermal-take_": ("model", "pdf", "html", "json", "plc"),
    "thermal-plc_": ("cycle_s", "limit", "rate", "plausible"),
    "positioning-download_": ("page", "dcc", "charts", "csv", "json"),
    "operator-": ("critical", "high", "medium", "low"),
    "operator-look_": [look for look in HEADLINES if f"operator-look_{look}" in keys("en")],
    "common-role_": tuple(Role),
    "fleet-need_": set(Need) - {Need.NAMED},
    "cause-": tuple(Cause),
    "fleet-do_": ("set_aside", "no_night", "proposal"),
    "fleet-outcome_": (*NightOutcome, "none"),
    "fleet-mark_": ("model", "proposed", "accepted", "rejected"),
}
"""Keys that are put together at run time: their beginnings, and how they end."""
KINDS = (
    "app",
    "ask",
    "cause",
    "chart",
    "common",
    "feed",
    "fleet",
    "form",
    "history",
    "login",
    "model",
    "operator",
    "positioning",
    "room",
    "thermal",
)
OF_PAGES = {key for key in keys("en") if key.split("-")[0] in {*KINDS, "probe", "sensors"}}
KEY = re.compile(r"""["'`]([a-z]+-[a-z0-9_]*)["'`]""")
SAID = re.compile(r"""\bword\(\s*["'`]([a-z]+-[a-z0-9_]*)["'`]""")
FILES = [
    path
    for name in ("app", "board", "screen", "web")
    for path in (STATIC.parents[1] / name).rglob("*")
    if path.suffix in {".py", ".html", ".js"}
]


def test_every_key_that_a_page_names_has_a_sentence_and_every_sentence_is_named() -> None:
    texts = [file.read_text("utf-8") for file in FILES]
    said = {key for text in texts for key in SAID.findall(text)}
    named = {key for text in texts for key in KEY.findall(text)}
    composed = {f"{begin}{end}" for begin, ends in COMPOSED.items() for end in ends}
    assert said - set(COMPOSED) - OF_PAGES == set()
    assert OF_PAGES - named - composed == set()
    assert composed <= OF_PAGES


def test_a_form_asks_in_english_what_the_certificate_says() -> None:
    for group in HEADER_GROUPS:
        assert sentence(f"form-{group.name}") == group.title
        for one in group.fields:
            assert sentence(f"form-{group.name}_{one.name}") == one.label


def test_the_scripts_know_no_language() -> None:
    for file in STATIC.rglob("*.js"):
        text = re.sub(r"//.*|/\*.*?\*/", "", file.read_text("utf-8"), flags=re.DOTALL)
        assert not re.search(
            r"""["'](en|de|cs)(-[A-Z]{2})?["']""", text.replace('.lang = "en"', "")
        )


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_script_gets_its_sentences_with_names_for_what_it_fills_in(language: str) -> None:
    found = sentences_of(modules_of("operator/operator.js"), language)
    assert found["operator-since"] == template("operator-since", language=language)
    assert not [key for key in found if key.startswith("positioning-")]
    assert "{time}" in found["operator-since"]
    assert not [key for key, text in found.items() if ISOLATE in text or text == key]


# ---- the language of a visitor ------------------------------------------------------------------


def test_the_language_is_the_chosen_one_else_what_the_browser_likes_best() -> None:
    for cookie, header, language in (
        (None, None, "en"),
        ("cs", "de", "cs"),
        ("fr", "de", "de"),
        (None, "en;q=0.2, cs ; q = 0.7", "cs"),
        (None, "fr, sk;q=0.9, cs;q=0.4, de;q=0.3", "cs"),
        (None, "de;q=0, cs;q=0.1", "cs"),
        (None, "de, de-AT;q=0.1, cs;q=0.5", "de"),
        (None, "de;q=x, cs;q=2", "en"),
        (None, "DE-ch", "de"),
        (None, "den", "en"),
        (None, "," * 10_000 + "de", "en"),
        (None, "de;q=nan", "en"),
    ):
        assert language_of(cookie, header, "en") == language, (cookie, header)


@given(st.text(max_size=60), st.sampled_from(LANGUAGES))
def test_no_header_breaks_the_choice_of_a_language(header: str, default: str) -> None:
    assert language_of(header, header, default) in LANGUAGES


# ---- what the loop says -------------------------------------------------------------------------


def status(**changes: object) -> dict[str, Any]:
    found = dict(parse_status(text_of()))
    return {**found, **changes}


def alarm(code: str, **values: object) -> dict[str, Any]:
    english = {"text": "of tomorrow", "cause": "a cause", "remedy": ""}
    return {"code": code, "priority": "high", "since": "", "values": values, **english}


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_status_says_its_codes_in_the_language_of_the_page(language: str) -> None:
    inputs = {"T_spindle_C": {"quality": "too_fast", "value_c": None}}
    found = said_status(
        status(
            state="Holding",
            reasons=["input_bad"],
            inputs=inputs,
            alarms=[alarm("late", lateness_s=1.5)],
            outputs={"Z_um": {"touch_outcome": "excluded"}, "X_um": {"touch_outcome": ""}},
        ),
        language,
    )
    touched, not_touched = found["outputs"].values()
    assert touched["touch_said"] == sentence("touch-excluded", language=language)
    assert "touch_said" not in not_touched
    assert found["state_said"] == sentence("state-Holding", language=language)
    reason = sentence("reason-input_bad", language=language)
    assert found["reasons_said"] == [f"{reason[0].upper()}{reason[1:]}."]
    assert found["inputs"]["T_spindle_C"]["quality_said"] == sentence(
        "quality-too_fast", language=language
    )
    (late,) = found["alarms"]
    assert late["text"] == sentence("alarm-late", {"lateness_s": 1.5}, language=language)
    assert late["priority_said"] == sentence("operator-high", language=language)
    assert (late["code"], late["priority"], late["values"]) == ("late", "high", {"lateness_s": 1.5})


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_state_has_one_word_on_all_pages_that_of_its_cause_if_it_has_one(language: str) -> None:
    for code, word in (
        ("interlock", "operator-look_interlock"),
        ("not_released", "operator-look_interlock"),
        ("held_by_person", "state-Fading"),
        ("of_tomorrow", "state-Fading"),
    ):
        told = status(state="Fading", headline={"code": f"headline-{code}", "values": {}})
        assert said_status(told, language)["state_said"] == sentence(word, language=language)


def test_a_fault_by_another_writer_says_when_it_can_be_acknowledged() -> None:
    def said(
        since_s: float, reason: str = "double_compensation", code: str = "another_writer"
    ) -> Any:
        now = datetime(2026, 11, 20, 9, 30, tzinfo=UTC)
        times = [(now - timedelta(seconds=s)).isoformat() for s in (70.0, since_s)]
        alarms = [alarm(code) | {"since": time} for time in times]
        told = status(state="Fault", reasons=[reason], alarms=alarms, utc=now.isoformat())
        return said_status(told, "en")["acknowledge_said"]

    assert said(15.0) == "other writer: in 45\N{NO-BREAK SPACE}s"
    assert {said(61.0), said(15.0, "long_at_limit"), said(15.0, code="late")} == {""}
    told = status(reasons=["double_compensation"], alarms=[alarm("another_writer")])
    assert said_status(told, "en")["acknowledge_said"] == ""  # without times it is offered


def test_an_input_is_called_in_sentences_as_people_call_it() -> None:
    names = {"T_spindle_C": "Vřeteno"}
    told = {"code": "headline-held_for_input", "values": {"name": "T_spindle_C, T_table_C"}}
    found = said_status(status(headline=told), "cs", names)
    assert "Vřeteno, T_table" in found["headline_said"]["text"]
    assert found["headline"] == told  # what the loop says stays
    assert "Vřeteno" not in said_status(status(headline=told), "cs")["headline_said"]["text"]


def test_an_event_calls_inputs_and_interlocks_as_people_do_also_in_what_it_quotes() -> None:
    names = {"door": "Tür", "T_spindle_C": "Spindel"}
    opened = {"state": "Fading", "reasons": ("interlock_open",), "names": ("door", "T_table_C")}
    state = EventRecord.of(NOW, "state", "", Message("event-state_named", opened))
    assert "(Tür, T_table)" in said_event(state, "de", names)["said"]
    lost = Message("alarm-sensor_bad", {"name": "T_spindle_C", "quality": "bad_status"})
    came = Message("event-alarm", {"alarm": lost, "priority": "high"})
    said = said_event(EventRecord.of(NOW, "alarm", "", came), "de", names)
    assert "Spindel" in said["mark"]
    assert "T_spindle" not in said["said"]


def test_only_what_a_sentence_names_is_called_as_people_do() -> None:
    names = {"enable": "Key", "restart": "Lamp", "spindle": "Main spindle", "door": "Hood"}
    told = {"name": "door", "names": ["door", "enable"], "then": "enable"}
    told = status(headline={"code": "headline-interlock", "values": told})
    said = said_status(told, "en", names)["headline_said"]
    assert said["text"] == "Interlock open: Hood, Key."
    assert said["remedy"].endswith(sentence("then-enable") + ".")
    lost = status(headline={"code": "headline-hold_lost", "values": {"cause": "restart"}})
    said = said_status(lost, "en", names)["headline_said"]
    assert sentence("lost-restart") in said["text"]
    person = EventRecord.of(NOW, "log", "", Message("event-logged_in", {"name": "spindle"}))
    assert said_event(person, "en", names)["said"].startswith("spindle ")


@pytest.mark.parametrize("code", ["off", "fault", "interlock"])
def test_an_open_interlock_is_named_once_in_off_and_fault_too(code: str) -> None:
    values = {"reason": "long_at_limit", "names": ["door"], "then": "wait"}
    told = {"code": f"headline-{code}", "values": values}
    found = said_status(status(headline=told, open_interlocks=["door"]), "de", {"door": "Tür"})
    assert found["opened_said"] == "Verriegelung offen: Tür."
    assert " ".join(found["headline_said"].values()).count(found["opened_said"]) == 1
    assert said_status(status(headline=told), "de")["opened_said"] == ""


def test_a_code_that_is_newer_than_the_screen_stays_as_the_loop_says_it() -> None:
    for language in LANGUAGES:
        found = said_status(
            status(reasons=["of_tomorrow"], alarms=[alarm("of_tomorrow")]), language
        )
        assert found["reasons_said"] == ["of_tomorrow."]
        shown = found["alarms"][0]["text"]
        assert shown == ("of tomorrow" if language == "en" else isolated("of tomorrow"))


# ---- English within another language -------------------------------------------------------------


def test_free_text_is_marked_as_english_on_a_page_of_another_language_alone() -> None:
    found = EventRecord.of(NOW, "alarm", "", Message("event-self_test", {"finding": FINDING}))
    assert said_event(found, "de")["said"] == f"Selbsttest: {isolated(FINDING)}"
    assert ISOLATE not in said_event(found, "en")["said"]
    state = EventRecord.of(NOW, "state", "", Message("event-state", {"state": "Off"}))
    assert ISOLATE not in said_event(state, "cs")["said"]


@pytest.mark.parametrize("language", LANGUAGES)
def test_what_of_an_answer_is_free_text_is_marked(language: str) -> None:
    refused = Outcome(Answer.REFUSED, Message("answer-model_unusable", {"why": FINDING}))
    question = {"method": "Hold", "arguments": []}
    reason = Somebody(answer=refused).ask(question).json()["reason"][language]
    assert (isolated(FINDING) in reason) is (language != "en")
    assert FINDING in reason


NODES = """
globalThis.document = {
  documentElement: { lang: "de" },
  getElementById: () => null,
  createElement: () => ({
    children: [], append(...nodes) { this.children.push(...nodes); },
    set textContent(text) { this.children = [text]; },
  }),
};
const { made, hasEnglish } = await import(given.elements);
const shape = (node) => typeof node === "string" ? node
  : [node.lang ?? "", node.children.map(shape)];
console.log(JSON.stringify(given.texts.map((text) => [shape(made("p", text)), hasEnglish(text)])));
"""


def by_script(body: str, language: str = "en", **given_: object) -> Any:
    head = (
        'import { readFileSync } from "node:fs";\n'
        'const given = JSON.parse(readFileSync(0, "utf8"));\n'
    )
    modules = {"words": "words.js", "elements": "elements.js", "series": "history/series.js"}
    words = sentences_of(modules_of("operator/operator.js", *modules.values()), language)
    files = {name: (STATIC / file).as_uri() for name, file in modules.items()}
    return said_by(head + body, {**files, "language": language, "sentences": words, **given_})


# ---- numbers, times and names -------------------------------------------------------------------

NUMBERS = [-2.5, -0.5, -0.05, -0.04, 0.0, 0.25, 0.35, 0.5, 1.5, 2.5, 12.25, 1e9, None]
SECONDS = (0.0, 0.4, 44.5, 59.4, 60.0, 61.0, 599.0, 600.0, 3599.0, 3600.0, 5400.0, 28_800.0, 9e5)
NAMES = ("Z_um", "T_spindle_C", "Z_um, X_um", "um", "Z_umf", "", "probe.Z_um")
LABELS = {
    "T_spindle_C": "T_spindle",
    "T_spindle_redundant_C": f"T_spindle ({sentence('sensors-redundant')})",
    "T_own_C": "Own name",
    "Z_at_limit": f"Z {sentence('history-limited')}",
    "interlock_stop": template("history-interlock").format(name="Emergency stop"),
    "Z_correction_um": f"Z {sentence('history-correction')}",
    "Z_weight": f"Z {sentence('history-weight')}",
    "probe_Z_um": f"Z {sentence('history-probe')}",
    "Z_part_a_b_um": f"Z {template('history-part').format(name='a_b')}",
    "Z_of_the_future_um": "Z_of_the_future",
}
WRITTEN = """
const texts = { words: { textContent: JSON.stringify(given.sentences) } };
globalThis.document = {
  documentElement: { lang: given.locale }, getElementById: (id) => texts[id] ?? null,
  body: { dataset: { names: '{"T_own_C": "Own name", "stop": "Emergency stop"}' } },
};
const { duration, number, shortNames, signed, word } = await import(given.words);
const { labelOf } = await import(given.series);
console.log(JSON.stringify([
  given.numbers.map((one) => [number(one, 0), number(one, 1), signed(one, 1)]),
  given.seconds.map(duration),
  given.names.map(shortNames),
  given.labels.map(labelOf),
  [word("operator-since", { time: "9:00" }), word("no_such-key", {})],
  shortNames("T_own_C, T_b_C"),
]));
"""


@pytest.mark.parametrize("language", LANGUAGES)
def test_scripts_write_numbers_times_and_names_as_the_server_does(language: str) -> None:
    locale = {"en": "en-GB"}.get(language, language)
    given_ = {"numbers": NUMBERS, "seconds": SECONDS, "names": NAMES, "labels": list(LABELS)}
    numbers, times, names, labels, said, own = by_script(WRITTEN, language, locale=locale, **given_)
    assert numbers == [
        [number_text(one, spec, language) for spec in (".0f", ".1f", "+.1f")] for one in NUMBERS
    ]
    assert times == [duration_text(time_s) for time_s in SECONDS]
    assert names == [short_names(name) for name in NAMES]
    assert labels == list(LABELS.values()) or language != "en"
    since = template("operator-since", language=language).replace("{time}", "9:00")
    assert said == [since, "no_such-key"]
    assert own == "Own name, T_b"
