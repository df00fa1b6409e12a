"""One fit by one peer, in a program of its own so that its time and memory can be bounded.

    python benchmarks/identification_peers.py PEER CASE.npz

CASE.npz holds `u`, `y`, `v` (inputs of the other test) and `sample_time_s`. Printed is one line of
JSON: `fit_s`, the time of the fit without imports and without the compilation of a first call
where a peer compiles, and `y`, the free run on `v` from rest. Orders are 3 throughout, as in the
truth; where a peer takes a delay it is one row. Peers are called as their documentation does.
"""

import json
import sys
import time
import warnings
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lstsq

Array: TypeAlias = NDArray[np.float64]
Fit: TypeAlias = Callable[[Array, Array, Array, float], Array]

ORDER = 3
LAGS_S = (300.0, 900.0, 2700.0, 7200.0, 14400.0, 28800.0)
"""Fixed exponential averages of the regression. [s]"""


def _averages(u: Array, step_s: float) -> Array:
    from scipy.signal import lfilter

    columns = []
    for column in u.T:
        for tau_s in LAGS_S:
            keep = np.exp(-step_s / tau_s)
            state, _ = lfilter([0.0, 1.0 - keep], [1.0, -keep], column, zi=[column[0]])
            columns.append(state)
    return np.column_stack(columns)


def static(u: Array, y: Array, v: Array, _step_s: float) -> Array:
    columns = np.column_stack([u, np.ones(len(u))])
    gains = lstsq(columns, y)[0]
    return np.asarray(v @ gains[:-1])


def averages(u: Array, y: Array, v: Array, step_s: float) -> Array:
    columns = np.column_stack([_averages(u, step_s), np.ones(len(u))])
    gains = lstsq(columns, y)[0]
    return np.asarray(_averages(v, step_s) @ gains[:-1])


def ridge_averages(u: Array, y: Array, v: Array, step_s: float) -> Array:
    columns = np.column_stack([u, _averages(u, step_s)])
    columns, middle = columns - columns.mean(axis=0), y - y.mean()
    gram = columns.T @ columns
    gains = np.linalg.solve(gram + 1e-3 * np.diag(np.diag(gram)), columns.T @ middle)
    return np.asarray(np.column_stack([v, _averages(v, step_s)]) @ gains)


def _sippy(method: str, u: Array, y: Array, v: Array) -> Array:
    from scipy.signal import lfilter
    from sippy_unipi import functionsetSIM, system_identification

    both, none = [[ORDER, ORDER]], [[0, 0]]
    if method == "OE":
        model = system_identification(
            y[None, :], u.T, "OE", OE_orders=[both, [ORDER], none], max_iterations=100
        )
    elif method == "ARX":
        model = system_identification(y[None, :], u.T, "ARX", ARX_orders=[[ORDER], both, none])
    else:
        model = system_identification(y[None, :], u.T, method, SS_fixed_order=ORDER)
        _, out = functionsetSIM.SS_lsim_process_form(
            model.A, model.B, model.C, model.D, v.T, np.zeros((ORDER, 1))
        )
        return np.asarray(out)[0]
    out = np.zeros(len(v))
    for i in range(2):
        below, above = np.array(model.DENOMINATOR[0][i]), np.array(model.NUMERATOR[0][i])
        above = np.concatenate([np.zeros(below.size - above.size), above])
        out += np.asarray(lfilter(above, below, v[:, i]))
    return out


def sippy_oe(u: Array, y: Array, v: Array, _step_s: float) -> Array:
    return _sippy("OE", u, y, v)


def sippy_arx(u: Array, y: Array, v: Array, _step_s: float) -> Array:
    return _sippy("ARX", u, y, v)


def sippy_n4sid(u: Array, y: Array, v: Array, _step_s: float) -> Array:
    return _sippy("N4SID", u, y, v)


