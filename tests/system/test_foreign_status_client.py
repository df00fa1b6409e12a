"""The status server against a client written by others: node-opcua, in a program of its own."""

import asyncio
import json
import os
import time
from pathlib import Path
from typing import Any

import pytest

from tests.system.opcua.foreign_server import FOLDER, install, missing
from tests.unit.runtime.status_server_parts import (
    PASSWORD,
    Box,
    Pairs,
    output,
    status,
)
from thermaxis.compensation import RequestKind
from thermaxis.runtime import StatusServer, SystemClock

pytestmark = [pytest.mark.system, pytest.mark.real_time]
LONGEST_S = 60.0


@pytest.fixture(scope="module", autouse=True)
def _node_opcua() -> None:
    """Fail where there is no node-opcua: a skipped proof proves nothing."""
    reason = missing(("node", "npm"))
    if reason:
        pytest.fail(reason, pytrace=False)
    install()


async def told_by_the_client(server: StatusServer, user: str, home: Path) -> dict[str, Any]:
    """Run the client beside a loop of a tenth of a second, and return what it found."""
    program = await asyncio.create_subprocess_exec(
        *("node", str(FOLDER / "status_client.js"), server.url, user),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        env={"PATH": os.environ["PATH"], "HOME": str(home), "STATUS_PASSWORD": PASSWORD},
    )
    ending = asyncio.create_task(program.communicate())
    try:
        number, last_s = 0, time.monotonic() + LONGEST_S
        while not ending.done() and time.monotonic() < last_s:
            number += 1
            server.publish(
                status(number=number, cycle_s=0.1, output=output(correction_um=(0.1 * number,)))
            )
            await asyncio.sleep(0.1)
    finally:
        if program.returncode is None and not ending.done():
            program.kill()
    said, wrong = await ending
    assert program.returncode == 0, wrong.decode()
    line = next(line for line in said.decode().splitlines() if line.startswith('{"notified'))
    found: dict[str, Any] = json.loads(line)
    return found


@pytest.mark.parametrize("user", ["operator", ""])
def test_a_client_written_by_others_reads_watches_and_asks(tmp_path: Path, user: str) -> None:
    box = Box()

    async def scene() -> dict[str, Any]:
        settings = Pairs(tmp_path).settings(anonymous="viewer")
        server = StatusServer(settings, box, SystemClock())
        await server.open()
        try:
            return await told_by_the_client(server, user, tmp_path)
        finally:
            await server.close()

    found = asyncio.run(scene())
    assert {"Status", "Outputs", "Inputs", "Alarms", "Requests"} <= set(found["folders"])
    assert found["state"] == ["Active", "Good"]
    assert found["parts"] == ["spindle", "column"]
    assert found["running"] == 0
    assert found["arguments"] == ["output", "value_um", "duration_s"]
    assert found["notified"] == sorted(set(found["notified"]))
    if user:
        held = ["Good", True, box.outcome.code, json.dumps(dict(box.outcome.values))]
        assert found["calls"].pop("WhoAmI") == ["Good", "operator", "operator"]
        answers = {name: [*one[:2], *one[3:]] for name, one in found["calls"].items()}
        assert answers == {"Enable": held, "Trim": held}
        assert all(one[2] for one in found["calls"].values())
        assert [(r.kind, r.who) for r in box.requests] == [
            (RequestKind.ENABLE, "operator"),
            (RequestKind.TRIM, "operator"),
        ]
    else:
        assert found["calls"]["WhoAmI"] == ["Good", "", "viewer"]
        assert found["calls"]["Enable"] == ["BadUserAccessDenied"]
        assert box.requests == []
