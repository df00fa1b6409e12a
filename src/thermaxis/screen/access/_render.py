"""Pages of the screen, in the language of their visitor."""

from jinja2 import Template
from starlette.requests import HTTPConnection
from starlette.responses import HTMLResponse

from thermaxis.messages import short_names
from thermaxis.runtime import Role
from thermaxis.screen.access._access import visitor_of
from thermaxis.screen.access._parts import access_of
from thermaxis.web import text_of_template


def render(
    request: HTTPConnection, template: str | Template, *, page: str, **context: object
) -> HTMLResponse:
    """Return a page in the language of its visitor."""
    parts, visitor = access_of(request), visitor_of(request)
    text = fragment(
        request,
        template,
        **context,
        **parts.frame(parts.shown_names(visitor.language)),
        page=page,
        visitor=visitor,
        viewing=visitor.role.at_least(Role.VIEWER),
    )
    return HTMLResponse(text)


def fragment(request: HTTPConnection, template: str | Template, **context: object) -> str:
    """Return a part of a page in the language of its visitor."""
    language = visitor_of(request).language
    names = access_of(request).shown_names(language)

    def called(name: str) -> str:
        return names.get(name) or short_names(name)

    return text_of_template(template, language, called, **context)
