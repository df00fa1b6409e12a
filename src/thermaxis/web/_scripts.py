"""Scripts of a page: which others they load, and the sentences that they show."""

import re
from functools import cache
from hashlib import sha256
from pathlib import Path
from posixpath import dirname, join, normpath

from thermaxis.messages import LANGUAGES, keys, template

_IMPORT = re.compile(r'^import [^;]*?"(\.[^"]+)";', re.MULTILINE)
_NAMED = re.compile(r"""["'`]([a-z_]+-\w*)(\$\{)?""")


def asset_folder() -> Path:
    """Return the folder of the scripts and styles of all pages: they load each other."""
    return Path(__file__).with_name("static")


@cache
def modules_of(*names: str) -> tuple[str, ...]:
    """Return scripts and all that they load, each once.

    Parameters
    ----------
    names : str
        Names of scripts, as of all here: below the folder of scripts and styles.
    """
    waiting, found = list(names), dict[str, None]()
    while waiting:
        name = waiting.pop(0)
        if name not in found:
            found[name] = None
            loaded = _IMPORT.findall(_text(name))
            waiting += [normpath(join(dirname(name), path)) for path in loaded]
    return tuple(found)


@cache
def sentences_of(names: tuple[str, ...], language: str) -> dict[str, str]:
    """Return by key what scripts show, with ``{name}`` for what they fill in.

    Parameters
    ----------
    names : tuple of str
        Names of scripts. Sentences are those that they name by a literal, or by how it begins.
    """
    named = {found for name in names for found in _NAMED.findall(_text(name))}
    whole = {key for key, more in named if not more}
    begun = tuple(key for key, more in named if more)
    return {
        key: template(key, language=language)
        for key in keys(LANGUAGES[0])
        if "." not in key and (key in whole or key.startswith(begun))
    }


@cache
def static_version() -> str:
    """Return what tells this set of scripts and styles from any other."""
    files = sorted(path for path in asset_folder().rglob("*") if path.is_file())
    return sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:16]


@cache
def _text(name: str) -> str:
    return (asset_folder() / name).read_text(encoding="utf-8")
