"""What the Makefile leaves out, so that it is not read in vain."""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_no_slow_test_lies_where_nobody_looks_for_it() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8").replace("\\\n", " ")
    (command,) = re.findall(r'-m "system and not real_time".*', makefile)
    folders = {ROOT / one for one in re.findall(r"\btests/\w+", command)}
    marked = {
        path
        for path in (ROOT / "tests").rglob("test_*.py")
        if re.search(r"^(?:pytestmark = |@).*mark\.system", path.read_text("utf-8"), re.MULTILINE)
    }
    assert len(marked) > 20
    assert [path for path in marked if not folders & {*path.parents}] == []
