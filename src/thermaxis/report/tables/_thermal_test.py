"""A thermal test, described once; its keys stand in docs/json.md."""

from collections.abc import Iterator, Mapping, Sequence

from thermaxis.report._thermal_test_report import CompensationCase, ThermalTestReport
from thermaxis.report.tables._described import (
    Part,
    Table,
    Value,
    as_json,
    messages_of,
    values_of,
)
from thermaxis.thermal import (
    END_SHARE,
    RangeFigure,
    ThermalTest,
    ThermalTestKind,
    ThermalTestQuantity,
    ThermalTestTemperature,
    UncertaintyCause,
)

QUANTITY_UNITS = {"um": "µm", "um/m": "µm/m"}
"""Units of quantities as they are printed."""
TITLES = {
    ThermalTestKind.ETVE: "environmental temperature variation error (ETVE)",
    ThermalTestKind.SPINDLE: "thermal distortion caused by a rotating spindle",
    ThermalTestKind.LINEAR: "thermal distortion caused by linear motion of a component",
    ThermalTestKind.ROTARY: "thermal distortion caused by rotary motion of a component",
}
"""What each test is called."""
CASES = {
    CompensationCase.MEASURED: "as measured",
    CompensationCase.LEFT_BY_MODEL: "left by the model",
    CompensationCase.IN_FORCE: "in force",
}
"""What the figures of a case are, in few words."""
_TEMPERATURE = {
    "channel": "channel",
    "ambient": None,
    "start_c": "start [°C]",
    "end_c": "end [°C]",
    "first_hour_range_k": "first 60 min [K]",
    "range_k": "range [K]",
    "gradient_k_per_h": "gradient [K/h]",
}


def describe_thermal_test(report: ThermalTestReport) -> list[Part]:
    """Return everything that was evaluated of a thermal test, as terminal and JSON have it."""
    compared = compared_table(report)
    return [
        Value("version", report.version),
        Value("kind", report.measured.kind),
        Value("source_name", report.source_name),
        Value("source_sha256", report.source_sha256),
        Value("model_sha256", report.model_sha256),
        Value("probe_distance_mm", report.setup.probes.distance_mm),
        Value("coverage_factor", 2.0),
        *tables_of(report.measured),
        *lines_of(report.measured),
        *([] if compared is None else [compared]),
        Value("cases", [as_json([*_case(case, test)]) for case, test in report.cases.items()]),
        *messages_of("warnings", report.warnings, "warning"),
    ]


def tables_of(test: ThermalTest) -> list[Table]:
    """Return figures, ETVE(D, t), temperatures, speeds and budget; those that there are."""
    tables = [
        Table(
            f"ISO 230-3, {TITLES[test.kind]}: ranges",
            [_figures(test, one) for one in test.quantities],
            words=2,
        ),
        Table(
            "ETVE(D, t): largest range in any span of t",
            [[*_named(one), *_within(test, one)] for one in test.quantities if test.spans_h],
            words=2,
        ),
        Table("Temperatures", [_temperature(one) for one in test.temperatures], words=1),
        Table("Speeds during the motion", [*_speeds(test)]),
        Table(
            "Standard uncertainties u of the range of the whole, and U = 2 √Σu²",
            [[*_named(one), *_budget(one.whole)] for one in test.quantities],
            words=2,
        ),
    ]
    return [table for table in tables if table.rows]


def lines_of(test: ThermalTest) -> list[str]:
    """Return how long test, motion and rest were, and whether the test may end."""
    lasts_h, rest_h = (test.end_s - test.begin_s) / 3600.0, test.cooling_s / 3600.0
    lines = [f"In motion {lasts_h:.4g} h, then {rest_h:.4g} h at rest."]
    if test.kind is ThermalTestKind.ETVE:
        lines = [f"Duration {lasts_h:.4g} h."]
    if test.room_spread_k is not None:
        lines.append(f"Within the room at one time at most {test.room_spread_k:.2f} K.")
    if (end := test.end_criterion) is not None:
        lines.append(
            f"End of the test [M] {'' if end.reached else 'not '}reached: the last 60 min change"
            f" {end.last_hour:.2f} µm, the first 60 min {end.first_hour:.2f} µm; below"
            f" {100.0 * END_SHARE:g} % is needed."
        )
    return lines


