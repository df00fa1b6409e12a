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
from thermaxis.thermal import RangeFigure, ThermalTest, ThermalTestKind, ThermalTestQuantity

UNITS = {"um": "µm", "um/m": "µm/m"}
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
    CompensationCase.LEFT_BY_MODEL: "what the model leaves in free run",
    CompensationCase.IN_FORCE: "measured with compensation in force",
}
"""What the figures of a case are."""


def describe_thermal_test(report: ThermalTestReport, remarks: Sequence[str] = ()) -> list[Part]:
    """Return everything that was evaluated of a thermal test.

    Parameters
    ----------
    report : ThermalTestReport
        The test, as measured and with compensation.
    remarks : sequence of str
        What was noticed while logs were read, in words.

    Returns
    -------
    list of Part
        What ``thermaxis thermal-test evaluate`` shows and writes.
    """
    measured = report.measured
    return [
        Value("version", report.version),
        Value("kind", measured.kind),
        Value("source_name", report.source_name),
        Value("source_sha256", report.source_sha256),
        Value("model_sha256", report.model_sha256),
        Value("probe_distance_mm", report.setup.probes.distance_mm),
        Value("coverage_factor", 2.0),
        *(part for case, test in report.cases.items() for part in _shown(report, case, test)),
        Value("cases", [as_json([*_case(case, test)]) for case, test in report.cases.items()]),
        Value("", remarks, "reading"),
        *messages_of("warnings", report.warnings, "warning"),
    ]


def _shown(report: ThermalTestReport, case: CompensationCase, test: ThermalTest) -> Iterator[Part]:
    several = f" ({CASES[case]})" if len(report.cases) > 1 else ""
    yield Table(f"ISO 230-3, {TITLES[test.kind]}{several}", [*map(figure_row, _of(test))], words=2)
    if case is CompensationCase.LEFT_BY_MODEL:
        return
    if rows := [*span_rows(test)]:
        yield Table("ETVE(D, t): largest range in any span of t", rows, words=2)
    yield Table("temperatures", [temperature_row(one) for one in test.temperatures], words=1)
    if rows := [*speed_rows(test)]:
        yield Table("speeds", rows)
    lines = [f"{hours_of(test)}"]
    if (end := test.end_criterion) is not None:
        word = "reached" if end.reached else "not reached"
        lines.append(f"end criterion [M] {word}: {end_words(test)}")
    yield from lines


def _of(test: ThermalTest) -> list[tuple[ThermalTest, ThermalTestQuantity]]:
    return [(test, one) for one in test.quantities]


def hours_of(test: ThermalTest) -> str:
    """Return how long the test, the motion and the time after it were."""
    lasts_h = (test.end_s - test.begin_s) / 3600.0
    if test.kind is ThermalTestKind.ETVE:
        return f"duration {lasts_h:.4g} h"
    return f"in motion {lasts_h:.4g} h, then {test.cooling_s / 3600.0:.4g} h at rest"


def end_words(test: ThermalTest) -> str:
    """Return the two numbers of the end of a test by motion."""
    end = test.end_criterion
    if end is None:
        return "not evaluated: less than 2 h in motion"
    share = f"{100.0 * end.share:.1f} %" if end.share == end.share else "no change at all"
    return (
        f"the last 60 min change {end.last_hour:.2f} µm, the first {end.first_hour:.2f} µm:"
        f" {share} (limit 15 %)"
    )


def figure_row(of: tuple[ThermalTest, ThermalTestQuantity]) -> list[Value]:
    """Return the ranges of a quantity."""
    test, one = of
    cooling = one.cooling
    after = (
        []
        if test.kind is ThermalTestKind.ETVE
        else [
            Value("", None if cooling is None else cooling.value, "at rest after", ".2f"),
        ]
    )
    return [
        Value("quantity", one.name, ""),
        Value("unit", UNITS[one.unit], "unit"),
        Value("", one.first_hour.value, "first 60 min", ".2f"),
        Value("", one.first_hour.expanded_uncertainty, "U", ".2f"),
        Value("", one.whole.value, "whole", ".2f"),
        Value("", one.whole.expanded_uncertainty, "U", ".2f"),
        Value("", one.last_hour, "last 60 min", ".2f"),
        *after,
        Value("", one.drift_per_h[0], "1st hour, per h", "+.2f"),
        Value("", one.drift_per_h[-1], "last hour, per h", "+.2f"),
    ]


def span_rows(test: ThermalTest) -> Iterator[list[Value]]:
    """Yield the largest ranges in spans of a quantity."""
    if test.spans_h:
        for one in test.quantities:
            pairs = zip(test.spans_h, one.within_spans, strict=True)
            yield [
                Value("", one.name, ""),
                Value("", UNITS[one.unit], "unit"),
                *(Value("", found, f"{t:g} h", ".2f") for t, found in pairs),
            ]


def temperature_row(one: object) -> list[Value]:
    """Return the figures of a temperature."""
    heads = {
        "channel": "channel",
        "ambient": None,
        "start_c": "start [°C]",
        "end_c": "end [°C]",
        "first_hour_range_k": "first 60 min [K]",
        "range_k": "range [K]",
        "gradient_k_per_h": "gradient [K/h]",
    }
    values = values_of(one, *heads)
    return [v._replace(head=heads[v.key], form="" if v.key == "channel" else ".2f") for v in values]


def speed_rows(test: ThermalTest) -> Iterator[list[Value]]:
    """Yield how long which speeds were run."""
    total_s = sum(one.time_s for one in test.spectrum) or 1.0
    for one in test.spectrum:
        yield [
            Value("from_percent", one.from_percent, "from [%]", ".0f"),
            Value("to_percent", one.to_percent, "to [%]", ".0f"),
            Value("mean", one.mean, "mean", ".0f"),
            Value("time_s", one.time_s),
            Value("", one.time_s / 60.0, "time [min]", ".1f"),
            Value("share_percent", 100.0 * one.time_s / total_s, "share [%]", ".1f"),
        ]


def _case(case: CompensationCase, test: ThermalTest) -> Iterator[Part]:
    """Yield a case as the JSON has it."""
    end = test.end_criterion
    yield Value("case", case)
    yield Value("log", test.name)
    yield from values_of(test, "begin_s", "end_s", "cooling_s", "spans_h", "room_spread_k")
    yield Table("", [[*_quantity(one)] for one in test.quantities], key="quantities")
    yield Table("", [temperature_row(one) for one in test.temperatures], key="temperatures")
    yield Table("", [*speed_rows(test)], key="speeds")
    yield Value(
        "end_criterion",
        None
        if end is None
        else {
            "first_hour_um": end.first_hour,
            "last_hour_um": end.last_hour,
            "share": end.share,
            "reached": end.reached,
        },
    )
    yield from messages_of("warnings", test.warnings)


def _quantity(one: ThermalTestQuantity) -> Iterator[Value]:
    yield from values_of(one, "name", "unit")
    yield Value("first_hour", _figure(one.first_hour))
    yield Value("whole", _figure(one.whole))
    yield Value("cooling", None if one.cooling is None else _figure(one.cooling))
    yield from values_of(one, "last_hour", "drift_per_h", "within_spans")


def _figure(figure: RangeFigure) -> Mapping[str, object]:
    terms = [{"cause": t.cause, "standard_uncertainty": t.standard} for t in figure.terms]
    u = figure.expanded_uncertainty
    return {"value": figure.value, "expanded_uncertainty": u, "budget": terms}
