"""Plans of positioning runs as JSON, ``thermaxis-plan`` version 1.

One object. The kind of the axis fixes the unit at the end of a key, mm or deg:

``format``, ``version``
    ``"thermaxis-plan"`` and 1.
``kind``, ``axis``, ``title``
    ``"linear"`` or ``"rotary"``; the axis' name; free words (may be left out).
``cycle``, ``approaches``, ``cycles``
    ``"standard"``, ``"pilgrim"`` or ``"step"``; ``["forward", "backward"]`` or one of them; the
    number of cycles.
``targets_mm``
    Target positions, strictly increasing, three decimals.
``feed_mm_per_min``, ``dwell_s``, ``recording_s``, ``overrun_mm``
    Feed; standstill before, and time of, the recording (the latter may be left out); by how much
    a target is passed before it is approached from the planned side.
``pitch_mm``, ``interval_mm``, ``random_part_mm``, ``seed``
    How the targets were chosen by equation (1) (each may be left out or null).
``sha256``
    SHA-256 of the content, see `plan_sha256` (may be left out; where it stands it must be right).
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import cast

import numpy as np

from thermaxis.errors import ConfigurationError, printable
from thermaxis.files.settings._settings_file import (
    read_json_object,
    unknown_key,
    write_json_text,
)
from thermaxis.positioning import APPROACHES, Cycle, FloatArray, TestPlan
from thermaxis.quantities import AxisKind

FORMAT = "thermaxis-plan"
"""What every plan says that it is."""
VERSION = 1
"""Version of the format that is written, and the only one that is read. [1]"""
LARGEST_PLAN_BYTES = 1_000_000
"""Largest plan that is read; ten thousand targets take a fifth of it. [byte]"""

_REMEDY = "Give a plan that thermaxis plan -o has written"
_LONGEST_WORD = 200
_FIRST_KEYS = ("format", "version", "kind")
_OPTIONAL = ("title", "recording_s", "pitch", "interval", "random_part", "seed", "sha256")


def _keys(kind: AxisKind) -> dict[str, str]:
    """Return the key of each field of a plan, in the order in which they are written."""
    unit = kind.units.position_suffix
    return {
        "axis": "axis",
        "title": "title",
        "cycle": "cycle",
        "approaches": "approaches",
        "cycles": "cycles",
        "target": f"targets_{unit}",
        "feed": f"feed_{unit}_per_min",
        "dwell_s": "dwell_s",
        "recording_s": "recording_s",
        "overrun": f"overrun_{unit}",
        "pitch": f"pitch_{unit}",
        "interval": f"interval_{unit}",
        "random_part": f"random_part_{unit}",
        "seed": "seed",
    }


def plan_as_json(plan: TestPlan) -> dict[str, object]:
    """Return a plan with the keys of the format, its hash as the last one.

    Parameters
    ----------
    plan : TestPlan
        The plan.

    Returns
    -------
    dict
        Texts, numbers, lists and None.
    """
    content = _content(plan)
    return {**content, "sha256": _hash_of(content)}


def _content(plan: TestPlan) -> dict[str, object]:
    content: dict[str, object] = {"format": FORMAT, "version": VERSION, "kind": str(plan.kind)}
    for field, key in _keys(plan.kind).items():
        content[key] = getattr(plan, field)
    keys = _keys(plan.kind)
    content["cycle"] = str(plan.cycle)
    content["approaches"] = [APPROACHES[a] for a in plan.approaches]
    content[keys["target"]] = plan.target.tolist()
    for field in ("feed", "dwell_s", "recording_s", "overrun", "pitch", "interval", "random_part"):
        value: float | None = getattr(plan, field)
        content[keys[field]] = None if value is None else float(value) + 0.0
    return content


def _hash_of(content: Mapping[str, object]) -> str:
    plain = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(plain.encode("ascii")).hexdigest()


def plan_sha256(plan: TestPlan) -> str:
    """Return the hash of a plan: what an NC program and a certificate name it by.

    Parameters
    ----------
    plan : TestPlan
        The plan.

    Returns
    -------
    str
        SHA-256, 64 hexadecimal digits, of the plan's JSON without the key ``sha256``: every other
        key in alphabetical order, no blanks, ASCII, lengths and times as floating-point numbers
        in the shortest form that gives the same number back.
    """
    return _hash_of(_content(plan))


def format_plan(plan: TestPlan) -> str:
    """Return a plan as the text of its file.

    Parameters
    ----------
    plan : TestPlan
        The plan.

    Returns
    -------
    str
        JSON in ASCII, one key on each line; the last line ends in a line feed.
    """
    lines = (
        f"  {json.dumps(key)}: {json.dumps(value, allow_nan=False)}"
        for key, value in plan_as_json(plan).items()
    )
    return "{\n" + ",\n".join(lines) + "\n}\n"


def write_plan(plan: TestPlan, path: Path | str) -> None:
    """Write a plan.

    Parameters
    ----------
    plan : TestPlan
        The plan.
    path : Path or str
        The file; it is replaced if it exists.

    Raises
    ------
    ConfigurationError
        If it cannot be written.
    """
    write_json_text(format_plan(plan), path)


def read_plan(path: Path | str) -> TestPlan:
    """Read a plan.

    Parameters
    ----------
    path : Path or str
        The file, JSON in UTF-8, at most 1 MB.

    Returns
    -------
    TestPlan
        The plan. Read, written and read again it is the same, and so is its hash.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, is too large, is not JSON or no plan, has another version, an
        unknown, missing or repeated key, a value that cannot be, or a hash that does not fit.
    """
    name = str(path)
    table = read_json_object(name, largest_bytes=LARGEST_PLAN_BYTES, remedy=_REMEDY)
    _check_format(name, table)
    kind_word = _text(name, "kind", table["kind"])
    if kind_word not in {str(kind) for kind in AxisKind}:
        raise _wrong(name, "kind", "neither linear nor rotary")
    kind = AxisKind(kind_word)
    keys = _keys(kind)
    _check_keys(name, table, keys, kind)
    values: dict[str, object] = {}
    for field, key in keys.items():
        if table.get(key) is not None:
            values[field] = _READERS[field](name, key, table[key])
        elif field not in _OPTIONAL:
            raise _wrong(name, key, "null, which says nothing")
    try:
        plan = _plan_of(kind, values)
    except ConfigurationError as error:
        key = keys.get(error.where, error.where)
        raise ConfigurationError(
            error.what, where=f"{name}, key {key}", remedy=error.remedy
        ) from None
    _check_hash(name, table.get("sha256"), plan)
    return plan


def _plan_of(kind: AxisKind, values: Mapping[str, object]) -> TestPlan:
    """Return the plan; every value has passed the reader of its field."""
    return TestPlan(
        kind=kind,
        axis=cast("str", values["axis"]),
        target=cast("FloatArray", values["target"]),
        cycles=cast("int", values["cycles"]),
        feed=cast("float", values["feed"]),
        dwell_s=cast("float", values["dwell_s"]),
        overrun=cast("float", values["overrun"]),
        cycle=cast("Cycle", values["cycle"]),
        approaches=cast("tuple[int, ...]", values["approaches"]),
        recording_s=cast("float", values.get("recording_s", 0.0)),
        pitch=cast("float | None", values.get("pitch")),
        interval=cast("float | None", values.get("interval")),
        random_part=cast("float | None", values.get("random_part")),
        seed=cast("int | None", values.get("seed")),
        title=cast("str", values.get("title", "")),
    )


# ---- the file -----------------------------------------------------------------------------------


def _wrong(name: str, key: str, what: str, remedy: str = "") -> ConfigurationError:
    return ConfigurationError(f"the value is {what}", where=f"{name}, key {key}", remedy=remedy)


def _no_plan(name: str, what: str) -> ConfigurationError:
    return ConfigurationError(what, where=name, remedy=_REMEDY)


def _check_format(name: str, table: Mapping[str, object]) -> None:
    if table.get("format") != FORMAT:
        stated = printable(str(table.get("format", "nothing")), 40)
        raise _no_plan(name, f"the key format says {stated}, not {FORMAT}: this is no plan")
    version = table.get("version")
    if isinstance(version, bool) or version != VERSION:
        raise ConfigurationError(
            f"version {printable(str(version), 20)} of the plan's format is not known",
            where=f"{name}, key version",
            remedy=f"This program reads version {VERSION}; make the plan again, or use a newer one",
        )
    if "kind" not in table:
        raise _missing(name, ["kind"])


def _missing(name: str, keys: list[str]) -> ConfigurationError:
    return ConfigurationError(
        f"the plan lacks the key {keys[0]}",
        where=name,
        remedy=f"Add {', '.join(keys)}",
    )


def _check_keys(
    name: str, table: Mapping[str, object], keys: Mapping[str, str], kind: AxisKind
) -> None:
    known = {*_FIRST_KEYS, *keys.values(), "sha256"}
    unknown = next((key for key in table if key not in known), None)
    if unknown is not None:
        raise unknown_key(name, unknown, known, f" in the plan of a {kind} axis")
    missing = [key for field, key in keys.items() if key not in table and field not in _OPTIONAL]
    if missing:
        raise _missing(name, missing)


def _check_hash(name: str, stated: object, plan: TestPlan) -> None:
    if stated is not None and stated != plan_sha256(plan):
        raise ConfigurationError(
            "the hash does not fit the content: the plan was changed after it was written",
            where=f"{name}, key sha256",
            remedy="Restore the plan; or leave the key out, and the changed plan has its own hash",
        )


# ---- values -------------------------------------------------------------------------------------


def _text(name: str, key: str, value: object) -> str:
    if not isinstance(value, str):
        raise _wrong(name, key, "not a text", 'Write it in quotes, such as "X"')
    if len(value) > _LONGEST_WORD:
        raise _wrong(name, key, f"longer than {_LONGEST_WORD} characters")
    return value


def _whole(name: str, key: str, value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**63:
        raise _wrong(name, key, "not a whole number from 0 up", "Write digits only")
    return value


def _number(name: str, key: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, float | int):
        raise _wrong(name, key, "not a number", "Write it without quotes")
    if not abs(value) <= 1e9:
        raise _wrong(name, key, "not a number of at most 1e9 in magnitude")
    return float(value)


def _positions(name: str, key: str, value: object) -> FloatArray:
    if not isinstance(value, list):
        raise _wrong(name, key, "not a list", "Write [0.0, 10.0, 20.0]")
    listed = cast("list[object]", value)
    numbers = [_number(name, f"{key}[{k + 1}]", entry) for k, entry in enumerate(listed)]
    exact = np.array(numbers, dtype=np.float64)
    if bool(np.any(np.abs(exact - np.round(exact, 3)) > 1e-9)):
        raise _wrong(name, key, "stated to more than three decimals", "Round the targets")
    return exact


def _cycle(name: str, key: str, value: object) -> Cycle:
    word = _text(name, key, value)
    known = [str(cycle) for cycle in Cycle]
    if word not in known:
        raise _wrong(name, key, f"none of {', '.join(known)}")
    return Cycle(word)


def _approaches(name: str, key: str, value: object) -> tuple[int, ...]:
    if not isinstance(value, list) or not 1 <= len(cast("list[object]", value)) <= 2:
        raise _wrong(name, key, "not a list of approaches", 'Write ["forward", "backward"]')
    words = [_text(name, key, word) for word in cast("list[object]", value)]
    if any(word not in APPROACHES for word in words):
        raise _wrong(name, key, "neither forward nor backward")
    return tuple(APPROACHES.index(word) for word in words)


_READERS = {
    "axis": _text,
    "title": _text,
    "cycle": _cycle,
    "approaches": _approaches,
    "cycles": _whole,
    "target": _positions,
    "feed": _number,
    "dwell_s": _number,
    "recording_s": _number,
    "overrun": _number,
    "pitch": _number,
    "interval": _number,
    "random_part": _number,
    "seed": _whole,
}
"""How the value of each field is read."""
