"""The page on the status server names every node, method, key and bound as they are."""

import json
import re
import tomllib
from pathlib import Path

from tests.unit.runtime.status_server_parts import alarm, compensation, output, status
from thermaxis.compensation import SampleQuality
from thermaxis.runtime import FAILURES_IN_ALL
from thermaxis.runtime.status import ASKS
from thermaxis.runtime.status._metrics import format_metrics
from thermaxis.runtime.status._nodes import (
    _BAD_BY_QUALITY,
    STATE_NUMBERS,
    Shape,
    Snapshot,
    as_json,
    facts_of,
    leaves_of,
    state_text,
)
from thermaxis.runtime.status._sessions import (
    MOST_CALLS,
    MOST_CONNECTIONS,
    MOST_MONITORED,
    MOST_NODES,
    MOST_SUBSCRIPTIONS,
)
from thermaxis.runtime.users import FAILURES_BY_NAME

PAGE = (Path(__file__).parents[3] / "docs" / "how-to" / "status-server.md").read_text("utf-8")
ROWS = {line.split("|")[1].strip().strip("`"): line for line in PAGE.splitlines() if "|" in line}


def test_every_node_stands_on_the_page_with_its_type_and_meaning() -> None:
    leaves = leaves_of(Shape(("NAME",), ("NAME",), ("NAME",))).shown()
    for path, leaf in leaves.items():
        assert ROWS[path] == f"| `{path}` | {leaf.kind.value} | {leaf.text} |"
    folders = ("Status/", "Alarms/", "Model/", "Workpiece/", "Historian/", "Outputs/", "Inputs/")
    on_page = {path for path in ROWS if path.startswith((*folders, "Signals/"))}
    assert on_page == set(leaves)


def test_every_method_stands_on_the_page_with_its_role_and_arguments() -> None:
    for ask in ASKS:
        cells = [cell.strip() for cell in ROWS[ask.name].split("|")[2:-1]]
        arguments = ", ".join(f"`{argument.name}`" for argument in ask.arguments) or "none"
        assert cells == [ask.role.value, arguments, ask.text]


def test_every_key_of_the_json_stands_on_the_page() -> None:
    told = status(alarms=(alarm(),))
    whole = json.loads(as_json(Snapshot(told, facts_of(compensation()))))
    keys = set(whole) | set(whole["outputs"]["Z_um"]) | set(whole["inputs"]["T_column_C"])
    keys |= set(whole["signals"]["interlock.referenced"]) | set(whole["alarms"][0])
    keys |= set(whole["historian"])
    assert [key for key in sorted(keys) if f"`{key}`" not in PAGE] == []


def test_the_bounds_on_the_page_are_those_in_force() -> None:
    for words in (
        (
            f"more than {MOST_NODES} nodes or {MOST_CALLS} calls in one request,"
            f" {MOST_SUBSCRIPTIONS} subscriptions or {MOST_MONITORED} monitored items"
        ),
        f"more than {MOST_CONNECTIONS} connections",
        f"more than {FAILURES_BY_NAME} failures of this name, or {FAILURES_IN_ALL} of all names",
    ):
        assert words in PAGE
    for code in _BAD_BY_QUALITY.values():
        assert f"`{code}`" in PAGE


def test_every_quality_has_a_status_code_of_its_kind() -> None:
    usable = {SampleQuality.GOOD, SampleQuality.REDUNDANT}
    assert set(_BAD_BY_QUALITY) == set(SampleQuality) - usable
    assert all(code.startswith("Bad") for code in _BAD_BY_QUALITY.values())


def test_every_figure_that_the_page_names_exists_and_its_examples_are_toml() -> None:
    page = format_metrics(status(output=output()), 0.0)
    for name in set(re.findall(r"thermaxis_\w+", PAGE)):
        assert f"\n{name}" in page or page.startswith(name), name
    examples = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    assert len(examples) == 3
    for example in examples:
        assert tomllib.loads(example)


def test_the_state_has_a_number_and_a_sentence() -> None:
    assert sorted(STATE_NUMBERS.values()) == list(range(len(STATE_NUMBERS)))
    assert state_text(status()) == "It follows the model."
    assert state_text(status(text="")) == "Active."
