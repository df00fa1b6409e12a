"""Pages made of templates, in the language of who looks."""

import json
from collections.abc import Callable
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from markupsafe import Markup

from thermaxis import __version__
from thermaxis.codes import Value
from thermaxis.messages import LANGUAGES, duration_text, number_text, sentence
from thermaxis.web._scripts import modules_of, sentences_of, static_version

LOCALES = {"en": "en-GB"}
"""Where times and numbers need more than the language: 20/11/2026, and 24 hours."""
_PACKAGE = Path(__file__).parents[1]
_TEMPLATES = Environment(
    loader=FileSystemLoader(
        [_PACKAGE / name / "pages" for name in ("web", "app", "screen", "board")]
    ),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)


def page_of(text: str) -> Template:
    """Return a page's template that is not of this program."""
    return _TEMPLATES.from_string(text)


def text_of_template(
    template: str | Template,
    language: str,
    short_names: Callable[[str], str],
    **context: object,
) -> str:
    """Return a page, or a part of one, in a language."""
    scripts: list[str] = []

    def static(name: str) -> str:
        if name.endswith(".js"):
            scripts.append(name)
        return static_address(name)

    def modules() -> tuple[str, ...]:
        return modules_of(*scripts)

    def words(modules: tuple[str, ...]) -> Markup:
        return for_script(sentences_of(modules, language))

    def word(key: str, **values: Value) -> str:
        return sentence(key, values, language=language)

    def number(value: object, digits: int = 1, sign: str = "", kind: str = "f") -> str:
        return number_text(value, f"{sign}.{digits}{kind}", language)

    return _TEMPLATES.get_template(template).render(
        context,
        language=language,
        languages=LANGUAGES,
        locale=LOCALES.get(language, language),
        version=__version__,
        word=word,
        number=number,
        duration=duration_text,
        short_names=short_names,
        static=static,
        modules=modules,
        words=words,
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
