"""Limits of corrections as TOML: one table per output of a model.

.. code-block:: toml

    [Z_um]
    largest_um = 100.0
    largest_rate_um_per_s = 0.05
"""

from dataclasses import dataclass
from pathlib import Path

from thermaxis.codes import Place
from thermaxis.compensation import Limits
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings._reading import read_toml, settings_of


@dataclass(frozen=True, slots=True)
class _Stated:
    """Keys of an output: what else is limited stands in the configuration of a machine."""

    largest_um: float
    largest_rate_um_per_s: float


def read_correction_limits(path: Path | str) -> dict[str, Limits]:
    """Read the limits of corrections.

    Parameters
    ----------
    path : Path or str
        The file, TOML in UTF-8.

    Returns
    -------
    dict
        Limits by output; at least one.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, is no TOML, or a table lacks a limit, has an unknown key, or a
        value that cannot be.
    """
    file = str(path)
    stated = settings_of(dict[str, _Stated], read_toml(path), file=file)
    if not stated:
        raise ConfigurationError("no_limits", file=file)
    limits: dict[str, Limits] = {}
    for output, one in stated.items():
        try:
            limits[output] = Limits(one.largest_um, one.largest_rate_um_per_s)
        except ConfigurationError as error:
            raise error.at(Place(file, key=f"{output}.{error.place.key}")) from None
    return limits
