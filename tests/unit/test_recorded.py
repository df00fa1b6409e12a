"""The comparison of recordings notices what a number, a key or an option lost, and only that."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="module")
def recorded(root: Path) -> ModuleType:
    path = root / "benchmarks" / "recorded.py"
    spec = importlib.util.spec_from_file_location("recorded", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("old", "new", "places"),
    [
        ({"a": 1.0}, {"a": 1.0 + 1e-13, "b": 2}, []),
        ({"a": 1.0}, {"a": 1.0 + 1e-11}, [".a"]),
        ({"a": {"b": 1}}, {"a": {}}, [".a.b"]),
        ([1, 2], [1], [""]),
        ({"a": None}, {"a": 0}, [".a"]),
        ({"a": True}, {"a": 1}, [".a"]),
        ({"a": "at 5 µm"}, {"a": "from 5 µm on"}, []),
        ({"a": "at 5 µm"}, {"a": "at 6 µm"}, [".a"]),
    ],
)
def test_a_number_or_a_key_of_json_that_is_lost_is_found_where_it_stood(
    recorded: ModuleType, old: object, new: object, places: list[str]
) -> None:
    assert [place for place, _, fails in recorded.values("", old, new) if fails] == places


@pytest.mark.parametrize(
    ("old", "new", "fails"),
    [
        ("B is 2.5 µm", "2.5 µm is B", False),
        ("E is -2.5 µm", "E is 2.5 µm", True),
        ("X-10.5 F300", "X10.5 F300", True),
        ("X-10.5 F300", "X10.5 F-300", True),
        ("--json FILE  writes", "--jsons FILE  writes", True),
    ],
)
def test_numbers_and_options_of_a_text_count_and_its_words_do_not(
    recorded: ModuleType, old: str, new: str, fails: bool
) -> None:
    assert [one[2] for one in recorded.texts("", old, new)] == ([True] if fails else []) + [False]


@pytest.mark.parametrize(
    ("old", "new", "places"),
    [
        ("a,b\n1,x\n2,y\n", "c,b,a\n0,x,1\n0,z,2.0\n", []),
        ("a,b\n1,x\n2,y\n", "a,b\n1,x\n2.1,y\n", ["a"]),
        ("a,b\n1,x\n2,y\n", "a\n1\n2\n", ["b"]),
        ("# c\na;b\n1;\n2;3\n", "# c\na;b\n1;\n", ["a", "b"]),
        ("1,2\n3,4\n", "1,2\n3,5\n", ["1"]),
    ],
)
def test_columns_of_a_table_are_compared_by_their_headings(
    recorded: ModuleType, old: str, new: str, places: list[str]
) -> None:
    found = recorded.tables(old, new, keys_only=False)
    assert [place for place, _, fails in found if fails] == places
