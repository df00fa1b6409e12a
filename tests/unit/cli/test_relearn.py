"""A machine's model is learnt anew from its history, proposed, accepted by a person, taken back."""

import argparse
import json
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Self

import numpy as np
import polars as pl
import pytest

from tests.refusals import refused
from tests.touched_machine import lagged
from tests.unit.runtime.history_records import BEGIN, cycle_record
from tests.unit.runtime.machine_files import machine_file, model
from thermaxis.cli import build_parser, main
from thermaxis.cli.machine import relearn
from thermaxis.codes import Message
from thermaxis.compensation import RequestKind, SampleQuality, cycle_state
from thermaxis.files import read_model, write_model
from thermaxis.runtime import (
    DATUM,
    Applied,
    CycleRecord,
    SavedState,
    SourceSample,
    StateFile,
    read_machine,
)
from thermaxis.runtime.history import DATUM_SET, TIME, Columns, touched_log
from thermaxis.runtime.history._parts import minutes_of
from thermaxis.runtime.host import LocalAnswer


def _words(path: Path, *words: str) -> argparse.Namespace:
    return build_parser(["relearn"]).parse_args(["relearn", str(path), *words])


STEP_S, ROWS, TOUCH = 300, 8 * 288, 6
"""Seconds of a cycle, cycles of eight days, from touch to touch."""
TRUE_S = 1000.0
"""Time constant of the machine; the model in force has 600 s."""


