"""Compensation models as JSON: the same after reading, and every mistake named."""

import json
from pathlib import Path

import pytest

from thermaxis.compensation import (
    CompensationModel,
    GainPoint,
    Output,
    Part,
    Provenance,
    Section,
    TrainingLog,
)
from thermaxis.errors import ConfigurationError
from thermaxis.files import format_model, model_sha256, read_model, write_model


def example() -> CompensationModel:
    table = Part(
        "table",
        "T_table_c",
        "T_column_c",
        -45.5,
        (Section(17.9, 25899.5), Section(1e-9, 0.5)),
        90.0,
        (GainPoint(0.0, 1.0), GainPoint(3000.0, 2.2)),
        1.1,
        -0.25,
        14.7,
    )
    return CompensationModel(
        outputs=(
            Output("Z_um", (Part("spindle", "T_spindle_c", "T_column_c", 7.9126), table), 0.1),
            Output("X_um", (Part("spindle", "T_spindle_c", "", 0.1 + 0.2),)),
        ),
        sample_time_s=10.0,
        reference_c={"T_column_c": 22.1},
        input_filter_s=60.0,
        provenance=Provenance(
            "modal",
            "thermaxis 0.1.0",
            "2026-03-31",
            (TrainingLog("heating.csv", "ab" * 32, 6669, 2),),
            {"Z_um.fit_percent": 91.25},
        ),
        warnings=("the slow mode is not supported by the record",),
    )


def test_written_and_read_a_model_is_the_same(tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    write_model(example(), path)
    again = read_model(path)
    assert again == example()
    assert format_model(again) == path.read_text(encoding="ascii")
    assert model_sha256(again) == json.loads(path.read_text(encoding="ascii"))["sha256"]


def test_only_what_a_model_needs_is_enough(tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    part = {"name": "s", "plus": "a", "direct_gain_um_per_k": 2, "sections": []}
    content = {
        "format": "thermaxis-compensation-model",
        "version": 1,
        "outputs": [{"name": "Z_um", "parts": [part]}],
    }
    path.write_text(json.dumps(content), encoding="utf-8")
    assert read_model(path) == CompensationModel(
        outputs=(Output("Z_um", (Part("s", "a", "", 2.0),)),)
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: t.update(version=2), "version 2"),
        (lambda t: t.update(format="thermaxis-plan"), "this is no model"),
        (lambda t: t.update(extra=1), "unknown key extra"),
        (lambda t: t.update(limits={"largest_um": 5}), "limits"),
        (lambda t: t.update(sign="the other way round"), "another convention"),
        (lambda t: t.pop("outputs"), "lacks the key outputs"),
        (lambda t: t["outputs"][0].update(offset_um="0"), r"outputs\[0\].offset_um"),
        (lambda t: t["outputs"][0]["parts"][1].update(delay=1), "nearest known key is delay_s"),
        (lambda t: t["outputs"][0]["parts"][1]["sections"][0].update(time_constant_s=-1), "not po"),
        (lambda t: t["outputs"][0]["parts"][0].update(direct_gain_um_per_k=True), "not a number"),
        (lambda t: t["outputs"][0]["parts"][0].update(direct_gain_um_per_k=5), "hash does not fit"),
        (lambda t: t["outputs"].clear(), "no output"),
        (lambda t: t["warnings"].append(5), "not a text"),
        (lambda t: t["provenance"].update(logs=[5]), "not an object"),
        (lambda t: t["provenance"]["logs"][0].update(rows=-1), "whole number"),
        (lambda t: t.update(reference="stated", reference_c={}), "is not stated"),
    ],
)
def test_a_mistake_is_named_with_its_place(tmp_path: Path, change, said: str) -> None:
    table = json.loads(format_model(example()))
    change(table)
    path = tmp_path / "model.json"
    path.write_text(json.dumps(table), encoding="utf-8")
    with pytest.raises(ConfigurationError, match=said) as caught:
        read_model(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"[]",
        b"{",
        b"\xff\xfe",
        b"null",
        b'{"format": NaN}',
        b'{"a": 1, "a": 2}',
        b"[" * 100_000,
    ],
)
def test_what_is_no_model_is_refused_in_words(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "model.json"
    path.write_bytes(content)
    with pytest.raises(ConfigurationError):
        read_model(path)
