"""What the pages share: configuration, feed, people, words and templates."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import final

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from starlette.requests import HTTPConnection
from starlette.responses import HTMLResponse

from thermaxis import __version__
from thermaxis.runtime import Clock, MachineConfiguration, Role, ScreenSettings
from thermaxis.screen._words import LANGUAGES, Words, short_names
from thermaxis.screen.access._access import visitor_of
from thermaxis.screen.access._persons import Persons
from thermaxis.screen.feed import StatusFeed

NAVIGATION = ("operator", "model", "sensors", "history", "probe", "positioning")
"""Pages in the order of their buttons."""
_TEMPLATES = Environment(
    loader=PackageLoader("thermaxis.screen", "pages"),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class ScreenParts:
    """What every page is made from."""

    configuration: MachineConfiguration
    """The machine's configuration."""
    settings: ScreenSettings
    """Its table ``[screen]``."""
    clock: Clock
    """Time."""
    feed: StatusFeed
    """What the loop tells."""
    persons: Persons
    """Who has logged in."""
    words: Words
    """Texts in every language."""
    program: str
    """Name of this run of the screen; another one makes open pages load themselves again."""
    secure: bool = False
    """Whether the pages go through TLS."""
    configuration_sha256: str = ""
    """Hash of the configuration's rules; a loop that tells another one works by others. Empty:
    pages do not compare it."""

    def render(
        self, request: HTTPConnection, template: str, *, page: str, **context: object
    ) -> HTMLResponse:
        """Return a page in the language of its visitor."""
        visitor = visitor_of(request)
        language = visitor.language

        def word(key: str, **values: str) -> str:
            return self.words.say(language, key, **values)

        text = _TEMPLATES.get_template(template).render(
            context,
            page=page,
            pages=NAVIGATION,
            visitor=visitor,
            people=self.configuration.server is not None
            and self.configuration.server.users is not None,
            viewing=visitor.role.at_least(Role.VIEWER),
            language=language,
            languages=LANGUAGES,
            machine=self.configuration.name,
            configuration_sha256=self.configuration_sha256,
            program=self.program,
            version=__version__,
            word=word,
            short_names=short_names,
            static=static_address,
            words_json=for_script(
                {
                    "words": self.words.catalog(language),
                    "phrases": self.words.phrases(language),
                }
            ),
        )
        return HTMLResponse(text)


def static_address(name: str) -> str:
    """Return the address of a script or style."""
    return f"/static/{name}"


def for_script(value: object) -> Markup:
    """Return a value as JSON that may stand inside a script element."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"))
    for sign, escape in (("<", "\\u003c"), (">", "\\u003e"), ("&", "\\u0026")):
        text = text.replace(sign, escape)
    return Markup(text)  # noqa: S704 - no sign is left that HTML would read


def asset_folder() -> Path:
    """Return the folder of the scripts and styles."""
    return Path(__file__).parents[1] / "static"