def records(
    rows: int = ROWS, begin: datetime = BEGIN, every: int = TOUCH, seed: int = 1
) -> list[CycleRecord]:
    """Return cycles of a machine that is compensated by a model that is too fast, and touched."""
    random = np.random.default_rng(seed)
    minutes = np.repeat(random.choice([0.0, 0.5, 1.0], rows // 9 + 1), 9 * 5)[: rows * 5]
    heat = 6.0 * lagged(minutes, 1500.0)
    spindle_c = np.round(22.0 + heat[::5], 2)
    true_um, model_um = (10.0 * lagged(heat, s)[::5] for s in (TRUE_S, 600.0))
    acting_um = np.concatenate([[0.0], -model_um[:-1]])  # what was written a cycle before
    shown_um = true_um + acting_um + random.normal(0.0, 0.5, rows)
    found: list[CycleRecord] = []
    for k in range(rows):
        one = cycle_record(k, cycle_s=STEP_S, begin=begin)
        output = one.output._replace(
            correction_um=(float(-model_um[k]),),
            wanted_um=(float(-model_um[k]),),
            model_um=(float(model_um[k]),),
            contribution_um=((float(model_um[k]),),),
            weight=(1.0,),
            trim_um=(0.0,),
            before_um=(0.0,),
            at_limit=(False,),
            values=(float(spindle_c[k]), 22.0),
            qualities=(SampleQuality.GOOD, SampleQuality.GOOD),
            offset_um=(0.0,),
            offset_std_um=(1.0,),
        )
        touched = k % every == 0
        outcome = "excluded" if k % (31 * every) == 0 else "believed"
        told = {"Z_um": outcome} if touched else {"Z_um": DATUM} if k == 1001 else {}
        samples = {
            "T_spindle_C": SourceSample(float(spindle_c[k]), True, "Good", 0.02, None),
            "T_column_C": SourceSample(22.0, True, "Good", 0.02, None),
            "probe.Z_um": SourceSample(
                float(shown_um[k] + 50.0 * (outcome == "excluded")) if touched else None,
                True,
                "Good",
                2.0,
                None,
            ),
        }
        found.append(
            replace(
                one,
                samples=samples,
                output=output,
                channels=("T_spindle_C", "T_column_C"),
                parts=(("spindle",),),
                applied={"Z_um": Applied(None, float(acting_um[k]), None)},
                touched=told,
            )
        )
    return found


@pytest.fixture(scope="module")
def cycles() -> pl.LazyFrame:
    """Return the cycles as a history has them."""
    columns = Columns()
    columns.outputs = ("Z_um",)
    rows = [columns.row_of(one).values() for one in records()]
    return pl.DataFrame(rows, infer_schema_length=None).lazy()


@pytest.fixture
def recorded(tmp_path: Path, cycles: pl.LazyFrame, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a machine whose history has these cycles."""

    class Reader:
        where = "lathe"

        def __init__(self, *_: object) -> None:
            pass

        def __enter__(self) -> Self:
            return self

        def __exit__(self, *_: object) -> None:
            pass

        def span(self) -> tuple[datetime, datetime]:
            return BEGIN, BEGIN + timedelta(seconds=STEP_S * (ROWS - 1))

        def cycles(self, first: datetime, last: datetime) -> pl.LazyFrame:
            return cycles.filter(pl.col(TIME) >= first, pl.col(TIME) < last)

        def retried(self, work: Callable[[], object]) -> object:
            return work()

    monkeypatch.setattr(relearn.history, "HistoryReader", Reader)
    return machine_file(tmp_path)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[RequestKind, object]]:
    """Return what a loop is asked for, that accepts all and keeps what is in force then."""
    found: list[tuple[RequestKind, object]] = []

    def ask(state: Path, kind: RequestKind, told: str) -> LocalAnswer:
        found.append((kind, told))
        in_force(state.with_name("machine.toml"), told)
        return LocalAnswer(True, Message("answer-model_settles"))

    monkeypatch.setattr(relearn, "ask_loop", ask)
    return found


def in_force(path: Path, name: str) -> None:
    """Leave the state of a loop that has a model of the folder in force."""
    machine = read_machine(path)
    compensation, sha256 = machine.other_model(name)
    saved = SavedState(datetime.now(UTC), 0.0, sha256, name, False, cycle_state(compensation))
    assert StateFile(machine.state_file).save(saved, compensation)


def test_a_touch_is_freed_of_the_correction_that_acted_at_its_time(cycles: pl.LazyFrame) -> None:
    log = touched_log(cycles, model(), "lathe")
    shown = log.columns["Z_um"]
    touched = ~np.isnan(shown)
    count = len(range(0, log.rows, TOUCH))
    assert np.count_nonzero(touched) == count - len(range(0, log.rows, 31 * TOUCH))
    rise = log.columns["T_spindle_C"] - 22.0
    assert float(np.corrcoef(shown[touched], rise[touched])[0, 1]) > 0.8
    assert np.nanmax(shown) < 75.0, "no touch that was excluded"
    assert np.flatnonzero(log.columns["datum"]).tolist() == [1001]
    minutes = minutes_of(cycles).collect()
    assert np.flatnonzero(minutes[DATUM_SET]).tolist() == [1001], "nights are told of it, too"


@pytest.mark.proof
def test_a_better_model_is_written_beside_and_nothing_is_changed(
    recorded: Path,
    asked: list[tuple[RequestKind, object]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    before = recorded.read_bytes()
    assert main(["relearn", str(recorded), "--last", "8d", "--json", "-"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert recorded.read_bytes() == before
    assert not asked
    proposed = recorded.parent / "models" / told["proposal"]
    model_ = read_model(proposed)
    (part,) = model_.outputs[0].parts
    dc = part.direct_gain_um_per_k + sum(s.gain_um_per_k for s in part.sections)
    late_s = sum(s.gain_um_per_k * s.time_constant_s for s in part.sections) / dc
    assert (dc, late_s) == pytest.approx((10.0, TRUE_S), rel=0.15)
    assert told["parent"] == "lathe.json"
    assert told["parent_sha256"] in model_.provenance.method
    assert told["parent_sha256"][:8] in proposed.stem  # no proposal is written over its parent
    assert told["to"] == (BEGIN + timedelta(seconds=STEP_S * (ROWS - 1))).isoformat()
    (output,) = told["outputs"]
    assert output["proposed"]
    assert output["why_code"]["code"] == "relearn-better"
    names = read_machine(recorded).models_to_choose()
    assert proposed.name in names
    assert not [name for name in names if name.endswith(".proposal")]
    assert json.loads(proposed.with_suffix(".proposal").read_text()) == told


def test_a_person_accepts_what_was_compared_with_the_model_in_force_and_goes_back(
    tmp_path: Path,
    asked: list[tuple[RequestKind, object]],
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = machine_file(tmp_path)
    folder = tmp_path / "models"
    write_model(model(gain=12.0), folder / "relearnt.json")
    machine = read_machine(path)
    told = {
        "proposal": "relearnt.json",
        "proposal_sha256": machine.other_model("relearnt.json")[1],
        "parent": "lathe.json",
        "parent_sha256": machine.model.sha256,
    }
    (folder / "relearnt.proposal").write_text(json.dumps(told))
    with refused("nothing_to_roll_back"):
        relearn.run(_words(path, "--rollback"))
    assert main(["relearn", str(path), "--accept", "relearnt.proposal"]) == 0
    with refused("proposal_of_other_model"):
        relearn.run(_words(path, "--accept", "relearnt.json"))
    assert main(["relearn", str(path), "--rollback"]) == 0
    assert asked == [(RequestKind.MODEL, "relearnt.json"), (RequestKind.MODEL, "lathe.json")]
    assert "lathe.json accepted" in capsys.readouterr().out
    in_force(path, "relearnt.json")
    write_model(model(gain=13.0), folder / "lathe.json")
    with refused("hash_mismatch"):
        relearn.run(_words(path, "--rollback"))
    with refused("option_belongs_to"):
        relearn.run(_words(path, "--rollback", "--last", "3d"))


def test_where_no_model_may_be_chosen_none_is_learnt(tmp_path: Path) -> None:
    path = machine_file(tmp_path, ('model_folder = "models"\n', ""))
    with refused("no_model_folder"):
        relearn.run(_words(path))
