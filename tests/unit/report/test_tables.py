"""A result described once gives the same numbers as text and as JSON."""

import math
from datetime import UTC, datetime

import numpy as np

from thermaxis.report.tables import Section, Table, Value, as_json, as_text, rows_of, without_text

ROWS = rows_of(
    Value("position", np.array([0.0, 10.0]), "mm", ".1f"),
    Value("error", np.array([-0.004, np.nan]), "error", "+.2f"),
    Value("hidden", [1, 2]),
    Value("", ["a", "b\x1b[31m"], "text only"),
)


def test_every_part_stands_in_the_json_where_its_key_says() -> None:
    parts = [
        "a line for the terminal",
        Value("a.b", np.float64(1.5), "b", ".2f", "µm"),
        Value("a.when", datetime(2026, 3, 1, tzinfo=UTC)),
        Value("lost", math.inf, "lost"),
        Section("inner", [Value("flag", np.bool_(True)), Table("rows", ROWS, key="rows")]),
        Section("", [Value("beside", ("x", "y"), "said"), Table("only text", ROWS)]),
        Table("", ROWS, key="named", names=["first", "second"]),
    ]
    rows = [
        {"position": 0.0, "error": -0.004, "hidden": 1},
        {"position": 10.0, "error": None, "hidden": 2},
    ]
    assert as_json(parts) == {
        "a": {"b": 1.5, "when": "2026-03-01T00:00:00+00:00"},
        "lost": None,
        "inner": {"flag": True, "rows": rows},
        "beside": ["x", "y"],
        "named": {"first": rows[0], "second": rows[1]},
    }


def test_the_terminal_shows_labels_units_and_tables_but_no_key_without_a_head() -> None:
    parts = [
        Value("b", 1.5, "b", ".2f", "µm"),
        Value("none", None, "none"),
        Value("zero", -0.001, "zero", "+.2f"),
        Value("interval", [1.0, 2.0], "interval", ".1f"),
        Value("warnings", ["one", "two"], "warning"),
        Section("inner", [Table("rows", ROWS, key="rows"), Table("", ROWS, key="json")]),
        *without_text(Value("hidden", 7, "seven")),
    ]
    shown = as_text(parts)
    assert shown.splitlines()[:6] == [
        "b: 1.50 µm",
        "none: –",
        "zero: 0.00",
        "interval: 1.0 to 2.0",
        "warning: one",
        "warning: two",
    ]
    table = [line.split() for line in shown.splitlines()[-2:]]
    assert table == [["0.0", "0.00", "a"], ["10.0", "–", "b\\x1b[31m"]]
    assert shown.count("rows") == 1
    assert "seven" not in shown