def sysidentpy(u: Array, y: Array, v: Array, _step_s: float) -> Array:
    from sysidentpy.basis_function import Polynomial
    from sysidentpy.model_structure_selection import FROLS
    from sysidentpy.parameter_estimation import LeastSquares

    lags = list(range(1, ORDER + 1))
    model = FROLS(
        order_selection=True, n_info_values=9, ylag=lags, xlag=[lags, lags],
        estimator=LeastSquares(), basis_function=Polynomial(degree=1),
    )  # fmt: skip
    model.fit(X=u, y=y[:, None])
    start = np.zeros((ORDER, 1))
    return np.asarray(model.predict(X=v, y=start)).ravel()


def nfoursid(u: Array, y: Array, v: Array, _step_s: float) -> Array:
    import pandas as pd
    from nfoursid.nfoursid import NFourSID
    from nfoursid.state_space import StateSpace

    frame = pd.DataFrame({"a": u[:, 0], "b": u[:, 1], "y": y})
    method = NFourSID(frame, output_columns=["y"], input_columns=["a", "b"], num_block_rows=20)
    method.subspace_identification()
    found, _ = method.system_identification(rank=ORDER)
    model = StateSpace(found.a, found.b, found.c, found.d)
    return np.array([float(model.step(row[:, None])[0, 0]) for row in v])


def jax_sysid(u: Array, y: Array, v: Array, _step_s: float) -> Array:
    from jax_sysid.models import LinearModel

    spread_u, spread_y = u.std(axis=0), y.std()
    model = LinearModel(ORDER, 1, 2, feedthrough=False)
    model.loss(rho_x0=1e-3, rho_th=1e-4)
    model.optimization(adam_epochs=500, lbfgs_epochs=500, iprint=-1)
    model.fit(y[:, None] / spread_y, u / spread_u)
    out, _ = model.predict(np.zeros(ORDER), v / spread_u)
    return np.asarray(out).ravel() * spread_y


def control_okid(u: Array, y: Array, v: Array, _step_s: float) -> Array:
    import control

    count = 100
    markov = control.markov(y[None, :], u.T, count, dt=True)
    model, _ = control.eigensys_realization(
        np.asarray(markov).reshape(1, 2, -1)[:, :, 1:], ORDER, dt=True
    )
    _, out = control.forced_response(model, np.arange(len(v)), v.T)
    return np.asarray(out).reshape(-1)


def statsmodels_ardl(u: Array, y: Array, v: Array, _step_s: float) -> Array:
    from statsmodels.tsa.ardl import ARDL

    result = ARDL(y, ORDER, u, ORDER, causal=True, trend="n").fit()
    a = np.asarray(result.params)
    own, others = a[:ORDER], a[ORDER:].reshape(2, ORDER)
    out = np.zeros(len(v))
    for k in range(ORDER, len(v)):
        past = slice(k - ORDER, k)
        out[k] = own @ out[past][::-1] + sum(others[i] @ v[past, i][::-1] for i in range(2))
    return out


BASELINES: dict[str, Fit] = {
    "static regression": static,
    "6 averages": averages,
    "6 averages, ridge": ridge_averages,
}
PEERS: dict[str, Fit] = {
    "SIPPY ARX": sippy_arx,
    "SIPPY N4SID": sippy_n4sid,
    "SIPPY OE": sippy_oe,
    "SysIdentPy FROLS": sysidentpy,
    "nfoursid": nfoursid,
    "jax-sysid": jax_sysid,
    "python-control ERA": control_okid,
    "statsmodels ARDL": statsmodels_ardl,
}


def main() -> None:
    name, path = sys.argv[1:3]
    with np.load(path) as case:
        u, y, v, step_s = case["u"], case["y"], case["v"], float(case["sample_time_s"])
    warnings.simplefilter("ignore")
    if name == "jax-sysid":
        import jax

        jax.config.update("jax_enable_x64", val=True)
    began = time.perf_counter()
    out = PEERS[name](u, y, v, step_s)
    fit_s = time.perf_counter() - began
    finite = np.nan_to_num(out, nan=1e9, posinf=1e9, neginf=-1e9).clip(-1e9, 1e9)
    print("RESULT " + json.dumps({"fit_s": fit_s, "y": finite.tolist()}))


if __name__ == "__main__":
    main()