def compared_table(report: ThermalTestReport) -> Table | None:
    """Return the ranges of the whole, and of the first 60 min, of all cases beside each other."""
    tests = report.cases
    if len(tests) == 1:
        return None
    rows: list[list[Value]] = []
    for own in zip(*(test.quantities for test in tests.values()), strict=True):
        row = _named(own[0])
        for case, one in zip(tests, own, strict=True):
            row.append(Value("", _with_u(one.first_hour), f"{CASES[case]}: 60 min"))
            row.append(Value("", _with_u(one.whole), "whole"))
        rows.append(row)
    return Table("With and without compensation: ranges ± U", rows, words=2)


def _with_u(figure: RangeFigure) -> str:
    return f"{figure.value:.2f} ± {figure.expanded_uncertainty:.2f}"


def _named(one: ThermalTestQuantity) -> list[Value]:
    return [Value("", one.name, ""), Value("", QUANTITY_UNITS[one.unit], "unit")]


def _figures(test: ThermalTest, one: ThermalTestQuantity) -> list[Value]:
    cooling = one.cooling
    after = Value("", None if cooling is None else cooling.value, "at rest after", ".2f")
    return [
        *_named(one),
        Value("", one.first_hour.value, "first 60 min", ".2f"),
        Value("", one.first_hour.expanded_uncertainty, "U", ".2f"),
        Value("", one.whole.value, "whole", ".2f"),
        Value("", one.whole.expanded_uncertainty, "U", ".2f"),
        Value("", one.last_hour, "last 60 min", ".2f"),
        *([] if test.kind is ThermalTestKind.ETVE else [after]),
        Value("", one.drift_per_h[0], "1st hour [/h]", "+.2f"),
        Value("", one.last_hour_drift_per_h, "last hour [/h]", "+.2f"),
    ]


def _within(test: ThermalTest, one: ThermalTestQuantity) -> Iterator[Value]:
    for span_h, found in zip(test.spans_h, one.within_spans, strict=True):
        yield Value("", found, f"{span_h:g} h", ".2f")


def _budget(figure: RangeFigure) -> list[Value]:
    known = figure.standard_uncertainties
    terms = [Value("", known.get(cause), cause.value, ".3f") for cause in UncertaintyCause]
    return [*terms, Value("", figure.expanded_uncertainty, "U", ".2f")]


def _temperature(one: ThermalTestTemperature) -> list[Value]:
    return [
        value._replace(head=head, form="" if key == "channel" else ".2f")
        for value, (key, head) in zip(
            values_of(one, *_TEMPERATURE), _TEMPERATURE.items(), strict=True
        )
    ]


def _speeds(test: ThermalTest) -> Iterator[list[Value]]:
    total_s = sum(one.time_s for one in test.spectrum)
    for one in test.spectrum:
        yield [
            Value("from_percent", one.from_percent, "above [%]", ".0f"),
            Value("to_percent", one.to_percent, "up to [%]", ".0f"),
            Value("mean", one.mean, "mean", ".0f"),
            Value("time_s", one.time_s),
            Value("", one.time_s / 60.0, "time [min]", ".1f"),
            Value("share_percent", 100.0 * one.time_s / total_s, "share [%]", ".1f"),
        ]


# ---- the JSON alone -----------------------------------------------------------------------------


def _case(case: CompensationCase, test: ThermalTest) -> Iterator[Part]:
    end = test.end_criterion
    criterion = {"first_hour_um": "first_hour", "last_hour_um": "last_hour"}
    criterion |= {key: key for key in ("share", "reached")}
    yield Value("case", case)
    yield Value("log", test.name)
    yield from values_of(test, "begin_s", "end_s", "cooling_s", "spans_h", "room_spread_k")
    yield Table("", [[*_quantity(one)] for one in test.quantities], key="quantities")
    yield Table("", [_temperature(one) for one in test.temperatures], key="temperatures")
    yield Table("", [*_speeds(test)], key="speeds")
    yield Value(
        "end_criterion", end and {key: getattr(end, name) for key, name in criterion.items()}
    )
    yield from messages_of("warnings", test.warnings)


def _quantity(one: ThermalTestQuantity) -> Sequence[Value]:
    figures = {"first_hour": one.first_hour, "whole": one.whole, "cooling": one.cooling}
    return (
        *values_of(one, "name", "unit"),
        *(Value(key, figure and _figure(figure)) for key, figure in figures.items()),
        *values_of(one, "last_hour", "drift_per_h", "last_hour_drift_per_h", "within_spans"),
    )


def _figure(figure: RangeFigure) -> Mapping[str, object]:
    return {
        "value": figure.value,
        "expanded_uncertainty": figure.expanded_uncertainty,
        "standard_uncertainties": figure.standard_uncertainties,
    }
