"""The sign and the unit of a machine's offset, in words: neither has a default."""

from typing import Final

from thermaxis.errors import ConfigurationError, require_known

AWAY: Final = "positive moves the tool away from the workpiece"
"""The machine counts as the correction does."""
TOWARDS: Final = "positive moves the tool towards the workpiece"
"""The machine counts the other way round."""
SIGNS: Final = {AWAY: 1.0, TOWARDS: -1.0}
"""Factor from a correction to the machine's offset, by the sentence that says so."""
OFFSET_UNITS: Final = {
    "um": 1.0,
    "0.1 um": 10.0,
    "mm": 1e-3,
    "m": 1e-6,
    "inch": 1.0 / 25_400.0,
}
"""How many of the machine's units one micrometre is, by the unit's name."""


def offset_factor(unit: str, sign: str) -> float:
    """Return by what a correction is multiplied to give the machine's offset.

    A correction is positive when it moves the tool point away from the workpiece, as the
    displacement that it takes away is counted.

    Not protected: a wrong sentence doubles the error instead of taking it away. ``thermaxis
    commission`` proves it on the machine.

    Parameters
    ----------
    unit : str
        Unit of the machine's offset, a key of `OFFSET_UNITS`.
    sign : str
        What a positive offset of the machine means, a key of `SIGNS`.

    Returns
    -------
    float
        Machine's units per micrometre, with sign. [1/µm]

    Raises
    ------
    ConfigurationError
        If the unit or the sentence is not known.
    """
    require_known("unit", [unit], OFFSET_UNITS, "unknown_choice")
    if sign not in SIGNS:
        raise ConfigurationError("unknown_sign", sign=sign, away=AWAY, towards=TOWARDS, key="sign")
    return SIGNS[sign] * OFFSET_UNITS[unit]
