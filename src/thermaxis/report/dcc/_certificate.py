"""The certificate of a run as a Digital Calibration Certificate: PTB's DCC 3.3 with D-SI."""

import base64
import json
import re
from collections.abc import Iterator, Sequence
from typing import cast
from xml.etree.ElementTree import Element, indent, tostring

from thermaxis.files.settings import HEADER_FIELDS, day_of
from thermaxis.messages import sentence_of
from thermaxis.report._certified_report import CertifiedReport
from thermaxis.report._figure_table import figure_table
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._text import plain_text
from thermaxis.report.dcc._fields import influence_conditions, quantities, sensors
from thermaxis.report.dcc._results import Content, conformity, results_of
from thermaxis.report.dcc._thermal_test import thermal_test_results
from thermaxis.report.dcc._xml import LONGEST, element, filled_form, proper, words
from thermaxis.report.tables import TITLES, options_in_words, results_json, results_sha256
from thermaxis.thermal import ThermalTestKind

_NO_COUNTRY = "AQ"
"""Country of a draft that states none: Antarctica, as every code is that of a place."""
_NO_DAY = "0001-01-01"
"""Day of a draft that states none."""
_PLACES = ("laboratory", "customer", "laboratoryBranch", "customerBranch")
_OF_METHOD = ("correction", "procedure", "time", "traceability", "uncertainty")
_IN_FORM = frozenset(
    {
        *("machine", "machine_manufacturer", "machine_model", "serial_number", "asset_number"),
        *("axis", "date_of_receipt", "deviations_from_method", "instrument"),
        *("instrument_manufacturer", "instrument_model", "instrument_serial_number"),
        *("instrument_certificate_number", "instrument_traceability"),
    }
)
"""Fields of machine, axis, instrument and method for which the form has a place."""


def dcc_xml(
    report: CertifiedReport, *, statements: Sequence[str] = (), document: bytes | None = None
) -> bytes:
    """Return the certificate of a run as PTB's Digital Calibration Certificate 3.3.

    Parameters
    ----------
    statements : sequence of str
        Sentences that hold for the whole certificate, such as that on its reproduction.
    document : bytes, optional
        The certificate as PDF for people, which it then carries. Default: it carries none.

    Returns
    -------
    bytes
        XML, UTF-8, valid by PTB's schema; the same input gives the same bytes. Numbers have all
        digits of the results' JSON. Where `report.missing_fields` names something it is a draft
        and says so.

    References
    ----------
    DCC 3.3.0 and D-SI 2.2 (Physikalisch-Technische Bundesanstalt); types of quantities:
    docs/dcc-types.md.
    """
    results = cast("Content", json.loads(results_json(report)))
    run = report if isinstance(report, PositioningReport) else None
    own = _of_thermal_test(results) if run is None else _of_run(run, results)
    texts = {**_texts(report), **own}
    if document is not None:
        texts["pdf"] = base64.b64encode(document).decode("ascii")
    method = "method" if run else "method of thermal test"
    of_item = ("machine", "axis", "state")
    slots = {
        "statements": (_declared("dcc:statement", "Statement", text) for text in statements),
        "item": quantities(report, "dcc:itemQuantity", of_item, _IN_FORM),
        method: quantities(report, "dcc:usedMethodQuantity", _OF_METHOD, _IN_FORM),
        "instrument": quantities(
            report, "dcc:measuringEquipmentQuantity", ("instrument",), _IN_FORM
        ),
        "sensors": sensors(report),
        "conditions": influence_conditions(report),
        "results": results_of(results) if run else thermal_test_results(results),
        "metadata": _metadata(run, results),
    }
    root = filled_form(texts, slots)
    indent(root)
    return tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def _texts(report: CertifiedReport) -> dict[str, str]:
    """Return the texts of the form: fields of the head, and what is made of them."""
    head = {key: plain_text(report.header.get(key, ""), LONGEST) for key in HEADER_FIELDS}
    missing, place = report.missing_fields, head["performed_at"]
    country = "" if "laboratory.country" in missing else head["laboratory_country"]
    received = day_of(head["date_of_receipt"])
    first, last = (
        (day.isoformat() for day in sorted(report.performed))
        if report.performed
        else (_NO_DAY, _NO_DAY)
    )
    version = re.match(r"\d{1,3}(\.\d{1,3}){0,3}", report.version, re.ASCII)
    axis = f", axis {head['axis']}" if head["axis"] else ""
    return {
        **head,
        "release": f"v{version[0] if version else 0}",
        "laboratory_country": country,
        "country": country or _NO_COUNTRY,
        "results_sha256": results_sha256(report),
        "source_sha256": report.source_sha256,
        "received": received.isoformat() if received else "",
        "begin": first,
        "end": last,
        "performance_location": place if place in _PLACES else "other",
        "place": "" if place in _PLACES else place,
        "issued": report.issued.isoformat() if report.issued else "",
        "item": f"{head['machine']}{axis}" if head["machine"] else "",
        "missing": f"Not stated: {report.missing_labels}" if missing else "",
        "equipment": "".join(head[key] for key in head if key.startswith("instrument")),
    }


def _of_run(report: PositioningReport, results: Content) -> dict[str, str]:
    """Return the texts of a positioning run."""
    drift, test = results["drift"], results["test"]
    directions = "unidirectional" if test["unidirectional"] else "bidirectional"
    return {
        "title_of_results": "Accuracy and repeatability of positioning",
        "options": options_in_words(report),
        "uncertainty": " ".join(map(sentence_of, figure_table(report).legend)),
        "cycle": f"{test['cycle']} test cycle, {test['cycles']} cycles, {directions}",
        "standard": f"ISO 230-2:{results['iso230_2']['edition']}",
        "model": f"Model of the drift: {drift['model']}" if drift else "",
    }


def _of_thermal_test(results: Content) -> dict[str, str]:
    """Return the texts of a thermal test."""
    kind = TITLES[ThermalTestKind(results["kind"])]
    return {
        "title_of_results": f"Thermal test: {kind}",
        "thermal_test": f"{kind}; spans, ranges and tilts of the standard from memory [M]",
        "uncertainty": "U with k = 2, of independent terms; what nobody stated is not in it.",
    }


def _metadata(report: PositioningReport | None, results: Content) -> Iterator[Element]:
    """Yield the verdict on the run, and what the reader of the results must know."""
    if report is not None and report.limits is not None:
        rule = report.limits.limits.decision_rule.in_words
        if report.conditions:
            rule += ". Test conditions of the standard are not met: see the remarks"
        if report.limits.reservation is not None:
            rule += f". {sentence_of(report.limits.reservation)}"
        yield conformity(str(report.limits.verdict), rule)
    for text in results["warnings"]:
        yield _declared("dcc:metaData", "Remark", text, "thermaxis_remark")
    drift: Content = results.get("drift") or {"diagnosis": ()}
    for finding in drift["diagnosis"]:
        yield _declared("dcc:metaData", "Finding", finding["text"], "thermaxis_finding")


def _declared(tag: str, name: str, text: str, ref_type: str = "") -> Element:
    return element(tag, words("dcc:name", name), proper("dcc:declaration", text), refType=ref_type)
