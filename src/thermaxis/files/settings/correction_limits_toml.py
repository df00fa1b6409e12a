"""Limits of corrections as TOML: one table per output of a model.

.. code-block:: toml

    [Z_um]
    largest_um = 100.0
    largest_rate_um_per_s = 0.05
"""

from pathlib import Path

from thermaxis.compensation import Limits
from thermaxis.errors import ConfigurationError, printable
from thermaxis.files.settings._settings_file import as_table, read_toml

_KEYS = ("largest_um", "largest_rate_um_per_s")
_EXAMPLE = "Write a table such as [Z_um] with largest_um = 100.0 and largest_rate_um_per_s = 0.05"


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
    name = str(path)
    limits: dict[str, Limits] = {}
    for output, table in read_toml(path, remedy=_EXAMPLE).items():
        where = f"{name}, table {printable(output, 60)}"
        values = as_table(name, printable(output, 60), table)
        unknown = [key for key in values if key not in _KEYS]
        lacking = [key for key in _KEYS if key not in values]
        if unknown or lacking:
            wrong = f"unknown key {unknown[0]}" if unknown else f"the key {lacking[0]} is missing"
            raise ConfigurationError(wrong, where=where, remedy=_EXAMPLE)
        numbers: list[float] = []
        for key in _KEYS:
            value = values[key]
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise ConfigurationError(f"{key} is not a number", where=where, remedy=_EXAMPLE)
            numbers.append(float(value))
        try:
            limits[output] = Limits(*numbers)
        except ConfigurationError as error:
            raise ConfigurationError(error.what, where=f"{where}, key {error.where}") from None
    if not limits:
        raise ConfigurationError("the file states no limits", where=name, remedy=_EXAMPLE)
    return limits
