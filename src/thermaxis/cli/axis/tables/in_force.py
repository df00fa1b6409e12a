"""What corrected the axis while the run was measured: an older table, a reversal value."""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

import numpy as np

from thermaxis.cli.axis.tables.run import AxisRun
from thermaxis.codes import Message, Place
from thermaxis.controls import (
    LARGEST_TABLE_BYTES,
    Control,
    GridRule,
    ReadTable,
    check_size,
    finding,
)
from thermaxis.errors import ConfigurationError, DataError, MeasurementFileError
from thermaxis.positioning import CompensationTable, FloatArray

_BYTE_ORDER_MARKS = (b"\xff\xfe", b"\xfe\xff")
_LARGEST = 1e9
"""Largest position or value of a table that is looked at. [mm, µm; deg, arcsec]"""


@final
@dataclass(frozen=True, slots=True, eq=False)
class InForce:
    """What the control corrected in the readings of the run.

    Not protected: it is what the user states; a table or a reversal value that was in force and
    is not stated counts as absent, and loading the new table then takes its correction away.
    """

    name: str
    """File of the older table; empty where there was none."""
    read: ReadTable | None
    """The older table; None where there was none."""
    backlash: float | None
    """Reversal, forward minus backward, that the control compensated apart from any points: the
    stated one, else that of the older table; None where neither is known. [µm or arcsec]"""

    @property
    def table(self) -> CompensationTable | None:
        """The older table with the reversal that was in force beside it."""
        return None if self.read is None else replace(self.read.table, backlash=self.backlash)

    def correction(self, control: Control, position: FloatArray) -> FloatArray:
        """Return what the control added during the run."""
        table = self.table
        if table is not None:
            return control.correction(table, position)
        half = 0.0 if self.backlash is None else 0.5 * self.backlash
        return np.tile(np.array([-half, half]), (position.size, 1))


def what_was_in_force(
    arguments: argparse.Namespace,
    control: Control,
    options: Mapping[str, str],
    rule: GridRule,
    run: AxisRun,
) -> InForce:
    """Return what corrected the axis during the run, as the arguments of ``correct`` state it."""
    path: Path | None = arguments.merge
    read = None
    if path is not None:
        read = read_older(control, path, run, options)
        _check_same_axis(read, run, str(path))
    name = "" if path is None else str(path)
    own = None if read is None else read.table.backlash
    value: float | None = arguments.backlash_in_force
    if value is None:
        return InForce(name, read, own)
    if value != 0.0:
        _check_stated(control, rule, read, replaced=arguments.backlash or own is not None)
    # the control's parameter is positive for lost motion: forward minus backward is its negative
    backlash = 0.0 - value * run.test.kind.units.deviations_per_position
    return InForce(name, read, backlash)


def read_older(control: Control, path: Path, run: AxisRun, options: Mapping[str, str]) -> ReadTable:
    """Read a table of a control from its file."""
    text, unusual = _read_table_text(path)
    try:
        read = control.read_table(text, str(path), run.test.kind, options)
    except DataError as error:
        raise error.at(Place(file=str(path))) from None
    largest = max(float(np.max(np.abs(v))) for v in (read.table.position, read.table.deviation))
    if largest > _LARGEST:
        raise MeasurementFileError("table_value_too_large", file=path, most=_LARGEST)
    return replace(read, findings=(*unusual, *read.findings))


def _read_table_text(path: Path) -> tuple[str, tuple[Message, ...]]:
    """Return the text of a control's table, and what is unusual in it."""
    try:
        if path.exists() and not path.is_file():
            raise MeasurementFileError("no_regular_file", file=path)
        with path.open("rb") as stream:
            content = stream.read(LARGEST_TABLE_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL character in the name
        cause = getattr(error, "strerror", None) or type(error).__name__
        raise MeasurementFileError("file_unreadable", file=path, cause=cause) from None
    check_size(content, str(path))
    if content.startswith(_BYTE_ORDER_MARKS) or b"\0" in content:
        raise MeasurementFileError("not_plain_text", file=path)
    findings: list[Message] = []
    marked = content.startswith(b"\xef\xbb\xbf")
    if marked:
        findings.append(finding("byte_order_mark_first"))
    strange = next(
        (k for k, byte in enumerate(content) if byte > 127 and (k > 2 or not marked)), None
    )
    if strange is not None:
        line = content.count(b"\n", 0, strange) + 1
        findings.append(finding("letters_outside_ascii", Place(line=line)))
    return content.decode("latin-1"), tuple(findings)


def _check_same_axis(read: ReadTable, run: AxisRun, name: str) -> None:
    stated = read.table.axis
    if stated and stated.casefold() != run.axis.casefold():
        raise ConfigurationError("table_of_another_axis", file=name, stated=stated, wanted=run.axis)


def _check_stated(
    control: Control,
    rule: GridRule,
    read: ReadTable | None,
    *,
    replaced: bool,
) -> None:
    """Refuse a reversal value that stays in force, or did not act, whatever the new file holds."""
    if rule.per_direction:
        if read is not None:
            raise ConfigurationError(
                "reversal_in_points", key="--backlash-in-force", control=control.title
            )
    elif not rule.backlash_apart:
        raise ConfigurationError(
            "no_place_for_reversal", key="--backlash-in-force", control=control.title
        )
    elif not replaced:
        raise ConfigurationError("reversal_stays_in_force", key="--backlash-in-force")
