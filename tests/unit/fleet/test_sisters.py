"""A new machine starts from the median of its sisters' models, beside machines that are known."""

from dataclasses import replace

import numpy as np
import pytest

from tests.refusals import refused
from tests.unit.fleet.fleet_machines import GAIN, LAST, TAU_MIN, Truth, model_of
from tests.unit.fleet.test_night import days_of
from thermaxis.cli import main
from thermaxis.compensation import CompensationModel, Output, Part, Provenance, Section
from thermaxis.files import model_sha256, read_model, write_model
from thermaxis.fleet import NightOutcome, NightResult, Registry, night, sister_model

STEP_S = 300.0
GAINS, LAGS_S = (10.0, 6.0), (1200.0, 9000.0)
SPREAD, IDENTIFIED = 0.2, 0.1
"""Standard deviation of what machines of a kind differ by, and of what is identified of each."""


def machine(gains: np.ndarray, lags_s: np.ndarray, name: str = "Z_um") -> CompensationModel:
    sections = tuple(map(Section, gains.tolist(), lags_s.tolist()))
    part = Part("spindle", "T_spindle_C", "T_column_C", sections=sections)
    return CompensationModel(outputs=(Output(name, (part,)),))


def called(model: CompensationModel, name: str) -> CompensationModel:
    """Return an equal model with a file of its own."""
    return replace(model, provenance=Provenance(method=name, program="p"))


def spread(random: np.random.Generator, model: CompensationModel, by: float) -> CompensationModel:
    (part,) = model.outputs[0].parts
    gains, lags_s = (
        np.array([getattr(s, key) for s in part.sections])
        * np.exp(random.normal(0.0, by, len(part.sections)))
        for key in ("gain_um_per_k", "time_constant_s")
    )
    return machine(gains, lags_s)


def moved_um(model: CompensationModel, heat_k: np.ndarray) -> np.ndarray:
    """Return the free run, worked out step by step."""
    found = np.zeros(heat_k.size)
    for section in model.outputs[0].parts[0].sections:
        state, alpha = 0.0, 1.0 - np.exp(-STEP_S / section.time_constant_s)
        for k, heat in enumerate(heat_k):
            state += alpha * (heat - state)
            found[k] += section.gain_um_per_k * state
    return found


def test_the_median_leaves_less_than_a_sister_does_even_where_one_sister_is_wrong() -> None:
    random = np.random.default_rng(22)
    kind = machine(np.array(GAINS), np.array(LAGS_S))
    heat_k = np.repeat(random.uniform(0.0, 10.0, 24), 12)
    sisters = [spread(random, spread(random, kind, SPREAD), IDENTIFIED) for _ in range(12)]
    (part,) = sisters[3].outputs[0].parts
    wrong = tuple(replace(s, gain_um_per_k=3.0 * s.gain_um_per_k) for s in part.sections)
    sisters[3] = replace(kind, outputs=(Output("Z_um", (replace(part, sections=wrong),)),))
    start = sister_model({f"M{k}": one for k, one in enumerate(sisters)})
    ran = np.array([moved_um(one, heat_k) for one in [*sisters, start]])
    new = [moved_um(spread(random, kind, SPREAD), heat_k) for _ in range(60)]
    left = np.mean([np.sqrt(np.mean((ran - true) ** 2, axis=1)) for true in new], axis=0)
    by_sister, by_median = left[:-1], left[-1]
    least = np.mean([np.sqrt(np.mean((moved_um(kind, heat_k) - true) ** 2)) for true in new])
    assert by_median < 0.8 * np.median(by_sister)
    assert by_median < np.min(by_sister)
    assert by_median < 1.1 * least


def test_the_median_of_equal_models_is_that_model_and_says_what_it_is() -> None:
    kind = machine(np.array(GAINS), np.array(LAGS_S))
    one = sister_model({name: called(kind, name) for name in "ABC"})
    (part,) = one.outputs[0].parts
    for found, true in zip(part.sections, kind.outputs[0].parts[0].sections, strict=True):
        assert found.gain_um_per_k == pytest.approx(true.gain_um_per_k, rel=1e-6)
        assert found.time_constant_s == pytest.approx(true.time_constant_s)
    assert part.direct_gain_um_per_k == 0.0
    assert "A, B, C" in one.provenance.method


def test_machines_that_are_built_differently_or_too_few_have_no_median() -> None:
    other = machine(np.array(GAINS), np.array(LAGS_S), "Y_um")
    two = {name: called(model_of(), name) for name in "AB"}
    with refused("too_few_sisters", count=2):
        sister_model(two)
    with refused("too_few_sisters", count=2):  # one machine under two names
        sister_model({**two, "C": two["A"]})
    median = sister_model({**two, "C": called(model_of(), "C"), "D": two["A"]})
    assert median.provenance.method.endswith(" A, B, C")
    with refused("too_few_sisters", count=2):  # a median tells nothing of a machine
        sister_model({**two, "C": median})
    with refused("sisters_differ", name="C", other="A"):
        sister_model({**two, "C": other})


@pytest.mark.proof
def test_three_days_of_touches_take_a_new_machine_from_the_median_to_its_own_model() -> None:
    """Shrunk towards the median, as gains and time constants have a prior about those in force."""
    random = np.random.default_rng(1)
    kind = machine(np.array([1.25 * GAIN]), np.array([75.0 * TAU_MIN]))
    start = sister_model({f"M{k}": spread(random, kind, 0.1) for k in range(5)})
    found = night("new", start, days_of(Truth()), LAST)
    assert found is not None
    assert found.proposal is not None
    left_um: list[float] = []
    for one in (start, found.proposal):  # on days that neither has seen
        later = night("new", one, days_of(Truth(50)), LAST)
        assert later is not None
        assert later.outputs is not None
        left_um.append(later.outputs["Z_um"].rmse_um)
    assert left_um[1] < 0.5 * left_um[0]


def test_a_new_machine_is_added_with_a_model_that_is_written(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lake").mkdir()
    assert main(["fleet", "init", "r.db", "lake"]) == 0
    new = ["fleet", "add", "r.db", "new", "new.json", "--kind", "mill", "--from-sisters"]
    for k, gain in enumerate((7.0, 8.0, 12.0)):
        assert main(new) == 2
        assert f"has {k} other machines" in capsys.readouterr().err
        for name, of in ((f"M{k}", gain), (f"N{k}", gain + 20.0)):  # of N is no night
            write_model(model_of(of), "m.json")
            assert main(["fleet", "add", "r.db", name, "m.json", "--kind", "mill"]) == 0
        stored = {"machine": f"M{k}", "model_sha256": model_sha256(model_of(gain))}
        night_of = NightResult(**stored, day=LAST, outcome=NightOutcome.UNVERIFIED)
        with Registry("sqlite:///r.db") as registry:
            registry.record([night_of])
    capsys.readouterr()
    assert main(new) == 0
    assert "new.json, median of the models of M0, M1, M2\n" in capsys.readouterr().out
    assert read_model("new.json").outputs[0].parts[0].dc_gain_um_per_k == pytest.approx(8.0)
    assert main(new) == 2  # no file is written over
