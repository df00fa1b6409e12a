"""From a file of TOML to frozen tables."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Final, TypeVar

from pydantic import ValidationError

from thermaxis.codes import Message
from thermaxis.files.settings import parse_toml
from thermaxis.runtime.config._problems import DEEP, adapter_of, problem
from thermaxis.runtime.host import read_limited

FILE_LIMIT_BYTES: Final = 1_000_000
"""Largest configuration file. [byte]"""
_Tree = TypeVar("_Tree")


def read_tables(path: Path) -> dict[str, object]:
    """Read a configuration file as the tables of its text."""
    return parse_toml(read_limited(path, limit_bytes=FILE_LIMIT_BYTES), file=str(path))


def read_tree(kind: type[_Tree], path: Path) -> _Tree | list[Message]:
    """Read a configuration file as frozen tables, or say everything that is wrong in it."""
    return tree_of(kind, read_tables(path), path.absolute().parent)


def tree_of(kind: type[_Tree], tables: Mapping[str, object], folder: Path) -> _Tree | list[Message]:
    """Return tables as frozen values, or say everything that is wrong in them.

    No value of a secret, and none of an unknown key, is told. Names of files count from the folder.
    """
    # A list becomes a tuple, and a table a dataclass, where they come from JSON only; a date of
    # TOML is none of what may stand there.
    try:
        text = json.dumps([tables], default=lambda date: {"date": str(date)})
        return adapter_of(kind).validate_json(text, context=folder)[0]
    except ValidationError as error:
        from thermaxis.runtime.config._mistakes import explained  # noqa: PLC0415 - if there are some

        return explained(error, kind)
    except RecursionError:
        return [problem("not_toml", "", cause=DEEP)]
