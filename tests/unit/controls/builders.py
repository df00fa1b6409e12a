"""Plans, programs and tables of the controls' tests."""

import numpy as np

from thermaxis.controls import Control, ProgramRequest, ReadTable, TableRequest, check_options
from thermaxis.files import plan_sha256
from thermaxis.positioning import FORWARD, TestPlan, moves_of_plan, order_of_visits
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


def planned_stops(plan: TestPlan) -> list[tuple[float, float]]:
    """Return position and direction of every stop in its order."""
    visits = order_of_visits(plan)
    side = np.where(visits.approach == FORWARD, 1.0, -1.0)
    return list(zip(plan.target[visits.target].tolist(), side.tolist(), strict=True))


def found(read: ReadTable) -> list[str]:
    """Return the codes of what was found in a table."""
    return [one.code.removeprefix("finding-") for one in read.findings]


def table_text(control: Control, table: object, *sets: str) -> str:
    options = check_options(control, sets, purpose="table")
    return control.format_table(TableRequest(table=table, options=options)).text


def read_text(
    control: Control, text: str, kind: AxisKind = AxisKind.LINEAR, *sets: str
) -> ReadTable:
    return control.read_table(text, "t.com", kind, check_options(control, sets, purpose="table"))
