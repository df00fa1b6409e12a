"""Configuration of one machine: ``machine.toml`` to frozen values, and every mistake at its place.

.. code-block:: toml

    [machine]
    name = "vertical lathe"
    model = "models/lathe.json"

    [source]
    kind = "opcua"
    connection = "control"

Every key is listed in ``docs/machine-toml.md``.

Not protected: a configuration that is free of mistakes may still name the wrong node, or the
wrong sign. The self-test looks at the machine; the sign is proven at commissioning.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

from pydantic import ValidationError

from thermaxis.codes import Message
from thermaxis.runtime.config._build import build_configuration
from thermaxis.runtime.config._connection import explain, read_tables, refuse
from thermaxis.runtime.config._sections import MachineFile
from thermaxis.runtime.config._settings import MachineConfiguration

_TABLE = re.compile(r"""^\s*\[\s*((?:[\w-]+|"[^"]*"|'[^']*'|\s*\.\s*)+)\s*\]\s*(?:\#.*)?$""")
_KEY = re.compile(r"""^\s*([\w-]+|"[^"]*"|'[^']*')\s*=""")


def examine_machine(path: Path | str) -> MachineConfiguration | tuple[Message, ...]:
    """Read a configuration, or say everything that is wrong in it.

    Parameters
    ----------
    path : Path or str
        The file, TOML in UTF-8, at most 1 MB. Paths in it count from its folder.

    Returns
    -------
    MachineConfiguration or tuple of Message
        The configuration; or what is wrong, in the order of the file's tables, at least one.
        No value of a secret, and none of an unknown key, occurs in it.

    Raises
    ------
    ConfigurationError
        If the file cannot be read or is no TOML; then the line is named.
    """
    file = Path(path).absolute()
    tables = read_tables(file)
    try:
        sections = MachineFile.model_validate(tables)
    except ValidationError as error:
        return _with_lines(explain(error, MachineFile), file)
    built = build_configuration(file, sections)
    if isinstance(built, MachineConfiguration):
        return built
    return _with_lines(built, file)


def read_machine(path: Path | str) -> MachineConfiguration:
    """Read the configuration of a machine.

    Parameters
    ----------
    path : Path or str
        The file, TOML in UTF-8, at most 1 MB. Paths in it count from its folder.

    Returns
    -------
    MachineConfiguration
        What it says, with the model that it names; secrets are read and masked.

    Raises
    ------
    ConfigurationError
        If the file, or a file that it names, cannot be read; a key is unknown, missing, or has a
        value that cannot be; parts contradict each other or do not fit the model; or others can
        read a secret. Several mistakes are one error, ``several_problems``.
    """
    found = examine_machine(path)
    if isinstance(found, MachineConfiguration):
        return found
    raise refuse(found, path)


def state_file_of(path: Path | str) -> Path:
    """Return where a configuration keeps the loop's state; nothing else of it need be right."""
    file = Path(path).absolute()
    machine = read_tables(file).get("machine")
    table = cast("dict[str, object]", machine) if isinstance(machine, dict) else {}
    stated = table.get("state_file")
    return file.parent / (str(stated) if stated else f"{file.stem}.state.json")


def _with_lines(problems: Sequence[Message], file: Path) -> tuple[Message, ...]:
    """Name the file and the line of every mistake, where they can be found.

    Where a key is missing, the line is that of its table. There is none where the text has forms
    that only a whole reader of TOML follows, such as texts over several lines.
    """
    try:
        text = file.read_text(encoding="utf-8-sig")
    except (OSError, ValueError):
        text = ""
    lines = {} if '"""' in text or "'''" in text else _lines_of(text)
    return tuple(_with_line(problem, str(file), lines) for problem in problems)


def _lines_of(text: str) -> dict[str, int]:
    """Return the line of every table and every key, by its name with its tables."""
    found: dict[str, int] = {}
    table = ""
    for number, line in enumerate(text.splitlines(), start=1):
        head = _TABLE.match(line)
        if head is not None:
            table = _plain(head[1])
            found.setdefault(table, number)
            continue
        key = _KEY.match(line)
        if key is not None:
            found.setdefault(f"{table}.{_plain(key[1])}".strip("."), number)
    return found


def _plain(name: str) -> str:
    return re.sub(r"\s*\.\s*", ".", name).replace('"', "").replace("'", "").strip()


def _with_line(problem: Message, file: str, lines: Mapping[str, int]) -> Message:
    place = problem.place
    if place.file:
        return problem
    key = place.key
    while key and key not in lines:
        key = key.rpartition(".")[0]
    return replace(problem, place=place._replace(file=file, line=lines.get(key)))
