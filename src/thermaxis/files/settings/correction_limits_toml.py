"""Limits of corrections as TOML: one table per output of a model.

.. code-block:: toml

    [Z_um]
    largest_um = 100.0
    largest_rate_um_per_s = 0.05
"""

from pathlib import Path

from thermaxis.codes import printable
from thermaxis.compensation import Limits
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings._document import Form, SettingsTable, read_all
from thermaxis.files.settings._settings_file import read_toml

_FORM = Form("limits")
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
        keys = SettingsTable(_FORM, name, printable(output, 60), table)
        try:
            limits[output] = read_all(keys, _limits)
        except ConfigurationError as error:
            if error.where.startswith(name):
                raise
            raise keys.wrong(error.where, error.what.removeprefix("the value is ")) from None
    if not limits:
        raise ConfigurationError("the file states no limits", where=name, remedy=_EXAMPLE)
    return limits


def _limits(of: SettingsTable) -> Limits:
    return Limits(of.number("largest_um"), of.number("largest_rate_um_per_s"))
