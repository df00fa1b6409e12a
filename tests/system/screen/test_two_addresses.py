"""Who guesses from one address keeps nobody out at another, through the screen and the loop."""

import http.client
import json
import sys
import urllib.parse

import pytest

from tests.system.screen.stand import Rig
from thermaxis.runtime import FAILURES_BY_ADDRESS

GUESSER, SHOP = "127.0.0.2", "127.0.0.1"

pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="elsewhere 127.0.0.2 is no address of this computer by itself"
)


def log_in(stand: Rig, address: str, name: str, password: str) -> tuple[int, str]:
    """Log in from an address; return the status and which refusal it is."""
    port = urllib.parse.urlsplit(stand.address).port
    line = http.client.HTTPConnection("127.0.0.1", port, 30.0, source_address=(address, 0))
    try:
        headers = {"Origin": stand.address, "Content-Type": "application/json"}
        body = json.dumps({"name": name, "password": password})
        line.request("POST", "/login", body, headers)
        answer = line.getresponse()
        return answer.status, str(json.loads(answer.read()).get("error", ""))
    finally:
        line.close()


def test_thirty_wrong_log_ins_from_one_address_keep_out_that_address_alone(
    stand: Rig,
) -> None:
    wrong = [
        log_in(stand, GUESSER, f"nobody{i}", "wrong" if i % 2 else "\ud800")
        for i in range(3 * FAILURES_BY_ADDRESS)
    ]
    assert wrong[:FAILURES_BY_ADDRESS] == [(401, "login-refused")] * FAILURES_BY_ADDRESS
    assert set(wrong[FAILURES_BY_ADDRESS:]) == {(429, "login-too_many_from_here")}
    right = stand.passwords["operator"]
    assert log_in(stand, GUESSER, "operator", right) == (429, "login-too_many_from_here")
    assert log_in(stand, SHOP, "operator", right) == (200, "")
    assert log_in(stand, SHOP, "operator", "wrong") == (401, "login-refused")
