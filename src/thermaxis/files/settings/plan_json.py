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
from pathlib import Path

import numpy as np

from thermaxis.errors import ConfigurationError
from thermaxis.files.settings._document import Form, SettingsTable, content_sha256, read_document
from thermaxis.files.settings._settings_file import write_json_text
from thermaxis.positioning import APPROACHES, Cycle, FloatArray, TestPlan
from thermaxis.quantities import AxisKind

FORMAT = "thermaxis-plan"
"""What every plan says that it is."""
VERSION = 1
"""Version of the format that is written, and the only one that is read. [1]"""
FORM = Form(
    noun="plan",
    format=FORMAT,
    version=VERSION,
    largest_bytes=1_000_000,  # ten thousand targets take a fifth of it
    largest_number=1e9,
    longest_text=200,
    remedy="Give a plan that thermaxis plan -o has written",
    again="make the plan again, or use a newer one",
)
_OPTIONAL = ("title", "recording_s", "pitch", "interval", "random_part", "seed")


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
    return content_sha256(_content(plan))


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
    return read_document(path, FORM, _plan, plan_sha256)


def _plan(of: SettingsTable) -> TestPlan:
    kind_word = of.word("kind")
    if kind_word not in set(AxisKind):
        raise of.wrong("kind", "neither linear nor rotary")
    kind = AxisKind(kind_word)
    keys = _keys(kind)
    for field in _OPTIONAL:
        if of.left.get(keys[field], "") is None:
            del of.left[keys[field]]
    cycle = of.word("cycle")
    if cycle not in set(Cycle):
        raise of.wrong("cycle", f"none of {', '.join(Cycle)}")
    approaches = of.texts("approaches", needed=True)
    if not 1 <= len(approaches) <= 2 or not set(approaches) <= set(APPROACHES):
        raise of.wrong("approaches", "neither forward nor backward", 'Write ["forward"] or both')
    try:
        return TestPlan(
            kind=kind,
            axis=of.word("axis"),
            target=_targets(of, keys["target"]),
            cycles=of.whole("cycles", None),
            feed=of.number(keys["feed"]),
            dwell_s=of.number("dwell_s"),
            overrun=of.number(keys["overrun"]),
            cycle=Cycle(cycle),
            approaches=tuple(APPROACHES.index(word) for word in approaches),
            recording_s=of.number("recording_s", 0.0),
            pitch=of.number_or_none(keys["pitch"]),
            interval=of.number_or_none(keys["interval"]),
            random_part=of.number_or_none(keys["random_part"]),
            seed=of.whole("seed", None) if "seed" in of.left else None,
            title=of.word("title", ""),
        )
    except ConfigurationError as error:
        if error.where.startswith(of.name):
            raise
        key = keys.get(error.where, error.where)
        raise ConfigurationError(error.what, where=f"key {key}", remedy=error.remedy) from None


def _targets(of: SettingsTable, key: str) -> FloatArray:
    listed = of.items(key, needed=True)
    exact = np.array([of.as_number(f"{key}[{k}]", v) for k, v in enumerate(listed, start=1)])
    if bool(np.any(np.abs(exact - np.round(exact, 3)) > 1e-9)):
        raise of.wrong(key, "stated to more than three decimals", "Round the targets")
    return exact
