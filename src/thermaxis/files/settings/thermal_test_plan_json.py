"""Plans of thermal tests as JSON, ``thermaxis-thermal-test-plan`` version 1.

One object: ``format``, ``version``, the fields of `ThermalTestPlan`, and ``sha256``, the SHA-256 of
the content (may be left out; where it stands it must be right).
"""

import json
from pathlib import Path

from thermaxis.files.settings._document import (
    Form,
    content_sha256,
    document_of,
    plain,
    read_document,
    write_document,
)
from thermaxis.files.settings._reading import read_json_object, settings_of
from thermaxis.files.settings.plan_json import plan_of
from thermaxis.positioning import TestPlan
from thermaxis.thermal import ThermalTestPlan

_FORM = Form("thermaxis-thermal-test-plan", 1, largest_bytes=5_000_000)


def thermal_test_plan_sha256(plan: ThermalTestPlan) -> str:
    """Return the hash of a plan: what an NC program names it by."""
    return content_sha256(_content(plan))


def _content(plan: ThermalTestPlan) -> dict[str, object]:
    return {"format": _FORM.format, "version": _FORM.version, **plain(plan)}


def write_thermal_test_plan(plan: ThermalTestPlan, path: Path | str) -> None:
    """Write a plan, as `write_model` writes a model."""
    content = _content(plan)
    content["sha256"] = content_sha256(content)
    write_document(json.dumps(content, indent=1, allow_nan=False) + "\n", path)


def read_thermal_test_plan(path: Path | str) -> ThermalTestPlan:
    """Read a plan, at most 5 MB; as `read_model` reads a model, and with the same errors."""
    return read_document(path, _FORM, _plan, thermal_test_plan_sha256)


def read_any_plan(path: Path | str) -> TestPlan | ThermalTestPlan:
    """Read a plan of a positioning run or of a thermal test, as its format says."""
    table = read_json_object(path, largest_bytes=_FORM.largest_bytes)
    if table.get("format") == _FORM.format:
        return document_of(table, str(path), _FORM, _plan, thermal_test_plan_sha256)
    return plan_of(table, str(path))


def _plan(content: dict[str, object], file: str) -> ThermalTestPlan:
    return settings_of(ThermalTestPlan, content, file=file)
