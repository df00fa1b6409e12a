"""Models of separate tests superpose, each with its gain by diameter."""

import pytest

from tests.refusals import refused
from thermaxis.compensation import (
    CompensationModel,
    GainPoint,
    Output,
    Part,
    Provenance,
    Reading,
    Section,
    initial_state,
    model_step,
)
from thermaxis.thermal import combine_models, parse_gain


def model(part: Part, **options: object) -> CompensationModel:
    return CompensationModel(outputs=(Output("Z_um", (part,), 0.5),), **options)


SPINDLE = Part("spindle", "T_spindle", "T_column", 7.9, (Section(30.1, 2120.0),))
TABLE = Part("table", "T_table", "T_column", -45.5, (Section(17.9, 25900.0),))


def displacement(of: CompensationModel, diameter: float | None) -> float:
    state, _ = model_step(
        of,
        initial_state(of),
        Reading(0.0, dict.fromkeys(("T_spindle", "T_table", "T_column"), 20.0)),
    )
    for k in range(1, 5):
        values = {"T_spindle": 20.0 + k, "T_table": 20.0 + 0.5 * k, "T_column": 20.0 + 0.1 * k}
        state, output = model_step(of, state, Reading(600.0 * k, values, diameter))
    return output.model_um[0]


def test_equation_8_adds_the_spindle_and_g_times_the_table() -> None:
    name, gain = parse_gain("table=0:1,1500:1.6,3000:2.2")
    both = combine_models([("spindle", model(SPINDLE)), ("table", model(TABLE))], {name: gain})
    spindle, table = displacement(model(SPINDLE), None), displacement(model(TABLE), None)
    for diameter, g in ((None, 1.0), (0.0, 1.0), (1500.0, 1.6), (2250.0, 1.9), (3000.0, 2.2)):
        expected = spindle + 0.5 + g * (table - 0.5)
        assert displacement(both, diameter) == pytest.approx(expected, abs=1e-9)


def test_a_gain_may_name_the_model_and_state_the_tool_centre_point() -> None:
    name, gain = parse_gain(" from_table = tcp:0.8, 100:2 ")
    both = combine_models([("s", model(SPINDLE)), ("from_table", model(TABLE))], {name: gain})
    part = both.outputs[0].parts[1]
    assert (part.gain_by_diameter, part.tool_gain) == ((GainPoint(100.0, 2.0),), 0.8)
    assert both.outputs[0].parts[0].gain_by_diameter == ()


def test_logs_figures_and_warnings_of_all_models_are_kept() -> None:
    a = model(SPINDLE, provenance=Provenance("modal", figures={"Z_um.fit_percent": 90.0}))
    b = model(
        TABLE, provenance=Provenance("oe", figures={"Z_um.fit_percent": 80.0}), warnings=("w",)
    )
    both = combine_models([("a", a), ("b", b)])
    assert dict(both.provenance.figures) == {"a.Z_um.fit_percent": 90.0, "b.Z_um.fit_percent": 80.0}
    assert (both.provenance.method, both.warnings) == ("a: modal; b: oe", ("b: w",))


def test_outputs_of_other_names_stand_side_by_side() -> None:
    other = CompensationModel(outputs=(Output("X_um", (TABLE,)),))
    both = combine_models([("a", model(SPINDLE)), ("b", other)])
    assert [output.name for output in both.outputs] == ["Z_um", "X_um"]


def test_what_cannot_be_superposed_is_refused() -> None:
    for models, said in (
        ([], "no_model"),
        ([("a", model(SPINDLE)), ("b", model(SPINDLE))], "heat_counted_twice"),
        (
            [("a", model(SPINDLE)), ("b", model(Part("spindle", "T_other", "", 1.0)))],
            "part_name_twice",
        ),
        ([("a", model(SPINDLE)), ("b", model(TABLE, input_filter_s=60.0))], "filters_differ"),
        (
            [
                ("a", model(SPINDLE)),
                ("b", model(TABLE, reference="stated", reference_c={"T_table": 1, "T_column": 2})),
            ],
            "references_differ",
        ),
    ):
        with refused(said):
            combine_models(models)


def test_a_gain_without_a_part_is_refused() -> None:
    name, gain = parse_gain("tabel=0:1,1:2")
    with refused("unknown_name", key="gain"):
        combine_models([("a", model(SPINDLE)), ("table", model(TABLE))], {name: gain})


def test_what_is_no_gain_is_refused() -> None:
    for code, texts in (
        ("no_gain_by_diameter", ("", "table", "table=", "=0:1")),
        ("no_new_diameter", ("table=0", "table=0:x", "table=0:1,0:2", "table=-1:1")),
        ("no_new_diameter", ("table=0:nan", "table=0:1,,2:3")),
        ("no_diameter", ("table=tcp:1",)),
    ):
        for text in texts:
            with refused(code, key="--gain"):
                parse_gain(text)
