"""Write text so that neither a spreadsheet program nor a reader takes it for something else."""

import json
import re

_FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")
_NEW_CELL = re.compile(r"[,;|]\s*([=+\-@]|$)")


def protected(text: str) -> str:
    """Return the text of a cell as a spreadsheet program shows it, not as a formula."""
    return f"'{text}" if text.startswith((*_FORMULA_STARTS, "'")) else text


def unprotected(text: str) -> str:
    """Take away the apostrophe that `protected` puts before a text."""
    guarded = text.startswith("'") and text[1:].startswith((*_FORMULA_STARTS, "'"))
    return text[1:] if guarded else text


def encoded(text: str) -> str:
    """Return a text in a form that fits one line of comment and keeps every character.

    Most texts stay as they are. A text with control characters, with blanks at its ends, or that
    a spreadsheet program would cut into a cell that starts like a formula, becomes a JSON string.
    """
    plain = text.isprintable() and text == text.strip() and not text.startswith('"')
    if plain and _NEW_CELL.search(text) is None:
        return text
    return quoted(text)


def quoted(text: str) -> str:
    """Return a text as a JSON string in which nothing separates cells."""
    return json.dumps(text).replace(",", "\\u002c").replace(";", "\\u003b").replace("|", "\\u007c")


def decoded(text: str) -> str:
    """Return the text that `encoded` wrote; any other text stays as it is."""
    if not text.startswith('"'):
        return text
    try:
        value: object = json.loads(text)
    except ValueError:
        return text
    return value if isinstance(value, str) else text
