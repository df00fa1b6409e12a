"""Sentences from codes and values: one catalogue for each language, used where a person reads."""

from thermaxis.messages._catalogue import (
    LANGUAGES,
    AlarmSentences,
    alarm_sentences,
    keys,
    place_text,
    remedy_of,
    sentence,
    sentence_of,
    text_of,
)
from thermaxis.messages._formats import ABSENT, duration_text, number_text, short_names

__all__ = [
    "ABSENT",
    "LANGUAGES",
    "AlarmSentences",
    "alarm_sentences",
    "duration_text",
    "keys",
    "number_text",
    "place_text",
    "remedy_of",
    "sentence",
    "sentence_of",
    "short_names",
    "text_of",
]
