"""Log-in, roles, guard and answers of the screen."""

from thermaxis.screen.access._access import (
    Visitor as Visitor,
    needs as needs,
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
from thermaxis.screen.access._file_session import (
    FileSession as FileSession,
)
from thermaxis.screen.access._login_page import (
    login_routes as login_routes,
)
from thermaxis.screen.access._loop_session import (
    LoopSession as LoopSession,
)
from thermaxis.screen.access._parts import (
    AccessParts as AccessParts,
    ScreenParts as ScreenParts,
    parts_of as parts_of,
)
from thermaxis.screen.access._render import (
    fragment as fragment,
    render as render,
)
from thermaxis.screen.access._user_sessions import (
    LOOP_GONE as LOOP_GONE,
    OUT as OUT,
    UserSession as UserSession,
    UserSessions as UserSessions,
)
