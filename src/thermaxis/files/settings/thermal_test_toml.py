"""Set-up of a thermal test, from a file."""

from pathlib import Path

from thermaxis.files.settings._reading import read_toml, settings_of
from thermaxis.thermal import ThermalTestSetup


def read_thermal_test_setup(path: Path) -> ThermalTestSetup:
    """Read the set-up of a thermal test.

    Parameters
    ----------
    path : Path
        TOML whose keys are the fields of `ThermalTestSetup`: tables ``[probes]`` (x1, x2, y1, y2,
        z, distance_mm) or ``[targets]`` (first, second), ``[motion]`` (speed, highest,
        running_min), ``[uncertainty]`` (probe_um, resolution_um, fixture_um_per_k, distance_mm),
        and ``ambient`` and ``spans_h`` before them.

    Returns
    -------
    ThermalTestSetup
        What it says.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, a key is unknown, or a value is not possible.
    """
    return settings_of(ThermalTestSetup, read_toml(path), file=str(path))
