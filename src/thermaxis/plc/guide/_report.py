"""The report beside an exported program: what it is, its bounds, what was checked and what not."""

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, fields
from hashlib import sha256
from math import expm1
from typing import NamedTuple, final

from thermaxis import __version__
from thermaxis.codes import Message, message_as_json
from thermaxis.plc._library import LIBRARY_VERSION
from thermaxis.plc._line import LineSettings
from thermaxis.plc._settings import CYCLE_TOLERANCE, PlcSettings, compensated_stall
from thermaxis.plc._template import remark_of
from thermaxis.plc._warnings import restart_warning, setting_warnings
from thermaxis.plc.vectors import TOLERANCE_UM, Vectors

REPORT_FORMAT = "thermaxis-plc-export"
"""What the report calls itself."""
REPORT_VERSION = 1
"""Version of its keys. [1]"""
REPORT_HASH = "report_sha256"
"""Key of the report's own hash."""
LARGEST_S7_300_BYTES = 16_384
"""Instance data above which an S7-300 is warned of. Default: the
data block of a small CPU. [byte]"""
REPORT_ENDING = ".report.json"
"""How the name of a report ends."""
TEMPCOMP = "sinumerik-tempcomp"
"""The dialect with a straight line."""
NOT_CHECKED_BY_SIEMENS = (
    "syntax and numbers checked through equivalent IEC text; acceptance by STEP 7 or TIA Portal"
    " not checked"
)
"""What is not known of SCL."""
_C = {"c", "fmu"}
_SCL = {"scl", TEMPCOMP}
_ST = {"st", "plcopen"}
_EXPECTED = "expected outputs of the vectors: those of the cycle that runs on the computer"
_RUN_C = "library and blocks of the same template run by gcc against the cycle, in tests"
_RUN_ST = (
    "library and blocks of the same template put into C word by word and run against the cycle,"
    " in tests"
)
_NOT_CHECKED = (
    ("wiring, signs and limits on the machine", {*_ST, *_C, *_SCL}),
    (NOT_CHECKED_BY_SIEMENS, _SCL),
    ("every step in the control: setting data, their writing, their sign", {TEMPCOMP}),
    ("acceptance by the compiler of a control", _ST),
    ("import by any editor", {"plcopen"}),
    ("import by other tools than FMPy, and in real time", {"fmu"}),
    ("other compilers than gcc, and other processors than that of the tests", _C),
)
"""What was not checked, and of which dialects that is said."""
_OF_SENSOR = (
    "lowest_c",
    "highest_c",
    "largest_rate_k_per_s",
    "step_k",
    "frozen_s",
    "moves_with",
    "rests_k",
)
_HALF_UNIT = {True: 2.0**-53, False: 2.0**-24}


@final
class Target(NamedTuple):
    """Who gets the program."""

    dialect: str
    """``scl``, ``st``, ``plcopen``, ``c``, ``fmu`` or ``sinumerik-tempcomp``."""
    variant: str = ""
    """``s7-1500`` or ``s7-300`` for SCL; ``iec``, ``twincat`` or ``codesys`` for ST and
    PLCopen; ``fmu``."""


@final
class ReportFacts(NamedTuple):
    """What the report says besides the settings."""

    target: Target
    models: tuple[tuple[str, str], ...]
    """Name of the file and hash of the content of every model that was read."""
    line: LineSettings | None = None
    """The line; None where there is none."""
    vectors: Vectors | None = None
    """The test vectors; None where there are none."""
    instance_bytes: int | None = None
    """Size of the instance data, about; None in C, where ``sizeof`` says it. [byte]"""
    machine: str = ""
    """Name of the machine whose rules these are; empty where they were stated."""
    warnings: tuple[Message, ...] = ()
    """What else is to be warned of."""


_DECLARED = re.compile(r"^    \w+ : (?:ARRAY\[0\.\.(\d+)\] OF )?(\w+)", re.MULTILINE)
_SECTIONS = re.compile(r"^VAR(?:_INPUT|_OUTPUT)?\n(.*?)^END_VAR", re.MULTILINE | re.DOTALL)


def instance_bytes(texts: Iterable[str]) -> int:
    """Return about how much memory an instance of the last block of some ST texts takes."""
    sizes = {"LREAL": 8, "REAL": 4, "INT": 2, "BOOL": 1}
    last = 0
    for text in texts:
        for block in text.split("\nFUNCTION_BLOCK ")[1:]:
            declared = _DECLARED.findall("".join(_SECTIONS.findall(block)))
            last = sum(sizes[kind] * (int(end or 0) + 1) for end, kind in declared)
            sizes[block.split("\n", 1)[0]] = last
    return last


