"""Set-up of a thermal test, from a file."""

from pathlib import Path

from thermaxis.files.settings._reading import read_toml, settings_of
from thermaxis.thermal import ThermalTestSetup


def read_thermal_test_setup(path: Path) -> ThermalTestSetup:
    """Read the set-up of a thermal test: TOML whose keys are the fields of `ThermalTestSetup`.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, a key is unknown, or a value is not possible.
    """
    return settings_of(ThermalTestSetup, read_toml(path), file=str(path))
