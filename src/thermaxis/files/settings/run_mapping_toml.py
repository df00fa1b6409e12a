"""Mapping file of a run, TOML: what its columns hold, and what else the file leaves open.

.. code-block:: toml

    decimal = "comma"
    position_unit = "mm"

    [columns]
    "X3" = "target"
    "Wert" = { role = "deviation", unit = "um" }
    "Hin 2 neu" = { cycle = 2, direction = "forward", unit = "um" }

    [directions]
    "li" = "forward"
"""

from dataclasses import replace
from pathlib import Path

from thermaxis.codes import printable
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings._reading import as_table, read_toml, settings_of
from thermaxis.files.table import RunMapping, parse_heading, unit_named


def read_run_mapping(path: Path | str) -> RunMapping:
    """Read a mapping file of a run.

    Parameters
    ----------
    path : Path or str
        The file: the fields of `RunMapping`; a column may have its role alone as a text.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, is no TOML, a key is not known, or a value has the wrong type
        or makes no sense.
    """
    file = str(path)
    tables = read_toml(path)
    columns = {
        heading: {"role": entry} if isinstance(entry, str) else entry
        for heading, entry in as_table(file, "columns", tables.get("columns", {})).items()
    }
    mapping = settings_of(RunMapping, {**tables, "columns": columns}, file=file)
    return _checked(mapping, file)


def _checked(mapping: RunMapping, file: str) -> RunMapping:
    """Return a mapping after a look at its units, passes and numbers."""
    units = {"position_unit": mapping.position_unit, "deviation_unit": mapping.deviation_unit}
    for heading, column in mapping.columns.items():
        key = f"columns.{printable(heading)}"
        if column.role != "time":
            units[f"{key}.unit"] = column.unit
        elif parse_heading(f"time ({column.unit})").role is None:
            units[f"{key}.unit"] = "?"
        if (column.cycle is None) != (column.direction is None) or (column.cycle or 1) < 1:
            raise ConfigurationError("pass_incomplete", file=file, key=key)
    for key, unit in units.items():
        if unit and unit_named(unit) is None:
            raise ConfigurationError("unknown_unit", unit=printable(unit, 60), file=file, key=key)
    if mapping.target_tolerance is not None and not 0.0 <= mapping.target_tolerance <= 1e6:
        raise ConfigurationError(
            "outside_range",
            value=mapping.target_tolerance,
            least=0.0,
            most=1e6,
            file=file,
            key="target_tolerance",
        )
    return replace(
        mapping, columns={heading.strip(): one for heading, one in mapping.columns.items()}
    )
