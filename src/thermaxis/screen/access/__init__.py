"""Log-in, roles, guard and answers of the screen."""

from thermaxis.screen.access._access import (
    RefusedError,
    Visitor,
    answer_json,
    json_of,
    needs,
    refuse,
    spoken,
    visitor_of,
)
from thermaxis.screen.access._answers import (
    LOST,
    NO_ANSWER,
    Answer,
    Outcome,
    Question,
    outcome_of,
    question_of,
)
from thermaxis.screen.access._failed_log_ins import FAILURES_BY_ADDRESS
from thermaxis.screen.access._guard import Guard
from thermaxis.screen.access._language import language_of, sentences_of_pages
from thermaxis.screen.access._parts import (
    ScreenParts,
    asset_folder,
    parts_of,
)
from thermaxis.screen.access._plain_page import (
    kind_of_mistake,
    place_of_mistake,
    plain_page,
    reference_of,
    wants_page,
)
from thermaxis.screen.access._render import (
    for_script,
    render,
)
from thermaxis.screen.access._user_sessions import (
    LOOP_GONE,
    OUT,
    UserSession,
    UserSessions,
)

__all__ = [
    "FAILURES_BY_ADDRESS",
    "LOOP_GONE",
    "LOST",
    "NO_ANSWER",
    "OUT",
    "Answer",
    "Guard",
    "Outcome",
    "Question",
    "RefusedError",
    "ScreenParts",
    "UserSession",
    "UserSessions",
    "Visitor",
    "answer_json",
    "asset_folder",
    "for_script",
    "json_of",
    "kind_of_mistake",
    "language_of",
    "needs",
    "outcome_of",
    "parts_of",
    "place_of_mistake",
    "plain_page",
    "question_of",
    "reference_of",
    "refuse",
    "render",
    "sentences_of_pages",
    "spoken",
    "visitor_of",
    "wants_page",
]
