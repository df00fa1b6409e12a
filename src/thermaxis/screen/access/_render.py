"""Pages of the screen, in the language of their visitor."""

import json

from jinja2 import Template
from starlette.requests import HTTPConnection
from starlette.responses import HTMLResponse

from thermaxis.messages import short_names
from thermaxis.runtime import Role
from thermaxis.screen.access._access import visitor_of
from thermaxis.screen.access._parts import parts_of
from thermaxis.web import text_of_template

NAVIGATION = ("operator", "model", "sensors", "history", "probe", "positioning")
"""Pages in the order of their buttons."""


def render(
    request: HTTPConnection, template: str | Template, *, page: str, **context: object
) -> HTMLResponse:
    """Return a page in the language of its visitor."""
    parts, visitor = parts_of(request), visitor_of(request)
    server = parts.configuration.server
    text = fragment(
        request,
        template,
        **context,
        page=page,
        pages=NAVIGATION,
        visitor=visitor,
        people=server is not None and server.users is not None,
        viewing=visitor.role.at_least(Role.VIEWER),
        machine=parts.configuration.name,
        configuration_sha256=parts.configuration_sha256,
        program=parts.program,
        names=json.dumps(parts.shown_names(visitor.language), ensure_ascii=False),
    )
    return HTMLResponse(text)


def fragment(request: HTTPConnection, template: str | Template, **context: object) -> str:
    """Return a part of a page in the language of its visitor."""
    language = visitor_of(request).language
    names = parts_of(request).shown_names(language)

    def called(name: str) -> str:
        return names.get(name) or short_names(name)

    return text_of_template(template, language, called, **context)
