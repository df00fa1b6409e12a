"""How well a simulated displacement follows the measured one."""

from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.errors import DataError
from thermaxis.thermal._arrays import FloatArray


@final
@dataclass(frozen=True, slots=True)
class SimulationFigures:
    """Figures of a free run against the measured displacement."""

    rows: int
    """Rows in which both were present. [1]"""
    fit_percent: float
    """100 (1 - norm of the residual / norm of the measured about its mean). [%]"""
    peak_to_peak_um: float
    """Range of the measured displacement: the machine without compensation. [µm]"""
    residual_peak_to_peak_um: float
    """Range of measured minus simulated: the machine with compensation. [µm]"""
    rmse_um: float
    """Root mean square of the residual. [µm]"""
    mae_um: float
    """Mean absolute residual. [µm]"""
    max_um: float
    """Largest absolute residual. [µm]"""

    @property
    def reduction(self) -> float:
        """Peak-to-peak without over with compensation; infinite where nothing is left. [1]"""
        left = self.residual_peak_to_peak_um
        return self.peak_to_peak_um / left if left > 0 else float("inf")


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


def simulation_figures(measured_um: FloatArray, simulated_um: FloatArray) -> SimulationFigures:
    """Evaluate a free run against the measured displacement, both (n,). [µm]

    NaN where not measured; errors are those of `fit_percent`.

    References
    ----------
    Mareš and Horejš 2021, equation (4) and the peak-to-peak approach of section 3.1.
    """
    measured, simulated = paired(measured_um, simulated_um)
    residual = measured - simulated
    return SimulationFigures(
        rows=residual.size,
        fit_percent=100.0 * (1.0 - float(np.linalg.norm(residual)) / _spread(measured)),
        peak_to_peak_um=float(np.ptp(measured)),
        residual_peak_to_peak_um=float(np.ptp(residual)),
        rmse_um=float(np.sqrt(np.mean(residual**2))),
        mae_um=float(np.mean(np.abs(residual))),
        max_um=float(np.max(np.abs(residual))),
    )
