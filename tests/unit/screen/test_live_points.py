"""What a page has seen itself: gaps stay gaps."""

from typing import Any

from tests.unit.screen.page_script import said_by
from thermaxis.web import asset_folder

SCRIPT = asset_folder() / "live_points.js"


def said(body: str) -> Any:
    """Return what a script says that has the module's functions."""
    text = f"""
const {{ withGaps }} = await import("file://{SCRIPT}");
process.stdout.write(JSON.stringify((() => {{ {body} }})()));
"""
    return said_by(text)


def test_a_pause_between_two_values_is_a_gap() -> None:
    found = said("return withGaps({ t: [0, 5, 10, 60, 65], y: [1, 2, null, 4, 5] }, 15);")
    assert found == {"x": [0, 5, 10, 11, 60, 65], "y": [1, 2, None, None, 4, 5]}
