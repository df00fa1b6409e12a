"""Log-in, roles, guard and answers of the screen."""

from thermaxis.screen.access._access import (
    RefusedError as RefusedError,
    Visitor as Visitor,
    json_of as json_of,
    needs as needs,
    refuse as refuse,
    spoken as spoken,
    visitor_of as visitor_of,
)
from thermaxis.screen.access._answers import (
    LOST as LOST,
    NO_ANSWER as NO_ANSWER,
    Answer as Answer,
    Outcome as Outcome,
    Question as Question,
    outcome_of as outcome_of,
    question_of as question_of,
)
from thermaxis.screen.access._guard import Guard as Guard
from thermaxis.screen.access._language import language_of as language_of
from thermaxis.screen.access._parts import (
    ScreenParts as ScreenParts,
    asset_folder as asset_folder,
    parts_of as parts_of,
)
from thermaxis.screen.access._plain_page import (
    answer_json as answer_json,
    kind_of_mistake as kind_of_mistake,
    place_of_mistake as place_of_mistake,
    reference_of as reference_of,
    wants_page as wants_page,
)
from thermaxis.screen.access._render import (
    for_script as for_script,
    fragment as fragment,
    page_of as page_of,
    render as render,
    static_address as static_address,
)
from thermaxis.screen.access._scripts import (
    modules_of as modules_of,
    sentences_of as sentences_of,
    static_version as static_version,
)
from thermaxis.screen.access._user_sessions import (
    LOOP_GONE as LOOP_GONE,
    OUT as OUT,
    UserSession as UserSession,
    UserSessions as UserSessions,
)
