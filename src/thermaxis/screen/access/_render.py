"""Pages made of templates, in the language of their visitor."""

import json

from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup
from starlette.requests import HTTPConnection
from starlette.responses import HTMLResponse

from thermaxis import __version__
from thermaxis.codes import Value
from thermaxis.messages import LANGUAGES, duration_text, number_text, sentence, short_names
from thermaxis.runtime import Role
from thermaxis.screen.access._access import visitor_of
from thermaxis.screen.access._parts import parts_of
from thermaxis.screen.access._scripts import modules_of, sentences_of, static_version

NAVIGATION = ("operator", "model", "sensors", "history", "probe", "positioning")
"""Pages in the order of their buttons."""
LOCALES = {"en": "en-GB"}
"""Where times and numbers need more than the language: 20/11/2026, and 24 hours."""
_TEMPLATES = Environment(
    loader=PackageLoader("thermaxis.screen", "pages"),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)


def page_of(text: str) -> Template:
    """Return a page's template that is not of this package."""
    return _TEMPLATES.from_string(text)


def render(
    request: HTTPConnection, template: str | Template, *, page: str, **context: object
) -> HTMLResponse:
    """Return a page in the language of its visitor."""
    parts, visitor = parts_of(request), visitor_of(request)
    language, server = visitor.language, parts.configuration.server
    scripts: list[str] = []

    def static(name: str) -> str:
        if name.endswith(".js"):
            scripts.append(name)
        return static_address(name)

    def modules() -> tuple[str, ...]:
        return modules_of(*scripts)

    def words(modules: tuple[str, ...]) -> Markup:
        return for_script(sentences_of(modules, language))

    text = fragment(
        request,
        template,
        **context,
        page=page,
        pages=NAVIGATION,
        visitor=visitor,
        people=server is not None and server.users is not None,
        viewing=visitor.role.at_least(Role.VIEWER),
        locale=LOCALES.get(language, language),
        languages=LANGUAGES,
        machine=parts.configuration.name,
        configuration_sha256=parts.configuration_sha256,
        program=parts.program,
        version=__version__,
        names=json.dumps(parts.configuration.input_names(language), ensure_ascii=False),
        static=static,
        modules=modules,
        words=words,
    )
    return HTMLResponse(text)


def fragment(request: HTTPConnection, template: str | Template, **context: object) -> str:
    """Return a part of a page in the language of its visitor."""
    language = visitor_of(request).language

    def word(key: str, **values: Value) -> str:
        return sentence(key, values, language=language)

    names = parts_of(request).configuration.input_names(language)

    def called(name: str) -> str:
        return names.get(name) or short_names(name)

    def number(value: object, digits: int = 1, sign: str = "", kind: str = "f") -> str:
        return number_text(value, f"{sign}.{digits}{kind}", language)

    return _TEMPLATES.get_template(template).render(
        context,
        language=language,
        word=word,
        number=number,
        duration=duration_text,
        short_names=called,
    )


def static_address(name: str) -> str:
    """Return the address of a script or style, another one after any of them has changed."""
    return f"/static/{static_version()}/{name}"


def for_script(value: object) -> Markup:
    """Return a value as JSON that may stand inside a script element."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"))
    for sign, escape in (("<", "\\u003c"), (">", "\\u003e"), ("&", "\\u0026")):
        text = text.replace(sign, escape)
    return Markup(text)  # noqa: S704 - no sign is left that HTML would read
