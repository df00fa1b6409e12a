"""The page on the status server names every node, method, key and bound as they are."""

import json
import re
import tomllib
from datetime import datetime
from pathlib import Path

import pytest

from tests.unit.runtime.status_server_parts import NOW, alarm, status
from thermaxis.codes import Message
from thermaxis.compensation import SampleQuality
from thermaxis.runtime import FAILURES_BY_ADDRESS, HistorianStatus
from thermaxis.runtime.status import (
    ASKS,
    FIELDS,
    Kind,
    OutputTouches,
    Shape,
    as_json,
    leaves_of,
    shape_of,
)
from thermaxis.runtime.status._fields import _BAD_BY_QUALITY, STATE_NUMBERS, state_text
from thermaxis.runtime.status._metrics import metrics_of
from thermaxis.runtime.status._sessions import (
    MOST_CALLS,
    MOST_CONNECTIONS,
    MOST_MONITORED,
    MOST_SUBSCRIPTIONS,
)
from thermaxis.runtime.users import FAILURES_BY_NAME

DOCS = Path(__file__).parents[3] / "docs"
PAGE = "".join(
    (DOCS / f"{name}.md").read_text("utf-8") for name in ("how-to/status-server", "status")
)
ROWS = {line.split("|")[1].strip().strip("`"): line for line in PAGE.splitlines() if "|" in line}


def test_every_node_stands_on_the_page_with_its_type_and_meaning() -> None:
    leaves = leaves_of(Shape(("NAME",), ("NAME",), ("NAME",))).shown
    for path, leaf in leaves.items():
        assert ROWS[path] == f"| `{path}` | {leaf.field.kind.value} | {leaf.field.text} |"
    folders = ("Status/", "Alarms/", "Model/", "Workpiece/", "Historian/", "Outputs/", "Inputs/")
    on_page = {path for path in ROWS if path.startswith((*folders, "Signals/"))}
    assert on_page == set(leaves)


def test_every_method_stands_on_the_page_with_its_role_and_arguments() -> None:
    for ask in ASKS:
        cells = [cell.strip() for cell in ROWS[ask.name].split("|")[2:-1]]
        arguments = ", ".join(f"`{argument.name}`" for argument in ask.arguments) or "none"
        assert cells == [ask.role.value, arguments, ask.text]


TOUCHED = OutputTouches(-2.0, 2.5, 1.2, "believed", 2.0, touched=NOW)
CERTIFIED = status(certificates={"server.certificate": NOW}, touches={"Z_um": TOUCHED})
WHOLE = json.loads(as_json(status(alarms=(alarm(),))))
TABLES = {
    "loop": WHOLE,
    "outputs": WHOLE["outputs"]["Z_um"],
    "inputs": WHOLE["inputs"]["T_column_C"],
    "signals": WHOLE["signals"]["interlock.referenced"],
}
HEAD = {"format", "version", "program_version", "alarms", "outputs", "inputs", "signals"}


def test_every_key_of_the_json_stands_on_the_page() -> None:
    keys = {key for table in TABLES.values() for key in table}
    keys |= set(WHOLE["alarms"][0]) | set(WHOLE["historian"])
    assert [key for key in sorted(keys) if f"`{key}`" not in PAGE] == []


@pytest.mark.parametrize("group", TABLES)
def test_the_json_has_every_field_and_no_other(group: str) -> None:
    declared = [field.key for field in getattr(FIELDS, group) if field.key]
    assert len(declared) == len(set(declared))
    within = ("limits", "historian")
    told = [
        f"{key}/{inner}" if key in within else key
        for key, value in TABLES[group].items()
        for inner in (value if key in within else [""])
    ]
    assert sorted(told) == sorted([*declared, *(HEAD if group == "loop" else [])])


def test_the_metrics_are_the_fields_that_have_one_and_what_only_they_tell() -> None:
    every = [field.metric for of in FIELDS for field in of if field.metric]
    own = ["up", "status_age_seconds", "loop", "state", "connected", "alarms", "input_good"]
    own.append("certificate_expiry_timestamp_seconds")
    told = {sample.name for m in metrics_of(CERTIFIED, 0.0) for sample in m.samples}
    assert told == {f"thermaxis_{name}" for name in [*every, *own]}


TYPES = {
    Kind.NUMBER: float,
    Kind.COUNT: int,
    Kind.FLAG: bool,
    Kind.TEXT: str,
    Kind.TIME: datetime,
    Kind.TEXTS: tuple,
    Kind.NUMBERS: tuple,
    Kind.MESSAGE: Message,
    Kind.TABLE: dict,
}


def test_every_field_has_a_value_of_its_type() -> None:
    why = Message("error-user_refused")
    told = status(
        alarms=(alarm(),),
        source_reason=why,
        sink_reason=why,
        historian=HistorianStatus(False, 7, 2, why),
        reference_c={"T_spindle_C": 20.0, "T_column_C": 20.0},
        touches={"Z_um": TOUCHED},
    )
    leaves = leaves_of(shape_of(told))
    named = [leaf for of in leaves.tables.values() for some in of.values() for leaf in some]
    for leaf in (*leaves.loop, *named):
        value = leaf.read(told).value
        assert isinstance(value, TYPES[leaf.field.kind]), leaf.field
        if isinstance(value, tuple) and value:
            inner = str if leaf.field.kind is Kind.TEXTS else float
            assert isinstance(value[0], inner), leaf.field


def test_the_bounds_on_the_page_are_those_in_force() -> None:
    for words in (
        (
            f"more than {MOST_CALLS} calls in one request,"
            f" {MOST_SUBSCRIPTIONS} subscriptions or {MOST_MONITORED} monitored items"
        ),
        f"more than {MOST_CONNECTIONS} connections",
        f"more than {FAILURES_BY_NAME} failures of this name, or {FAILURES_BY_ADDRESS} of any,",
    ):
        assert words in PAGE
    for code in _BAD_BY_QUALITY.values():
        assert f"`{code}`" in PAGE


def test_every_quality_has_a_status_code_of_its_kind() -> None:
    usable = {SampleQuality.GOOD, SampleQuality.REDUNDANT}
    assert set(_BAD_BY_QUALITY) == set(SampleQuality) - usable
    assert all(code.startswith("Bad") for code in _BAD_BY_QUALITY.values())


def test_every_figure_that_the_page_names_exists_and_its_examples_are_toml() -> None:
    names = {sample.name for m in metrics_of(CERTIFIED, 0.0) for sample in m.samples}
    assert set(re.findall(r"thermaxis_\w+", PAGE)) <= names
    examples = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    assert len(examples) == 3
    for example in examples:
        assert tomllib.loads(example)


def test_the_state_has_a_number_and_a_sentence() -> None:
    assert sorted(STATE_NUMBERS.values()) == list(range(len(STATE_NUMBERS)))
    assert state_text(status()) == "Compensating. The correction follows the model."
