"""The lines at the top of a model block: what it is, where it comes from, what its numbers mean."""

import textwrap
from collections.abc import Iterator

from thermaxis import __version__
from thermaxis.compensation import STATED
from thermaxis.plc._library import LIBRARY, LIBRARY_VERSION
from thermaxis.plc._line import LineSettings, line_bounds
from thermaxis.plc._names import remark_text
from thermaxis.plc._numbers import noted
from thermaxis.plc._settings import CYCLE_TOLERANCE, PlcSettings
from thermaxis.plc._texts import paragraphs, remark_of, text
from thermaxis.plc._warnings import restart_warning, setting_warnings

WIDTH = 88
"""Longest line of the head. Origin: a line of 100 signs with the signs of a remark. [1]"""


def head_of(
    settings: PlcSettings, line: LineSettings | None, *, model_only: bool = False
) -> tuple[str, ...]:
    """Return the head of a block."""
    lines: list[str] = [
        *_identity(settings),
        *_conventions(settings, model_only=model_only),
        *(() if line is None else _of_line(settings, line)),
        *paragraphs("head_model_only" if model_only else "head_not_protected"),
    ]
    return tuple(row for paragraph in lines for row in wrapped(paragraph))


def wrapped(paragraph: str) -> list[str]:
    """Return a paragraph as lines of a head."""
    indent = " " * (len(paragraph) - len(paragraph.lstrip()))
    return textwrap.wrap(paragraph.strip(), WIDTH, initial_indent=indent,
                         subsequent_indent=indent + "  ") or [""]  # fmt: skip


def _identity(settings: PlcSettings) -> Iterator[str]:
    provenance = settings.compensation.model.provenance
    yield f"{settings.names.block}: thermal compensation, exported by thermaxis {__version__}"
    yield f"Calls the blocks of {LIBRARY}, version {LIBRARY_VERSION}"
    yield f"Name: {remark_text(settings.name)}"
    yield f"Model SHA-256: {settings.model_sha256 or 'not stated'}"
    yield f"Model date: {remark_text(provenance.date) or 'not stated'}"
    yield f"Method: {remark_text(provenance.method, 200) or 'not stated'}"
    for warning in settings.compensation.model.warnings:
        yield f"Warning: {remark_text(warning, 300)}"
    for message in setting_warnings(settings):
        yield f"Warning: {remark_of(message)}."
    for note in settings.notes:
        yield f"Changed by the export: {remark_of(note)}"


def _conventions(settings: PlcSettings, *, model_only: bool) -> Iterator[str]:
    percent = round(100 * CYCLE_TOLERANCE)
    cycle_s = noted(settings.cycle_s)
    if model_only:
        yield f"Cycle: call it every {cycle_s} s. It does not measure the time itself."
    else:
        yield text("head_cycle", cycle_s=cycle_s, percent=percent)
    yield text("head_sign")
    if settings.compensation.model.reference != STATED:
        yield "Reference: the first good temperatures after the start, sections start at rest."
        if warning := restart_warning(settings):
            yield f"Warning: {remark_of(warning)}"


def _of_line(settings: PlcSettings, line: LineSettings) -> Iterator[str]:
    k0_mm, slope = line_bounds(settings, line)
    yield text(
        "head_line",
        direction="away from" if line.away else "towards",
        k0_mm=k0_mm,
        slope=slope,
        positions=", ".join(f"{noted(p, 9)} mm" for p in line.positions_mm),
    )
