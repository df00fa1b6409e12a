"""Gains and time constants that change while a log runs, as where coolant is switched on."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from thermaxis.codes import Message
from thermaxis.thermal import (
    Identification,
    ModalOptions,
    ModalPart,
    Records,
    ThermalLog,
    ThermalModel,
    identify,
    parse_input,
    records_of,
    simulate_from_rest,
    simulate_switched,
)

STEP_S = 60.0


def one_input(*lags: tuple[float, float]) -> ThermalModel:
    gains, taus_s = np.array(lags).T
    return ThermalModel((ModalPart("head", 0.5, gains, taus_s),))


DRY = one_input((26.0, 3000.0), (9.0, 400.0))
WET = one_input((12.0, 900.0), (9.0, 400.0))


def heat(rows: int) -> np.ndarray:
    random = np.random.default_rng(3)
    share = np.repeat(random.uniform(0.0, 1.0, rows // 30 + 1), 30)[:rows]
    heated = one_input((8.0, 1200.0))
    return (simulate_from_rest(heated, STEP_S, share[:, None]) - 0.5 * share)[:, None]


def wet_rows(rows: int) -> np.ndarray:
    edges = np.cumsum(np.random.default_rng(4).uniform(25.0, 90.0, rows // 25))
    return np.searchsorted(edges, np.arange(rows)) % 2 == 1


def test_one_model_in_both_regimes_is_that_model() -> None:
    u = heat(300)
    switched = simulate_switched((DRY, DRY), STEP_S, u, wet_rows(300))
    assert switched == pytest.approx(simulate_from_rest(DRY, STEP_S, u), abs=1e-9)


def test_lags_that_switch_follow_their_differential_equation_and_do_not_leap() -> None:
    u, on = heat(240), wet_rows(240)

    def slope(t: float, x: np.ndarray) -> np.ndarray:
        row = min(int(t / STEP_S), 239)
        (part,) = (WET if on[row] else DRY).parts
        return np.asarray((part.gains * u[row] - x) / part.time_constants_s)

    state, found = np.zeros(2), [0.0]
    for row in range(239):
        span = (row * STEP_S + 1e-6, (row + 1) * STEP_S - 1e-6)
        state = solve_ivp(slope, span, state, rtol=1e-9, atol=1e-9).y[:, -1]
        found.append(float(state.sum()))
    lagged = simulate_switched((DRY, WET), STEP_S, u, on) - 0.5 * u[:, 0]
    assert lagged == pytest.approx(np.array(found), abs=1e-4)


def identified(**columns: np.ndarray) -> tuple[Identification, Records]:
    log = ThermalLog.from_columns(columns, time_s=STEP_S * np.arange(len(columns["Z_um"])))
    records = records_of([log], [parse_input("head=T_c", channels=columns)], ["Z_um"])
    return identify(records), records


def made(rows: int = 360) -> dict[str, np.ndarray]:
    u, on = heat(rows), wet_rows(rows)
    noise = np.random.default_rng(5).normal(0.0, 0.1, rows)
    z = simulate_switched((DRY, WET), STEP_S, u, on) + noise
    return {"T_c": 20.0 + u[:, 0], "Z_um": z, "coolant_on": on.astype(np.float64)}


def codes(found: Identification) -> set[str]:
    return {message.code for message in found.messages}


def test_a_column_that_tells_the_regime_is_named_and_both_models_are_found() -> None:
    columns = made()
    found, records = identified(**columns)
    (told,) = [m for m in found.messages if m.code == "warning-two_regimes_by"]
    assert told.values["column"] == "coolant_on"
    edges = np.flatnonzero(np.diff(columns["coolant_on"]))
    assert told.values["stretches"] == np.ceil(edges.size / 2)
    assert isinstance(told.values["rows"], tuple)
    for rows in told.values["rows"]:
        assert isinstance(rows, Message)
        assert {rows.values["first"] - 1, rows.values["last"]} <= {
            *edges.tolist(),
            columns["Z_um"].size - 1,
        }
    (regimes,) = found.outputs[0].regimes
    assert "warning-two_regimes_gains" in codes(found)
    for model, true in zip(regimes.models, (DRY, WET), strict=True):
        assert model.parts[0].dc_gain == pytest.approx(true.parts[0].dc_gain, rel=0.1)
    assert regimes.held_out_rmse_um < 0.2 * np.std(columns["Z_um"])
    assert regimes.held_out_rmse_um < 0.8 * regimes.one_model_rmse_um
    delayed = ModalOptions(delays_s=(0.0,))
    assert not {c for c in codes(identify(records, modal_options=delayed)) if "regimes" in c}


@pytest.mark.proof
def test_rows_held_out_are_measured_ones_and_gains_are_told_of_a_log_by_its_name() -> None:
    first, second = made(), made()
    first["Z_um"][260:] = np.nan
    logs = [
        ThermalLog.from_columns(c, time_s=STEP_S * np.arange(360), name=name)
        for c, name in ((first, "a.csv"), (second, "b.csv"))
    ]
    found = identify(records_of(logs, [parse_input("head=T_c", channels=first)], ["Z_um"]))
    told = [m for m in found.messages if m.code == "warning-two_regimes_gains"]
    assert [m.values["log"] for m in told] == [r.log for r in found.outputs[0].regimes]
    assert [m.values["log"] for m in told] == ["a.csv", "b.csv"]


@pytest.mark.proof
def test_no_gains_are_told_where_one_model_leaves_as_little() -> None:
    columns = made()
    late = columns["coolant_on"].size * 7 // 10
    columns["Z_um"][late:] = np.random.default_rng(8).normal(0.0, 80.0, 360 - late)
    found, _ = identified(**columns)
    assert "warning-two_regimes_gains" not in codes(found)
    assert not found.outputs[0].regimes


@pytest.mark.proof
def test_a_column_that_cools_by_itself_is_no_regime() -> None:
    columns = made()
    u, on = columns["T_c"][:, None] - 20.0, columns["coolant_on"]
    noise = np.random.default_rng(6).normal(0.0, 6.0, on.size)
    cooled = (
        simulate_from_rest(DRY, STEP_S, u)
        + noise
        + simulate_from_rest(one_input((-30.0, 1500.0)), STEP_S, on[:, None])
    )
    assert not {c for c in codes(identified(**columns | {"Z_um": cooled})[0]) if "regimes" in c}
