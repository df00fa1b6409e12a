"""What corrected the axis while the run was measured: an older table, a reversal value."""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import final

import numpy as np

from thermaxis.cli.axis._axis_run import AxisRun
from thermaxis.cli.axis._table_files import read_table_text
from thermaxis.controls import Control, GridRule, ReadTable
from thermaxis.errors import ConfigurationError, DataError, MeasurementFileError
from thermaxis.positioning import CompensationTable, FloatArray

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
    text, unusual = read_table_text(path)
    try:
        read = control.read_table(text, str(path), run.test.kind, options)
    except DataError as error:
        raise MeasurementFileError(
            error.what, path=str(path), remedy=error.remedy or "Look for a wrong number in it"
        ) from None
    largest = max(float(np.max(np.abs(v))) for v in (read.table.position, read.table.deviation))
    if largest > _LARGEST:
        raise MeasurementFileError(
            "a position or value is larger than any axis has",
            path=str(path),
            remedy="Look for a missing decimal point",
        )
    return replace(read, findings=(*unusual, *read.findings))


def _check_same_axis(read: ReadTable, run: AxisRun, name: str) -> None:
    stated = read.table.axis
    if stated and stated.casefold() != run.axis.casefold():
        raise ConfigurationError(
            f"the older table is of axis {stated}, the new one would be of {run.axis}",
            where=name,
            remedy=f"Say --axis {stated} if the run was measured on that axis",
        )


def _check_stated(
    control: Control, rule: GridRule, read: ReadTable | None, *, replaced: bool
) -> None:
    """Refuse a reversal value that stays in force, or did not act, whatever the new file holds."""
    where = "--backlash-in-force"
    if rule.per_direction:
        if read is not None:
            raise ConfigurationError(
                "the older table has a value for each direction: beside it the control's own"
                " reversal value counts as 0, or as the older file states it",
                where=where,
                remedy="Leave it out",
            )
    elif not rule.backlash_apart:
        raise ConfigurationError(
            f"the table of {control.title} has no place for the reversal: the control's own value"
            " stays in force",
            where=where,
            remedy="Leave it out",
        )
    elif not replaced:
        raise ConfigurationError(
            "the file does not write the control's reversal value, which stays in force",
            where=where,
            remedy="Give --backlash as well, or leave it out",
        )
