"""Conditions of a thermal test that is planned, from a file."""

from pathlib import Path

from thermaxis.codes import printable
from thermaxis.files.settings._reading import as_table, read_toml, settings_of
from thermaxis.thermal import HeatingConditions, HeatSource


def read_heating_conditions(path: Path) -> HeatingConditions:
    """Read what may be switched and what is known: TOML whose keys are `HeatingConditions`' fields.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, a key is unknown, or a value is not possible.
    """
    table, file = read_toml(path), str(path)
    for name, source in as_table(file, "sources", table.get("sources", {})).items():
        settings_of(HeatSource, source, file=file, key=f"sources.{printable(name, 40)}")
    return settings_of(HeatingConditions, table, file=file)
