"""Sentences from codes and values: one catalogue for each language, used where a person reads."""

from thermaxis.messages._catalogue import (
    END_OF_ISOLATE,
    FREE_TEXT,
    ISOLATE,
    LANGUAGES,
    AlarmSentences,
    Language,
    alarm_sentences,
    isolated,
    keys,
    place_text,
    remedy_of,
    sentence,
    sentence_of,
    template,
    text_of,
)
from thermaxis.messages._formats import ABSENT, as_sentence, duration_text, number_text, short_names

__all__ = [
    "ABSENT",
    "END_OF_ISOLATE",
    "FREE_TEXT",
    "ISOLATE",
    "LANGUAGES",
    "AlarmSentences",
    "Language",
    "alarm_sentences",
    "as_sentence",
    "duration_text",
    "isolated",
    "keys",
    "number_text",
    "place_text",
    "remedy_of",
    "sentence",
    "sentence_of",
    "short_names",
    "template",
    "text_of",
]
