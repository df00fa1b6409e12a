"""Forms of the head, the limits and the budget: what they ask, and what they were told before."""

import contextlib
import tempfile
import tomllib
from functools import partial
from pathlib import Path
from typing import Final, cast, final

from thermaxis.app._rooms import read_small
from thermaxis.files.settings import (
    BUDGET_KEYS,
    HEADER_GROUPS,
    read_budget,
    read_figure_limits,
    read_header,
)
from thermaxis.messages import LANGUAGES
from thermaxis.positioning import FIGURE_KEYS
from thermaxis.quantities import AxisKind
from thermaxis.web import RefusedError

LARGEST_TABLE_BYTES: Final = 64_000
"""Largest head, file of limits, budget or mapping. [byte]"""
_READERS = {"limits": read_figure_limits, "budget": read_budget}
_BAD_REQUEST = 400


def forms() -> dict[str, dict[str, list[tuple[str, str, bool]]]]:
    """Return the fields of each file by tables: key, unit, and whether a certificate needs it."""
    units = (("um", "µm"), ("arcsec", "″"))
    limits = [(f"{key}_{suffix}", unit, False) for suffix, unit in units for key in FIGURE_KEYS]
    return {
        "head": {
            group.name: [(one.name, one.unit, one.needed) for one in group.fields]
            for group in HEADER_GROUPS
        },
        "limits": {"limits": [*limits, ("decision_rule", "", False)]},
        "budget": {
            table: [(key, "", False) for key in keys] for table, keys in BUDGET_KEYS.items()
        },
    }


@final
class KeptForms:
    """What forms were filled with, by person: as TOML files of a folder, or while it runs."""

    def __init__(self, folder: Path | None) -> None:
        self._folder = folder
        self._texts: dict[tuple[str, str], bytes] = {}

    def of(self, owner: str) -> dict[str, dict[str, dict[str, str]]]:
        """Return the values of somebody's forms, by form and table; a damaged file has none."""
        found: dict[str, dict[str, dict[str, str]]] = {}
        for form in forms():
            text = self._texts.get((owner, form), b"")
            with contextlib.suppress(OSError, RefusedError):
                if self._folder is not None:
                    text = (self._folder / f"{form}.toml").read_bytes()
                found[form] = texts_of(text)
        return found

    def keep(self, owner: str, form: str, text: bytes) -> None:
        """Keep the file that a form stands for."""
        self._texts[owner, form] = text
        if self._folder is not None:
            self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            file = self._folder / f"{form}.toml"
            file.with_suffix(".new").write_bytes(text)
            file.with_suffix(".new").replace(file)


def judge(form: str, text: bytes, language: str = LANGUAGES[0]) -> None:
    """Refuse what the command would not read as the file that a form stands for."""
    texts_of(text)
    kind = AxisKind.ROTARY if b"_arcsec" in text else AxisKind.LINEAR
    read = partial(_READERS[form], kind=kind) if form in _READERS else read_header
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{form}.toml"
        path.write_bytes(text)
        read_small(read, path, path.name, language)


def texts_of(text: bytes) -> dict[str, dict[str, str]]:
    """Return the tables of a TOML file with their values as TOML writes them, or refuse it."""
    try:
        found = tomllib.loads(text[:LARGEST_TABLE_BYTES].decode())
    except (ValueError, RecursionError):
        raise RefusedError(_BAD_REQUEST, "positioning-no_toml") from None
    return {
        name: {key: _text(value) for key, value in cast("dict[str, object]", table).items()}
        for name, table in found.items()
        if isinstance(table, dict)
    }


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
