"""Sentences made of codes and values."""

import pytest
from hypothesis import given, strategies as st

from thermaxis.codes import Message, Place
from thermaxis.messages import (
    ISOLATE,
    LANGUAGES,
    alarm_sentences,
    as_sentence,
    duration_text,
    isolated,
    keys,
    number_text,
    place_text,
    sentence,
    sentence_of,
    template,
)


def test_numbers_codes_and_messages_in_a_sentence_are_of_its_language() -> None:
    limits = {"lowest_um": -2.5, "largest_um": 2.5}
    asked = {"request": "hold", "answer": Message("answer-held", {"longest_s": 3600.0})}
    for language, trim, held in (
        (
            *("en", "a trim is a number from −2.5 to 2.5 µm"),
            "hold: accepted, it is held, for at most 1\N{NO-BREAK SPACE}h",
        ),
        (
            *("de", "eine Trimmung ist eine Zahl von −2,5 bis 2,5 µm"),
            "Halten: angenommen, sie wird gehalten, höchstens 1\N{NO-BREAK SPACE}h",
        ),
        (
            *("cs", "ruční posun je číslo od −2,5 do 2,5 µm"),
            "podržet: přijato, je podržena, nejvýše 1\N{NO-BREAK SPACE}h",
        ),
    ):
        assert sentence("answer-trim_range", limits, language=language) == trim
        accepted = Message("event-request_accepted", asked)
        assert sentence_of(accepted, language=language) == held


def test_czech_counts_in_three_forms_and_no_count_has_signs_between_its_digits() -> None:
    for count, text in (
        (1, "Od spuštění byl ztracen 1 záznam historie."),
        (3, "Od spuštění byly ztraceny 3 záznamy historie."),
        (5, "Od spuštění bylo ztraceno 5 záznamů historie."),
    ):
        assert sentence("alarm-history_lost", {"lost": count}, language="cs") == text
    assert sentence("alarm-history_lost", {"lost": 1_234_567}).startswith("1234567 records")


def test_several_codes_are_said_one_after_another_and_an_unknown_one_as_it_is() -> None:
    values = {"state": "Holding", "reasons": ("input_bad", "of_tomorrow")}
    text = "Hold: an input has no usable value; of_tomorrow"
    assert sentence("event-state_reasons", values) == text
    alarms = (Message("alarm-diameter_unknown"), Message("alarm-historian_unstated"))
    said = sentence("answer-no_fault", {"alarms": alarms})
    assert said.endswith("tool centre point counts. The history cannot be stored.")


def test_an_alarm_has_a_text_a_cause_and_a_remedy() -> None:
    values = {"name": "Z_um", "correction_um": 61.25, "soft_um": 50.0}
    text, cause, remedy = alarm_sentences("soft_limit", values, language="de")
    assert text == "Die Korrektur von Z ist +61,2 µm, jenseits der Warngrenze von 50,0 µm."
    assert (
        cause == "Die Maschine ist ungewöhnlich warm oder kalt, oder Modell oder Sensor ist falsch."
    )
    assert remedy == "Beobachten; mit einer Tastermessung vergleichen."


def test_what_has_no_sentence_is_shown_as_code_and_values() -> None:
    values = {"depth_um": 1.5, "name": "a\nb"}
    assert sentence("alarm-of_tomorrow", values) == "alarm-of_tomorrow (depth_um=1.5, name=a\\nb)"
    assert alarm_sentences("of_tomorrow", {}) == ("alarm-of_tomorrow", "", "")
    assert sentence("answer-held", {"other": 1}) == "answer-held (other=1)"


@given(text=st.text(max_size=300), language=st.sampled_from(LANGUAGES))
def test_text_of_others_is_data(text: str, language: str) -> None:
    said = sentence("answer-trim_replaced", {"who": "{ $x }" + text}, language=language)
    assert "{ $x }" in said
    assert said.isprintable()


VALUES = st.one_of(
    st.none(), st.text(), st.integers(), st.floats(), st.tuples(st.text()), st.booleans()
)


@given(key=st.sampled_from(sorted(keys("en"))), value=VALUES, language=st.sampled_from(LANGUAGES))
def test_no_value_stops_a_sentence(key: str, value: object, language: str) -> None:
    names = ("name", "correction_um", "soft_um", "cycles", "events", "request", "answer", "lost")
    assert sentence(key, dict.fromkeys(names, value), language=language)


def test_numbers_have_a_true_minus_times_two_units_and_places_are_told_from_file_to_column() -> (
    None
):
    for value, spec, text in (
        *((-1.26, "+.1f", "−1.3"), (-0.01, "+.1f", "0.0"), (float("nan"), ".1f", "–")),
        *((True, ".0f", "–"), (12.0, "g", "12")),
    ):
        assert number_text(value, spec, "en") == text
    for time_s, text in (
        *((45.4, "45 s"), (90.0, "1 min 30 s"), (5400.0, "1 h 30 min"), (200_000.0, "2 d 7 h")),
    ):
        assert duration_text(time_s).replace("\N{NO-BREAK SPACE}", " ") == text
    place = Place("a.csv", 7, "Z")
    assert place_text(place) == "a.csv, line 7, column Z"
    assert place_text(place, language="de") == "a.csv, Zeile 7, Spalte Z"


def test_a_sentence_of_its_own_keeps_the_name_that_it_begins_with() -> None:
    for text, said in (
        ("an operator holds it", "An operator holds it."),
        ("žádná porucha", "Žádná porucha."),
        ("model.json does not fit", "model.json does not fit."),
        ("models/lathe: gone", "models/lathe: gone."),
        ("2 of 3 are there", "2 of 3 are there."),
        ("node_9 is read only!", "node_9 is read only!"),
        ("", ""),
    ):
        assert as_sentence(text) == said


@pytest.mark.parametrize("language", LANGUAGES)
def test_what_is_english_in_another_language_is_isolated(language: str) -> None:
    free = {"why": Message("why-damaged", {"file": "a.json", "detail": "no JSON"})}
    said = sentence("event-no_saved_state", free, language=language)
    assert (isolated("no JSON") in said) is (language != "en")
    error = sentence("answer-model_unusable", {"why": Message("error-not_utf8")}, language=language)
    assert (isolated("The file is not UTF-8 text.") in error) is (language != "en")
    assert ISOLATE not in sentence("answer-unknown_output", {"names": ("X_um",)}, language=language)


def test_values_that_are_filled_in_later_stand_as_their_names() -> None:
    assert template("operator-since", language="de") == "seit {time}"
    assert template("operator-nothing_to_ask", language="cs").endswith("{why}.")
