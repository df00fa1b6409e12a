"""The Digital Calibration Certificate: valid, and every digit that of the results' JSON."""

import base64
import importlib
import json
import re
import socket
import sys
from collections.abc import Callable
from dataclasses import replace
from decimal import Decimal
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pypdfium2
import pytest
from dcclib.validation import SchematronValidator
from lxml import etree

from tests.proofs import quick_first
from tests.unit.report.builders import make_report, make_run
from thermaxis.cli import main
from thermaxis.files import DecisionRule, FigureLimits, read_positioning
from thermaxis.files.settings import HEADER_FIELDS
from thermaxis.positioning import (
    FIGURE_KEYS,
    PositioningTest,
    StartEnd,
    UncertaintyBudget,
    evaluate_drift,
    evaluate_uncertainty,
)
from thermaxis.quantities import AxisKind
from thermaxis.report import PositioningReport, write_report
from thermaxis.report.dcc import dcc_xml
from thermaxis.report.tables import results_json, results_sha256

NAMESPACES = {"dcc": "https://ptb.de/dcc", "si": "https://ptb.de/si"}
FULL_HEAD = {
    **{field.key: f"a {field.label}" for field in HEADER_FIELDS.values() if field.needed},
    "laboratory_country": "CZ",
    "performed_at": "customer",
    "certificate_number": "K-2026/0417",
    "laboratory_mark": "L 2345",
    "customer_contact": "metrology@example.org",
    "date_of_issue": "2026-03-09",
    "date_of_receipt": "2026-03-01",
    "instrument": "laser interferometer",
    "instrument_serial_number": "8A0042",
    "instrument_certificate_number": "1234-KL-26",
    "instrument_traceability": "the metre, by PTB",
    "air_temperature_sensor": "Pt 100, certificate 77",
    "air_humidity_percent": "41",
    "air_pressure_kpa": "98.90",
    "material_temperature_1_c": "23.9 to 24.6",
    "feed_mm_per_min": "300",
    "comments": "Coolant off.",
    "inspector": "a laboratory",
}
STATED = {"B": 0.3, "A": 1.0, "M": 0.5}
LIMITS = FigureLimits(
    {"B": 4.0, "A": 14.0, "M": 5.0}, DecisionRule.ISO14253_1, STATED, "limits.toml"
)
HOSTILE = "</dcc:content><x y='1'>&amp; ]]> \u0000\u001b\ufffe\u202e 主轴\n\t" + "x" * 3000


