"""What every page of this program stands on, with or without a machine.

Guard, answers, templates, scripts, and commands in processes of their own. A page's room is some
routes, a template and a script; `thermaxis.app` and `thermaxis.screen` put rooms together.
"""

from thermaxis.web._answers import (
    RefusedError as RefusedError,
    answer_mistake as answer_mistake,
    answer_no_route as answer_no_route,
    choose_language as choose_language,
    object_of as object_of,
    refuse as refuse,
    spoken as spoken,
)
from thermaxis.web._assets import Assets as Assets
from thermaxis.web._connections import Listener as Listener
from thermaxis.web._guard import Guard as Guard
from thermaxis.web._language import (
    LANGUAGE_COOKIE as LANGUAGE_COOKIE,
    LanguageOfParts as LanguageOfParts,
    language_of as language_of,
)
from thermaxis.web._packed import Packed as Packed
from thermaxis.web._plain_page import (
    answer_json as answer_json,
    wants_page as wants_page,
)
from thermaxis.web._render import (
    LOCALES as LOCALES,
    for_script as for_script,
    page_of as page_of,
    static_address as static_address,
    text_of_template as text_of_template,
)
from thermaxis.web._scripts import (
    asset_folder as asset_folder,
    modules_of as modules_of,
    sentences_of as sentences_of,
    static_version as static_version,
)
from thermaxis.web._server import Server as Server
