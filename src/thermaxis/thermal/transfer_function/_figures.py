"""How well a simulated displacement follows the measured one."""

import numpy as np

from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray


def paired(measured_um: FloatArray, simulated_um: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the rows in which both displacements are present."""
    measured = np.asarray(measured_um, dtype=np.float64)
    simulated = np.asarray(simulated_um, dtype=np.float64)
    if measured.shape != simulated.shape or measured.ndim != 1:
        raise DataError(
            "wrong_shape", shape=f"{measured.shape}, {simulated.shape}", expected="(n,), (n,)"
        )
    both = ~(np.isnan(measured) | np.isnan(simulated))
    if not bool(np.any(both)):
        raise DataError("no_row_to_compare")
    return measured[both], simulated[both]


def fit_percent(measured_um: FloatArray, simulated_um: FloatArray) -> float:
    """Return the fit of a simulated displacement.

    Parameters
    ----------
    measured_um : FloatArray
        Measured displacement, (n,); NaN where not measured. [µm]
    simulated_um : FloatArray
        Simulated displacement, (n,). [µm]

    Returns
    -------
    float
        100 for a perfect model, 0 for one that is no better than the mean of the measured
        displacement, below 0 for a worse one. [%]

    Raises
    ------
    DataError
        If the shapes differ, no row has both, or the measured displacement is constant.

    Notes
    -----
    The formula as printed takes the mean of the simulated displacement, its text that of the
    measured one. The measured one is taken: only then is 0 the same model for everyone.

    References
    ----------
    Mareš and Horejš 2021, equation (4).
    """
    measured, simulated = paired(measured_um, simulated_um)
    spread = _spread(measured)
    return 100.0 * (1.0 - float(np.linalg.norm(measured - simulated)) / spread)


def _spread(measured: FloatArray) -> float:
    if float(np.ptp(measured)) == 0.0:
        raise DataError("fit_undefined", rows=measured.size, value_um=float(measured[0]))
    return float(np.linalg.norm(measured - np.mean(measured)))
