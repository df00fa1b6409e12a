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

import json
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Literal

import numpy as np

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings._document import (
    Form,
    content_sha256,
    document_of,
    read_document,
    write_document,
)
from thermaxis.files.settings._reading import settings_of, unknown_key
from thermaxis.positioning import APPROACHES, Cycle, FloatArray, TestPlan
from thermaxis.quantities import AxisKind

FORMAT = "thermaxis-plan"
"""What every plan says that it is."""
VERSION = 1
"""Version of the format that is written, and the only one that is read. [1]"""
_FORM = Form(FORMAT, VERSION, largest_bytes=1_000_000)  # ten thousand targets take a fifth


@dataclass(frozen=True, slots=True, kw_only=True)
class _Content:
    """What a file states, by the names of a plan's fields."""

    axis: str
    title: str | None = None
    cycle: Cycle
    approaches: tuple[Literal["forward", "backward"], ...]
    cycles: int
    target: tuple[float, ...]
    feed: float
    dwell_s: float
    recording_s: float | None = None
    overrun: float
    pitch: float | None = None
    interval: float | None = None
    random_part: float | None = None
    seed: int | None = None


def _keys(kind: AxisKind) -> dict[str, str]:
    """Return the key of each field of a plan, in the order in which they are written."""
    unit = kind.units.position_suffix
    with_unit = {name: f"{name}_{unit}" for name in ("overrun", "pitch", "interval", "random_part")}
    with_unit |= {"target": f"targets_{unit}", "feed": f"feed_{unit}_per_min"}
    return {one.name: with_unit.get(one.name, one.name) for one in fields(_Content)}


def plan_as_json(plan: TestPlan) -> dict[str, object]:
    """Return a plan with the keys of the format, its hash as the last one."""
    content = _content(plan)
    return {**content, "sha256": content_sha256(content)}


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


def plan_sha256(plan: TestPlan) -> str:
    """Return the hash of a plan: what an NC program and a certificate name it by.

    Returns
    -------
    str
        SHA-256, 64 hexadecimal digits, of the plan's JSON without the key ``sha256``: every other
        key in alphabetical order, no blanks, ASCII, lengths and times as floating-point numbers
        in the shortest form that gives the same number back.
    """
    return content_sha256(_content(plan))


def format_plan(plan: TestPlan) -> str:
    """Return a plan as the text of its file.

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
    """Write a plan, as `write_model` writes a model."""
    write_document(format_plan(plan), path)


def read_plan(path: Path | str) -> TestPlan:
    """Read a plan, at most 1 MB; as `read_model` reads a model, and with the same errors.

    Read, written and read again it is the same, and so is its hash.
    """
    return read_document(path, _FORM, _plan, plan_sha256)


def plan_of(table: dict[str, object], file: str) -> TestPlan:
    """Return the plan that a JSON object is."""
    return document_of(table, file, _FORM, _plan, plan_sha256)


def _plan(content: dict[str, object], file: str) -> TestPlan:
    kind = settings_of(AxisKind, content.pop("kind", None), file=file, key="kind")
    keys = _keys(kind)
    names = {key: name for name, key in keys.items()}
    for key in content:
        if key not in names:
            raise unknown_key(file, key, names)
    try:
        stated = settings_of(_Content, {names[k]: v for k, v in content.items()}, file=file)
        given = {name: value for name, value in asdict(stated).items() if value is not None}
        given["target"] = np.array(stated.target)
        given["approaches"] = tuple(APPROACHES.index(word) for word in stated.approaches)
        _check_decimals(given["target"])
        return TestPlan(kind=kind, **given)
    except ConfigurationError as error:
        field, bracket, index = error.place.key.partition("[")
        place = Place(file, key=keys.get(field, field) + bracket + index)
        raise error.at(place) from None


def _check_decimals(target: FloatArray) -> None:
    if bool(np.any(np.abs(target - np.round(target, 3)) > 1e-9)):
        raise ConfigurationError("targets_too_fine", decimals=3, key="target")
