"""The certificate of a thermal test: pages, charts, and a Digital Calibration Certificate."""

import json
from dataclasses import replace
from datetime import UTC, datetime
from decimal import Decimal
from pathlib import Path

import numpy as np
import pypdfium2
import pytest
from lxml import etree

from tests.unit.report.test_dcc import (  # noqa: F401 - rules and schema are fixtures
    FULL_HEAD,
    faults,
    found,
    rules,
    schema,
)
from thermaxis.errors import ConfigurationError
from thermaxis.report import (
    CompensationCase,
    ThermalTestReport,
    write_thermal_test_figures,
    write_thermal_test_report,
)
from thermaxis.report.dcc import dcc_xml
from thermaxis.report.tables import results_json, results_sha256
from thermaxis.thermal import (
    MotionTargets,
    Probes,
    ThermalLog,
    ThermalTestBudget,
    ThermalTestKind,
    ThermalTestMotion,
    ThermalTestSetup,
    evaluate_thermal_test,
)

CHANNELS = ("X1_um", "X2_um", "Y1_um", "Y2_um", "Z_um")
PROBES = ThermalTestSetup(
    Probes(*CHANNELS, distance_mm=150.0),
    ambient=("T_<room>_C",),
    motion=ThermalTestMotion("n_rpm"),
    uncertainty=ThermalTestBudget(0.2, 0.1, 0.3, 0.5),
)
TARGETS = replace(PROBES, targets=MotionTargets(("X1_um", "X2_um"), ("Y1_um", "Z_um")))


def log_of(share: float = 1.0) -> ThermalLog:
    time_s = np.arange(0.0, 6 * 3600.0 + 1.0, 300.0)
    rise = -np.expm1(-np.clip(time_s - 600.0, 0.0, 4 * 3600.0) / 4000.0)
    columns = {name: share * (k + 3.0) * rise for k, name in enumerate(CHANNELS)}
    columns |= {"n_rpm": np.where((time_s >= 600.0) & (time_s <= 15000.0), 8000.0, 0.0)}
    columns |= {"T_<room>_C": 21.0 + time_s / 36000.0, "T_spindle_C": 22.0 + 12.0 * rise}
    start = datetime(2026, 3, 9, 7, 30, tzinfo=UTC)
    return ThermalLog.from_columns(columns, time_s=time_s, start=start, name="log")


def report_of(kind: ThermalTestKind, *, cases: int = 1) -> ThermalTestReport:
    setup = TARGETS if kind is ThermalTestKind.LINEAR else PROBES
    tests = {
        case: evaluate_thermal_test(log_of(1.0 - 0.3 * k), kind, setup)
        for k, case in enumerate(tuple(CompensationCase)[:cases])
    }
    return ThermalTestReport(
        cases=tests,
        log=log_of(),
        setup=setup,
        model_sha256="ab" * 32 if cases > 1 else None,
        header=FULL_HEAD if cases > 1 else {},
        warnings=tests[CompensationCase.MEASURED].warnings,
        source_name="<log>.csv",
        source_sha256="0123456789abcdef" * 4,
        version="1.2.3",
    )


@pytest.mark.parametrize(("kind", "cases"), [*((k, 1) for k in ThermalTestKind), ("spindle", 3)])
def test_its_digital_certificate_is_valid_and_has_the_digits_of_the_json(
    kind: str,
    cases: int,
    schema: etree.XMLSchema,  # noqa: F811 - a fixture
    rules: object,  # noqa: F811 - a fixture
) -> None:
    report = report_of(ThermalTestKind(kind), cases=cases)
    xml = dcc_xml(report)
    assert faults(xml, schema, rules) == []
    content, root = json.loads(results_json(report)), etree.fromstring(xml)
    own = "//dcc:result[@refType='thermaxis_thermalTest_{}']//dcc:quantity[@refType='thermaxis_{}']"
    for case in content["cases"]:
        for one in case["quantities"]:
            name = one["name"].replace("+", "_forward").replace("-", "_backward")
            for key, suffix in (("first_hour", "rangeFirstHour"), ("whole", "range")):
                (quantity,) = found(root, own.format(case["case"], f"{name}_{suffix}"))
                numbers = [
                    found(quantity, f".//si:{tag}")[0].text for tag in ("value", "valueExpandedMU")
                ]
                stated = [one[key]["value"], one[key]["expanded_uncertainty"]]
                assert [*map(Decimal, numbers)] == [Decimal(repr(value)) for value in stated]
                unit = found(quantity, ".//si:unit")[0].text
                assert (unit == r"\micro\metre") == (one["unit"] == "um")
            lists = found(root, own.format(case["case"], f"{name}_etve"))
            values = lists[0][1][0].text.split() if lists else []
            assert [*map(float, values)] == one["within_spans"]
    assert [e.text for e in found(root, "//dcc:norm")] == ["ISO 230-3:2020", "JCGM 100:2008"]
    assert results_sha256(report) in xml.decode()


def test_the_page_of_types_names_those_of_thermal_tests(root: Path) -> None:
    page = (root / "docs" / "dcc-types.md").read_text(encoding="utf-8")
    xml = b"".join(dcc_xml(report_of(kind, cases=3)) for kind in ("etve", "spindle"))
    tree = etree.fromstring(
        b"<all>" + xml.replace(b"<?xml version='1.0' encoding='UTF-8'?>", b"") + b"</all>"
    )
    for element in found(tree, "//dcc:results//*[@refType]"):
        for one in element.get("refType").split():
            stem = one if one.count("_") == 1 else one.replace(f"_{one.split('_')[1]}_", "_Q_")
            assert f"`{one}`" in page or f"`{stem}`" in page


def test_the_pages_say_marks_uncertainty_budget_and_cases(tmp_path: Path) -> None:
    pages = [tmp_path / f"report.{suffix}" for suffix in ("pdf", "html")]
    report = report_of(ThermalTestKind.SPINDLE, cases=3)
    left = report.cases[CompensationCase.LEFT_BY_MODEL].quantities[0].whole
    write_thermal_test_report(report, *pages)
    html = pages[1].read_text(encoding="utf-8")
    assert "<log>" not in html
    assert "T_<room>" not in html
    for said in (
        "[V]",
        "[M]",
        "k = 2",
        "in force: 60 min",
        "left by the model: 60 min",
        f"{left.value:.2f} ± {left.expanded_uncertainty:.2f}",
        "sampling",
    ):
        assert said in html, said
    pdf = pypdfium2.PdfDocument(pages[0])
    text = "".join(page.get_textpage().get_text_bounded() for page in pdf)
    assert "End of the certificate." in text
    assert "2026-03-09" in text
    assert "21 °C (start)" in text or "21.017 °C (start)" in text


@pytest.mark.proof
def test_every_chart_has_its_picture_and_numbers(tmp_path: Path) -> None:
    written = write_thermal_test_figures(report_of(ThermalTestKind.ETVE, cases=2), tmp_path)
    names = {path.stem for path in written}
    assert names == {"over_time", "etve", "with_and_without"}
    assert {path.suffix for path in written} == {".png", ".svg", ".csv"}


def test_a_report_of_another_format_is_refused_before_anything_is_drawn(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationError) as caught:
        write_thermal_test_report(report_of(ThermalTestKind.ETVE), tmp_path / "report.docx")
    assert caught.value.code == "report_suffix"
