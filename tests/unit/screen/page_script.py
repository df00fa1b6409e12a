"""Scripts of the pages outside a browser, in node."""

import json
import shutil
import subprocess
from typing import Any

import pytest

LONGEST_S = 60.0


def said_by(text: str, given: object = None) -> Any:
    """Return the JSON that a module prints; it finds what it is given at its standard input."""
    if shutil.which("node") is None:
        pytest.fail("node is missing: apt-get install nodejs, as .ci/run does")
    ended = subprocess.run(
        ["node", "--input-type=module", "-e", text],
        input=json.dumps(given),
        capture_output=True,
        text=True,
        timeout=LONGEST_S,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    return json.loads(ended.stdout)