@pytest.fixture(autouse=True)
def no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let nobody ask for a schema elsewhere."""

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("the network was asked")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    monkeypatch.setattr(socket, "getaddrinfo", refuse)


def report_of(
    test: PositioningTest, budget: UncertaintyBudget | None = None, **fields: Any
) -> PositioningReport:
    drift = evaluate_drift(test) if test.cycles > 1 and test.time_s is not None else None
    uncertainty = evaluate_uncertainty(test, drift, budget=budget, samples=200)
    if "limits" in fields:
        uncertainty = uncertainty.with_stated(fields["limits"].expanded_uncertainty)
    return make_report(test, drift=drift, uncertainty=uncertainty, **fields)


def with_outlier(test: PositioningTest) -> PositioningTest:
    deviation = test.deviation.copy()
    deviation[4, 2, 0] += 15.0
    return replace(test, deviation=deviation)


def with_step(test: PositioningTest, cycle: int, size: float) -> PositioningTest:
    deviation = test.deviation.copy()
    deviation[:, cycle:] += size
    return replace(test, deviation=deviation)


CASES: dict[str, Callable[[], PositioningReport]] = {
    "draft": lambda: report_of(make_run()),
    "full": lambda: report_of(
        make_run(),
        UncertaintyBudget(device=0.2, device_um_per_m=0.5),
        limits=LIMITS,
        header=FULL_HEAD,
        options={"decimal": "comma", "reference_time_h": 0.5},
    ),
    "rotary": lambda: report_of(make_run(8, kind=AxisKind.ROTARY, length=360.0, seed=3)),
    "outlier": lambda: report_of(with_outlier(make_run(cycles=6))),
    "step": lambda: report_of(with_step(make_run(cycles=8), 4, 12.0)),
    "rotary step": lambda: report_of(
        with_step(make_run(kind=AxisKind.ROTARY, length=360.0, cycles=8), 3, -12.0)
    ),
    "forward": lambda: report_of(make_run(approaches="forward"), header=FULL_HEAD),
    "backward": lambda: report_of(make_run(approaches="backward")),
    "one cycle": lambda: report_of(make_run(12, 1, length=2400.0)),
    "without times": lambda: report_of(replace(make_run(times=False), environment={})),
    "two metres": lambda: report_of(make_run(12, length=2400.0)),
}


@cache
def report(case: str) -> PositioningReport:
    return CASES[case]()


@cache
def tree(case: str) -> etree._Element:
    return etree.fromstring(dcc_xml(report(case)))


@cache
def plain(case: str) -> bytes:
    return results_json(report(case))


def results(case: str) -> dict[str, Any]:
    return json.loads(plain(case))


def found(root: etree._Element, path: str) -> list[Any]:
    return root.xpath(path, namespaces=NAMESPACES)


@pytest.fixture(scope="module")
def schema(real_data: Path) -> etree.XMLSchema:
    return etree.XMLSchema(etree.parse(real_data / "dcc" / "dcc_3.3.0.xsd"))


@pytest.fixture(scope="module")
def rules() -> SchematronValidator:
    return SchematronValidator.for_dcc()


# ---- valid --------------------------------------------------------------------------------------


def faults(xml: bytes, schema: etree.XMLSchema, rules: SchematronValidator) -> list[str]:
    """Return what schema and rules have against a certificate, advice included."""
    schema.validate(etree.fromstring(xml))
    wrong = [f"{entry.line}: {entry.message}" for entry in schema.error_log]
    checked = rules.validate_str(xml.decode())
    said = [*checked.failed_assertions, *checked.successful_reports]
    return wrong + [f"{one.location} {one.text}" for one in said if one.role != "information"]


@pytest.mark.parametrize("case", quick_first(4, CASES))
def test_it_is_valid(case: str, schema: etree.XMLSchema, rules: SchematronValidator) -> None:
    assert faults(dcc_xml(report(case)), schema, rules) == []


def test_a_certificate_that_is_not_valid_is_told(
    schema: etree.XMLSchema, rules: SchematronValidator
) -> None:
    good = dcc_xml(report("full"))
    for old, new in (
        (b"<dcc:countryCodeISO3166_1>CZ", b"<dcc:countryCodeISO3166_1>ZZ"),
        (b"</dcc:release>", b".dev</dcc:release>"),
        (b"<dcc:influenceConditions>", b"<dcc:influence>"),
    ):
        assert old in good
        bad = good.replace(old, new).replace(
            b"</dcc:influenceConditions>" if b"influence>" in new else b"\0", b"</dcc:influence>"
        )
        assert faults(bad, schema, rules)


# ---- digits -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def published(root: Path) -> dict[str, tuple[str, str, str]]:
    """Return what docs/dcc-types.md says: key, unit and key of the uncertainty by type."""
    rows: dict[str, tuple[str, str, str]] = {}
    for line in (root / "docs" / "dcc-types.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 5 and re.fullmatch(r"`(thermaxis|basic)_\w+`", cells[0]):
            kind, key, unit, uncertainty, _ = cells
            names = [kind.strip("`")]
            if "_F" in names[0]:
                names = [names[0].replace("_F", f"_{figure}") for figure in FIGURE_KEYS]
            key_of_u = re.match(r"`(.*?)`", uncertainty)
            for name in names:
                rows[name] = (key.strip("`"), unit, key_of_u[1] if key_of_u else "")
    return rows


def at(content: Any, path: str) -> list[Any]:
    """Return the values at a path of the page: a list where it has brackets."""
    key, _, rest = path.partition(".")
    if content is None or key.removesuffix("[]") not in content:
        return []
    inner = content[key.removesuffix("[]")]
    inner = inner if key.endswith("[]") else [inner]
    return [value for one in inner for value in at(one, rest)] if rest else inner


def expected(case: str, ref_type: str, row: tuple[str, str, str]) -> tuple[list[Any], list[Any]]:
    """Return values and uncertainties of a type, from the JSON by the page."""
    content, paths = results(case), [row[0], row[2]]
    if ref_type.endswith("_driftFree") and paths[0].startswith("iso230_2.targets"):
        paths[0] = f"drift.{paths[0]}"
    if paths[0].startswith("figure_table"):
        figure = re.sub(
            "_(bias|driftFree|driftFreeWithOutliers|driftEffect)$", "", ref_type
        ).removeprefix("thermaxis_")
        content["figure_table"] = [r for r in content["figure_table"] if r["figure"] == figure]
    if content["test"]["kind"] == "rotary" and "changes" in row[0]:
        paths = [path.replace("_um", "_arcsec") for path in paths]
    values, uncertainties = (at(content, path) if path else [] for path in paths)
    return values, [u for u in uncertainties if u is not None]


UNITS = {
    "linear": {
        "deviation": r"\micro\metre",
        "position": r"\milli\metre",
        "growth": r"\micro\metre\metre\tothe{-1}",
    },
    "rotary": {
        "deviation": r"\arcsecond",
        "position": r"\degree",
        "growth": r"\arcsecond\degree\tothe{-1}",
    },
}


@pytest.mark.parametrize("case", quick_first(4, CASES))
def test_every_digit_is_that_of_the_json(
    case: str, published: dict[str, tuple[str, str, str]]
) -> None:
    root, kind = tree(case), results(case)["test"]["kind"]
    quantities = found(root, "//dcc:result/dcc:data//dcc:quantity[not(ancestor::dcc:metaData)]")
    assert len(quantities) > 10
    for quantity in quantities:
        (ref_type,) = quantity.get("refType").split()
        name = ref_type if ref_type in published else ref_type.removesuffix("_driftFree")
        values, uncertainties = expected(case, ref_type, published[name])
        unit = published[name][1]
        per = 1000 if unit == "growth" and kind == "rotary" else 1
        number = found(quantity, "si:real | si:realListXMLList")[0]
        written = found(number, "si:value | si:valueXMLList")[0].text.split()
        assert [Decimal(text) * per for text in written] == [Decimal(repr(v)) for v in values]
        of_u = found(
            number,
            ".//si:*[contains(local-name(), 'dMU')]/si:*[starts-with(local-name(), 'value')]",
        )
        stated = of_u[0].text.split() if of_u else []
        assert [Decimal(text) * per for text in stated] == [Decimal(repr(u)) for u in uncertainties]
        dsi = UNITS[kind].get(unit) or {"time": r"\second", "one": r"\one"}[unit]
        assert found(number, "si:unit | si:unitXMLList")[0].text == dsi


@pytest.mark.parametrize("case", CASES)
def test_everything_that_the_run_has_is_in_it(case: str) -> None:
    content, root = results(case), tree(case)
    types = [quantity.get("refType") for quantity in found(root, "//dcc:results//dcc:quantity")]
    for row in content["figure_table"]:
        for suffix, key in (("", "value"), ("_driftFree", "drift_free"), ("_bias", "bias")):
            present = row[key] is not None and (
                suffix != "_driftFree" or content["drift"] is not None
            )
            assert types.count(f"thermaxis_{row['figure']}{suffix}") == present, (row, suffix)
    lists = {
        f"thermaxis_{name}": key
        for name, key in (("mean_forward",) * 2, ("s_backward",) * 2, ("B_target", "B"))
    }
    for ref_type, key in lists.items():
        present = content["iso230_2"]["targets"][0][key] is not None
        assert types.count(ref_type) == present
    for name in ("shift", "shift_bound", "growth_bound", "bound_factor"):
        assert (f"thermaxis_drift_{name}" in types) == (content["drift"] is not None)
    text = b"".join(dcc_xml(report(case)).split()).lower()
    assert b">nan" not in text
    assert b">none<" not in text


def test_the_second_reader_reads_the_same_digits(monkeypatch: pytest.MonkeyPatch) -> None:
    signatures = SimpleNamespace(CertificateValidator=None, errors=None, ValidationContext=None)
    # its library for signatures knows no OpenSSL from 3.0.10 on, and nothing is signed here
    monkeypatch.setitem(sys.modules, "certvalidator", signatures)
    reader = importlib.import_module("dcc.dcc")
    monkeypatch.setattr(reader, "DCCXMLValidator", lambda: None)  # it would ask the network
    for case in CASES:
        read = reader.DCC(byte_array=dcc_xml(report(case)))
        content = results(case)
        numbers = {
            re.findall(r"quantity \[ @ refType ='thermaxis_(\w+)'", path)[0]: value
            for path, value in read.get_calibration_results("xpath")
            if "thermaxis_" in path.rpartition("dcc:quantity")[2]
        }
        for row in content["figure_table"]:
            if row["value"] is None:
                continue
            real = numbers[row["figure"]]["real"]
            assert float(real["value"]) == row["value"]
            if row["expanded_uncertainty"] is not None:
                mu = real["measurementUncertaintyUnivariate"]["expandedMU"]
                assert float(mu["valueExpandedMU"]) == row["expanded_uncertainty"]
                assert float(mu["coverageFactor"]) == row["coverage_factor"]
                assert mu["coverageProbability"] == "0.9545"
        means = [row["mean_backward"] for row in content["iso230_2"]["targets"]]
        if means[0] is not None:
            listed = numbers["mean_backward"]["realListXMLList"]["valueXMLList"]
            assert [float(text) for text in listed.split()] == means
        assert read.uid() == report(case).header.get("certificate_number", "not stated")


@pytest.mark.parametrize("factor", [0.9, None])
def test_an_uncertainty_whose_factor_cannot_be_stated_is_left_out(
    factor: float | None,
    schema: etree.XMLSchema,
    rules: SchematronValidator,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    content = results("draft")
    content["figure_table"][0]["coverage_factor"] = factor
    changed = json.dumps(content).encode()
    monkeypatch.setattr("thermaxis.report.dcc._certificate.results_json", lambda _: changed)
    xml = dcc_xml(report("draft"))
    assert faults(xml, schema, rules) == []
    root = etree.fromstring(xml)
    stated = "//dcc:quantity[@refType='thermaxis_{}']//si:measurementUncertaintyUnivariate"
    assert not found(root, stated.format("B"))
    assert found(root, stated.format("A"))


def test_the_page_publishes_the_types_that_are_written(
    published: dict[str, tuple[str, str, str]], root: Path
) -> None:
    page = (root / "docs" / "dcc-types.md").read_text(encoding="utf-8")
    definitions = found(tree("full"), "//dcc:refTypeDefinition")
    names = [found(one, "dcc:link")[0].text for one in definitions]
    assert names[0].startswith("urn:uuid:")
    assert f"`{names[0]}`" in page
    assert b"docs/" not in dcc_xml(report("full"))
    written = {
        ref_type
        for case in CASES
        for element in found(tree(case), "//*[@refType]")
        for ref_type in element.get("refType").split()
        if ref_type.startswith("thermaxis_")
    }
    figures = "|".join(FIGURE_KEYS)
    stems = {
        re.sub(rf"^thermaxis_({figures})(?=$|_bias|_drift)", "thermaxis_F", one) for one in written
    }
    unknown = {
        one
        for one in stems
        if f"`{one}`" not in page
        and one.removesuffix("_driftFree") not in published
        and not one.startswith("thermaxis_header_")
    }
    assert unknown == set()
    never = {name for name in published if name.startswith("thermaxis_")} - written
    assert never == set()


@pytest.mark.real_data
@pytest.mark.parametrize(
    ("run", "accuracy"),
    [
        ("ess_target_b02_x/x_positioning_with_times.csv", "135.27"),
        ("psi_ecmccfg/psi_fat_sat_2023/report.md_ISO230.dat", "0.09"),
        ("psi_ecmccfg/ess_mcu1025_2021/report.md_ISO230.dat", "204.76"),
    ],
)
def test_certificates_of_real_runs_are_valid_and_bear_their_figures(
    run: str,
    accuracy: str,
    real_data: Path,
    schema: etree.XMLSchema,
    rules: SchematronValidator,
) -> None:
    made = report_of(read_positioning(real_data / "positioning" / run))
    xml = dcc_xml(made)
    assert faults(xml, schema, rules) == []
    (value,) = found(etree.fromstring(xml), "//dcc:quantity[@refType='thermaxis_A']//si:value")
    assert float(value.text) == made.iso230_2.A
    assert f"{float(value.text):.2f}" == accuracy


# ---- administrative data ------------------------------------------------------------------------


def test_a_draft_says_so_and_a_full_certificate_does_not() -> None:
    draft, full = tree("draft"), tree("full")
    statement = found(draft, "//dcc:statement[@refType='thermaxis_draft']")[0]
    said = found(statement, "dcc:declaration/dcc:content")[0].text
    assert "DRAFT" in found(statement, "dcc:description/dcc:content")[0].text
    assert said == f"Not stated: {report('draft').missing_labels}"
    assert found(statement, "dcc:valid")[0].text == "false"
    assert statement is found(draft, "//dcc:statement")[0]
    assert found(draft, "//dcc:uniqueIdentifier")[0].text == "not stated"
    assert found(draft, "//dcc:customer/dcc:name/dcc:content")[0].text == "not stated"
    assert found(draft, "//dcc:countryCodeISO3166_1")[0].text == "AQ"
    assert report("full").missing_fields == ()
    assert found(full, "//dcc:statement[@refType='thermaxis_draft']") == []
    texts = found(full, "//*[not(contains(text(), 'U is without'))]/text()")
    assert "not stated" not in " ".join(texts)
    assert any("U contains: " in text for text in found(full, "//dcc:statement//text()"))
    bare = report("without times").missing_fields
    assert {"time.date", "environment.air_temperature_c"} < {*bare}
    assert found(tree("without times"), "//dcc:beginPerformanceDate")[0].text == "0001-01-01"


def test_the_head_stands_where_programs_look_for_it() -> None:
    root = tree("full")
    for path, text in {
        "//dcc:uniqueIdentifier": "K-2026/0417",
        "//dcc:countryCodeISO3166_1": "CZ",
        "//dcc:receiptDate": "2026-03-01",
        "//dcc:beginPerformanceDate": "2026-03-02",
        "//dcc:issueDate": "2026-03-09",
        "//dcc:performanceLocation": "customer",
        "//dcc:calibrationLaboratoryCode": "L 2345",
        "//dcc:customer/dcc:location/dcc:further[2]/dcc:content": "metrology@example.org",
        "//dcc:respPerson[dcc:mainSigner='true']//dcc:content": "a Authorised by",
        "//dcc:measuringEquipment/dcc:identifications/dcc:identification"
        "[@refType='thermaxis_certificate']/dcc:value": "1234-KL-26",
        "//dcc:influenceCondition[contains(@refType,'humidity')]//si:value": "0.41",
        "//dcc:influenceCondition[contains(@refType,'pressure')]//si:value": "98.90",
        "//dcc:influenceCondition[contains(@refType,'material')]//dcc:noQuantity/*": "23.9 to 24.6"
        " °C",
        "//dcc:identification[@refType='thermaxis_sha256_results']/dcc:value": results_sha256(
            report("full")
        ),
        "//dcc:dccSoftware/dcc:software/dcc:release": "v1.2.3",
        "//dcc:usedMethod/dcc:norm": "ISO 230-2:2014",
        "//dcc:usedSoftware//dcc:description/dcc:content": "decimal comma; reference time h 0.5",
    }.items():
        assert found(root, path)[0].text == text, path


def test_every_field_of_the_head_is_in_it() -> None:
    stated = {key: f"stated as {key}" for key in HEADER_FIELDS}
    stated |= {"laboratory_country": "AT", "date_of_issue": "2026-04-01", "start": "2026-03-02"}
    stated |= {"date_of_receipt": "2026-02-02", "end": "2026-03-03", "date": "2026-03-04"}
    full = replace(report("full"), header=stated)
    root = etree.fromstring(dcc_xml(full, statements=[stated["reproduction"]]))
    text = " ".join(root.itertext())
    assert {key for key, value in stated.items() if value not in text} == set()
    assert found(root, "//dcc:performanceLocation")[0].text == "other"


def test_limits_become_statements_of_conformity() -> None:
    root = tree("full")
    verdicts = {row["figure"]: row for row in results("full")["figure_table"] if row["limit"]}
    assert {figure: row["verdict"] for figure, row in verdicts.items()} == {
        "B": "pass",
        "M": "fail",
        "A": "not decided",
    }
    overall = found(root, "/*/*/dcc:measurementResult/dcc:measurementMetaData/dcc:metaData")[0]
    assert found(overall, "dcc:conformity")[0].text == "fail"
    assert "ISO 14253-1" in found(overall, "dcc:declaration/dcc:content")[0].text
    for figure, row in verdicts.items():
        data = found(root, f"//dcc:quantity[@refType='thermaxis_{figure}']//dcc:metaData")[0]
        limit = found(data, ".//dcc:quantity[@refType='basic_toleranceLimitUpper']//si:value")[0]
        assert float(limit.text) == row["limit"]
        conformity = [one.text for one in found(data, "dcc:conformity")]
        assert conformity == ([row["verdict"]] if row["verdict"] != "not decided" else [])
    assert found(tree("draft"), "//dcc:conformity") == []
    for figure, distribution in (("B", "normal"), ("E", "empirical")):
        said = found(root, f"//dcc:quantity[@refType='thermaxis_{figure}']//si:distribution")
        assert [one.text for one in said] == [distribution]
    (stated,) = found(root, "//dcc:quantity[@refType='thermaxis_B']//si:expandedMU")
    assert [one.text for one in stated] == ["0.3", "2.0", "0.9545", "normal"]


def test_a_verdict_on_a_run_that_is_not_the_standards_test_says_so() -> None:
    short = report_of(make_run(cycles=3), limits=LIMITS)
    assert short.conditions
    root = etree.fromstring(dcc_xml(short))
    said = found(root, "/*/*/*/dcc:measurementMetaData/dcc:metaData/dcc:declaration/dcc:content")
    assert "conditions of the standard are not met" in said[0].text


def test_hostile_texts_stay_texts(schema: etree.XMLSchema, rules: SchematronValidator) -> None:
    head = dict.fromkeys(FULL_HEAD, HOSTILE) | {"odd_line": HOSTILE, "end": "2026-03-01"}
    test = make_run()
    odd = {**test.environment, "strange <key>": StartEnd(1.0, None)}
    hostile = replace(
        make_report(replace(test, environment=odd), header=head), version="9.9.9.dev1+x"
    )
    assert "laboratory.country" in hostile.missing_fields  # no country is called so
    xml = dcc_xml(hostile, statements=(HOSTILE,))
    assert faults(xml, schema, rules) == []
    assert not found(etree.fromstring(xml), "//x")
    assert dcc_xml(hostile, statements=(HOSTILE,)) == xml


# ---- files --------------------------------------------------------------------------------------


def text_of(pdf: bytes) -> str:
    document = pypdfium2.PdfDocument(pdf)
    text = "".join(page.get_textpage().get_text_range() for page in document)
    assert document.count_attachments() == 0
    document.close()
    return "".join(text.split())


@pytest.mark.usefixtures("no_charts")
def test_the_pdf_inside_bears_the_same_number_and_hash(tmp_path: Path) -> None:
    path = tmp_path / "certificate.xml"
    write_report(report("full"), path)
    root = etree.parse(path).getroot()
    document = found(root, "/*/dcc:document")[0]
    assert found(document, "dcc:mimeType")[0].text == "application/pdf"
    text = text_of(base64.b64decode(found(document, "dcc:dataBase64")[0].text))
    assert found(root, "//dcc:uniqueIdentifier")[0].text in text
    of_results = found(root, "//dcc:identification[@refType='thermaxis_sha256_results']/dcc:value")
    assert of_results[0].text == results_sha256(report("full"))
    assert of_results[0].text in text


RUN = "cycle,direction,target_mm,deviation_um\n" + "".join(
    f"{cycle},{way},{target},{(target * 7 + cycle * 3) % 5 + 0.1 * cycle}\n"
    for cycle in range(1, 4)
    for way, targets in (("forward", (0, 10, 20)), ("backward", (20, 10, 0)))
    for target in targets
)


@pytest.mark.proof
@pytest.mark.usefixtures("no_charts")
def test_the_command_says_that_it_is_a_draft_and_refuses_it_as_final(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run, xml, js = tmp_path / "run.csv", tmp_path / "c.xml", tmp_path / "r.json"
    run.write_text(RUN, encoding="utf-8")
    asked = ["evaluate", str(run), "--json", str(js), "--report", str(xml)]
    assert main([*asked, "--final"]) == 2
    err = capsys.readouterr().err
    assert "certificate.number" in err
    assert "laboratory.country" in err
    assert not xml.exists()
    assert not js.exists()
    assert main(asked) == 0
    assert "certificate.number" in capsys.readouterr().err
    drafted = etree.parse(xml)
    assert found(drafted, "//dcc:statement[@refType='thermaxis_draft']")
    content = json.loads(js.read_text())
    for row in content["figure_table"]:
        value = found(drafted, f"//dcc:quantity[@refType='thermaxis_{row['figure']}']//si:value")
        assert value[0].text == repr(row["value"])
    head = tmp_path / "header.toml"
    needed = {field.place: field for field in HEADER_FIELDS.values() if field.needed}
    lines = {
        "laboratory.country": "AT",
        **{place: "x" for place in needed if "country" not in place},
    }
    lines |= {"time.date": "2026-03-02", "environment.air_temperature_c": "20.1"}
    tables = dict.fromkeys(place.partition(".")[0] for place in lines)
    head.write_text(
        "".join(
            f"[{table}]\n"
            + "".join(
                f'{place.partition(".")[2]} = "{text}"\n'
                for place, text in lines.items()
                if place.startswith(f"{table}.")
            )
            for table in tables
        ),
        encoding="utf-8",
    )
    for dated, key in (
        (["--date", "2026-03-01"], "--date"),
        ([], "instrument.calibration_date"),
    ):
        wrong = tmp_path / "wrong.toml"
        late = "" if dated else "[instrument]\ncalibration_date = 2026-03-03\n"
        wrong.write_text(head.read_text(encoding="utf-8") + late, encoding="utf-8")
        command = [*asked, "--header", str(wrong), *dated]
        assert main([*command, "--final"]) == 2
        assert key in capsys.readouterr().err
        assert main(command) == 0
        capsys.readouterr()
        codes = {one["code"] for one in json.loads(js.read_text())["warning_codes"]}
        assert "warning-date_impossible" in codes
    assert main([*asked, "--final", "--header", str(head)]) == 0
    assert capsys.readouterr().err == ""
    assert not found(etree.parse(xml), "//dcc:statement[@refType='thermaxis_draft']")
