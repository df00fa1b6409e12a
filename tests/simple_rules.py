"""Free run of a simple rule, by the models that lags side by side make."""

import numpy as np

from thermaxis.thermal import BaselineModel, ModalPart, ThermalModel, simulate_modal


def simulate_baseline(model: BaselineModel, u: np.ndarray, sample_time_s: float) -> np.ndarray:
    if not model.gains_um_per_k.size:  # persistence
        return np.full(u.shape[0], model.offset_um)
    lags_s = np.array(model.lags_s)
    parts = [ModalPart(f"u{k}", g[0], g[1:], lags_s) for k, g in enumerate(model.gains_um_per_k)]
    return simulate_modal(ThermalModel(tuple(parts), model.offset_um), sample_time_s, u)
