"""The results of any certificate as JSON, and their hash."""

import hashlib
import json

from thermaxis.report._certified_report import CertifiedReport
from thermaxis.report._positioning_report import PositioningReport
from thermaxis.report._thermal_test_report import ThermalTestReport
from thermaxis.report.tables._described import Part, as_json
from thermaxis.report.tables._evaluation import describe_evaluation
from thermaxis.report.tables._thermal_test import describe_thermal_test


def _described(report: CertifiedReport) -> list[Part]:
    if isinstance(report, ThermalTestReport):
        return describe_thermal_test(report)
    assert isinstance(report, PositioningReport)  # noqa: S101 - there are two
    return describe_evaluation(report)


def results_json(report: CertifiedReport) -> bytes:
    """Return the results of a run as JSON that depends on them alone.

    Returns
    -------
    bytes
        What ``--json`` of the command writes, as one line of ASCII: keys in alphabetical
        order, no blanks.
    """
    content = as_json(_described(report))
    plain = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return plain.encode("ascii")


def results_sha256(report: CertifiedReport) -> str:
    """Return the SHA-256 of the results of a run, which every form of its certificate bears.

    Returns
    -------
    str
        Hash of `results_json`: 64 hexadecimal digits.
    """
    return hashlib.sha256(results_json(report)).hexdigest()
