"""Conditions of a thermal test that is planned, from a file."""

from pathlib import Path

from thermaxis.files.settings._reading import read_toml, settings_of
from thermaxis.thermal import HeatingConditions


def read_heating_conditions(path: Path) -> HeatingConditions:
    """Read what may be switched and what is known: TOML whose keys are `HeatingConditions`' fields.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, a key is unknown, or a value is not possible.
    """
    return settings_of(HeatingConditions, read_toml(path), file=str(path))