def report_of(
    settings: PlcSettings, facts: ReportFacts, files: Mapping[str, bytes]
) -> dict[str, object]:
    """Return the report of an export.

    Parameters
    ----------
    files : mapping
        Content of every other file by name.

    Returns
    -------
    dict
        Strings, numbers, lists and mappings; the same for the same input, whatever the day and
        the machine. Keys: ``docs/export-report.md``.
    """
    compensation, target, tested = settings.compensation, facts.target, facts.vectors
    model, rules = compensation.model, compensation.supervisor
    in_c = target.dialect in _C
    names, restart = settings.names, restart_warning(settings)
    warnings = (*([restart] if restart else []), *setting_warnings(settings), *facts.warnings)
    totals_um = tuple(bounds.total_um for bounds in compensation.bounds)
    largest = (0.0, 0.0) if facts.line is None else facts.line.bounds(totals_um)
    report: dict[str, object] = {
        "format": REPORT_FORMAT,
        "version": REPORT_VERSION,
        "program": f"thermaxis {__version__}",
        "block": names.block,
        "library_version": LIBRARY_VERSION,
        "dialect": target.dialect,
        "variant": target.variant,
        "numbers": "LREAL" if settings.double else "REAL",
        "cycle_s": settings.cycle_s,
        "cycle_tolerance": CYCLE_TOLERANCE,
        "models": [{"name": name, "sha256": digest} for name, digest in facts.models],
        "machine": facts.machine,
        "model_sha256": settings.model_sha256,
        "changed": [*map(remark_of, settings.notes)],
        "changed_codes": [*map(message_as_json, settings.notes)],
        "reference": model.reference,
        "warnings": [*map(remark_of, warnings), *model.warnings],
        "warning_codes": [*map(message_as_json, warnings)],
        "names": {
            "channels": dict(zip(compensation.judged, names.channels, strict=True)),
            "outputs": dict(zip([o.name for o in model.outputs], names.outputs, strict=True)),
        },
        "limits": {
            output.name: asdict(bounds)
            for output, bounds in zip(model.outputs, compensation.bounds, strict=True)
        },
        "sensors": {
            channel: {key: getattr(rule, key) for key in _OF_SENSOR}
            for channel, rule in zip(compensation.judged, compensation.rules, strict=True)
        },
        "supervisor": {e.name: getattr(rules, e.name) for e in fields(rules) if e.init},
        "validity": {
            "margin_k": compensation.validity_margin_k,
            "lowest_weight": compensation.lowest_weight,
        },
        "line": None
        if facts.line is None
        else {
            "positions_mm": list(facts.line.positions_mm),
            "reference_mm": facts.line.origin_mm,
            "positive_motion": "away" if facts.line.away else "towards",
            "largest_k0_mm": largest[0],
            "largest_slope": largest[1],
            "velocity_factor": facts.line.velocity_factor,
        },
        "arithmetic": {
            "sections": _sections(settings),
            "tolerance_um": None if settings.double else TOLERANCE_UM,
        },
        "instance_bytes": facts.instance_bytes,
        "vectors": None
        if tested is None
        else {
            "rows": tested.rows,
            "calls": tested.calls,
            "not_in_the_rows": list(tested.missing),
            "cut": list(tested.cuts),
        },
        "checked": ([] if tested is None else [_EXPECTED]) + [_RUN_C if in_c else _RUN_ST],
        "not_checked": [said for said, dialects in _NOT_CHECKED if target.dialect in dialects],
        "files": {name: sha256(content).hexdigest() for name, content in files.items()},
    }
    return {**report, REPORT_HASH: report_sha256(report)}


def report_sha256(report: Mapping[str, object]) -> str:
    """Return the hash of a report without the field that holds it."""
    others = {key: value for key, value in report.items() if key != REPORT_HASH}
    return sha256(report_text(others).encode("ascii")).hexdigest()


def report_text(report: Mapping[str, object]) -> str:
    """Return a report as the text of its file.

    Parameters
    ----------
    report : mapping
        What `report_of` returns.

    Returns
    -------
    str
        JSON in ASCII, with a line end.
    """
    return json.dumps(report, indent=1, allow_nan=False) + "\n"


def _sections(settings: PlcSettings) -> list[dict[str, object]]:
    """Return by section at which share of a step it would come to rest too early.

    References
    ----------
    The law of the stall, ``docs/theory/plc-arithmetic.md``.
    """
    found: list[dict[str, object]] = []
    for part in settings.compensation.model.layout.parts:
        for section in part.sections:
            alpha = -expm1(-settings.cycle_s / section.time_constant_s)
            plain = _HALF_UNIT[settings.double] / alpha
            found.append(
                {
                    "part": part.name,
                    "time_constant_s": section.time_constant_s,
                    "alpha": alpha,
                    "rest_share": plain if settings.double else compensated_stall(alpha),
                    "rest_share_uncompensated": plain,
                }
            )
    return found
