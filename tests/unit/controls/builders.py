"""Plans, programs and tables of the controls' tests."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from thermaxis.codes import Value
from thermaxis.controls import (
    Control,
    ProgramRequest,
    ReadTable,
    TableRequest,
    TableText,
    check_options,
)
from thermaxis.files import plan_sha256
from thermaxis.messages import text_of
from thermaxis.positioning import BACKWARD, FORWARD, TestPlan, moves_of_plan
from thermaxis.quantities import AxisKind


def plan_of(**changes: object) -> TestPlan:
    fields: dict[str, object] = {
        "kind": AxisKind.LINEAR,
        "axis": "X",
        "target": np.array([0.0, 21.5, 38.0, 61.0, 83.0, 99.0]),
        "cycles": 5,
        "feed": 300.0,
        "dwell_s": 2.0,
        "recording_s": 0.5,
        "overrun": 5.0,
    }
    return TestPlan(**{**fields, **changes})


def in_every_direction(plan: TestPlan) -> Iterator[TestPlan]:
    """Give a plan with both approaches and with each alone."""
    for approaches in ((FORWARD, BACKWARD), (FORWARD,), (BACKWARD,)):
        yield replace(plan, approaches=approaches)


def program_of(
    control: Control, plan: TestPlan, *sets: str, warm_up: int = 0, **changes: object
) -> str:
    fields: dict[str, object] = {
        "plan": plan,
        "plan_sha256": plan_sha256(plan),
        "blocks": moves_of_plan(plan, warm_up=warm_up),
        "axis": plan.axis,
        "options": check_options(control, sets, purpose="program"),
    }
    return control.format_program(ProgramRequest(**{**fields, **changes}))


def found(read: ReadTable) -> list[str]:
    """Return the codes of what was found in a table."""
    return [one.code.removeprefix("finding-") for one in read.findings]


def advised(made: TableText) -> dict[str, Mapping[str, Value]]:
    """Return what the user of a table must know: values by code."""
    assert not any("advice-" in text_of(one) for one in made.advice)  # each has its sentence
    return {one.code.removeprefix("advice-"): one.values for one in made.advice}


def table_text(control: Control, table: object, *sets: str) -> str:
    options = check_options(control, sets, purpose="table")
    return control.format_table(TableRequest(table=table, options=options)).text


def read_text(
    control: Control, text: str, kind: AxisKind = AxisKind.LINEAR, *sets: str
) -> ReadTable:
    return control.read_table(text, "t.com", kind, check_options(control, sets, purpose="table"))
