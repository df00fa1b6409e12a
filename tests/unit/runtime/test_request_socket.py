"""Requests at the computer itself: who reaches the socket, what may be asked, what is answered."""

import asyncio
import getpass
import socket
import stat
from pathlib import Path

import pytest

from tests.refusals import refused
from thermaxis.compensation import AnswerCode, Request, RequestKind
from thermaxis.messages import sentence_of
from thermaxis.runtime import RequestOutcome
from thermaxis.runtime.config import state_file_of
from thermaxis.runtime.host import LocalAnswer, RequestSocket, ask_loop

HELD = RequestOutcome(accepted=True, code=AnswerCode.HELD, values={"longest_s": 3600.0})


class Box:
    """A loop that notes what it is asked for, and answers all alike."""

    def __init__(self) -> None:
        self.asked: list[Request] = []

    async def submit(self, request: Request) -> RequestOutcome:
        self.asked.append(request)
        return HELD


async def answers(
    state: Path, box: Box, *kinds: RequestKind, may_start: bool = False
) -> list[LocalAnswer]:
    """Ask one after the other, as another program does."""
    here = RequestSocket(state, box, may_start=may_start)
    await here.open()
    path = state.with_name(f"{state.name}.socket")
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    found = [await asyncio.to_thread(ask_loop, state, kind) for kind in kinds]
    await here.close()
    assert not path.exists()
    return found


def test_a_request_reaches_the_loop_with_the_users_name_and_its_answer_comes_back(
    tmp_path: Path,
) -> None:
    box = Box()
    deep = tmp_path / ("a long name " * 10) / "b"  # longer than a socket's address
    deep.mkdir(parents=True)
    kinds = RequestKind.ACKNOWLEDGE, RequestKind.DISABLE, RequestKind.HOLD
    for accepted, message in asyncio.run(answers(deep / "lathe.state.json", box, *kinds)):
        assert accepted
        assert message == HELD.message
        assert "1\xa0h" in sentence_of(message)
    assert tuple(one.kind for one in box.asked) == kinds
    assert {one.who for one in box.asked} == {f"{getpass.getuser()} at the computer"}


def test_a_touch_reaches_the_loop_with_output_value_and_age(tmp_path: Path) -> None:
    box = Box()
    state = tmp_path / "lathe.state.json"

    async def life() -> LocalAnswer:
        here = RequestSocket(state, box, may_start=False)
        await here.open()
        touch = ("Z_um", -3.5, 60.0)
        found = await asyncio.to_thread(ask_loop, state, RequestKind.TOUCH, touch)
        await here.close()
        return found

    assert asyncio.run(life()).accepted
    (asked,) = box.asked
    assert (asked.output, asked.value, asked.duration_s) == ("Z_um", -3.5, 60.0)


def test_a_model_reaches_the_loop_with_its_name(tmp_path: Path) -> None:
    box = Box()
    state = tmp_path / "lathe.state.json"

    async def life() -> LocalAnswer:
        here = RequestSocket(state, box, may_start=True)
        await here.open()
        found = await asyncio.to_thread(ask_loop, state, RequestKind.MODEL, "a model.json")
        await here.close()
        return found

    assert asyncio.run(life()).accepted
    (asked,) = box.asked
    assert (asked.kind, asked.text, asked.value) == (RequestKind.MODEL, "a model.json", None)


@pytest.mark.parametrize("may_start", [False, True])
def test_nothing_is_started_at_the_computer_unless_the_configuration_allows_it(
    tmp_path: Path, may_start: bool
) -> None:
    box = Box()
    kinds = RequestKind.ENABLE, RequestKind.RESUME, RequestKind.TRIM, RequestKind.MODEL
    found = asyncio.run(answers(tmp_path / "a.json", box, *kinds, may_start=may_start))
    assert [one.accepted for one in found] == [may_start, may_start, False, may_start]
    assert {one.message.code for one in found if not one.accepted} == {"answer-not_at_computer"}
    assert len(box.asked) == 3 * may_start


def test_what_a_killed_loop_has_left_is_replaced_and_cannot_be_asked(tmp_path: Path) -> None:
    state = tmp_path / "a.json"
    with refused("loop_not_asked", cause="No such file or directory"):
        ask_loop(state, RequestKind.HOLD)
    left = socket.socket(socket.AF_UNIX)
    left.bind(str(state.with_name("a.json.socket")))
    left.close()
    with refused("loop_not_asked", cause="Connection refused"):
        ask_loop(state, RequestKind.HOLD)
    assert asyncio.run(answers(state, Box(), RequestKind.HOLD))[0].accepted


def test_a_loop_that_ends_before_it_answers_is_told(tmp_path: Path) -> None:
    class Ending:
        async def submit(self, request: Request) -> RequestOutcome:
            raise OSError(request.kind)

    failures: list[str] = []

    async def ended() -> None:
        here = RequestSocket(tmp_path / "a.json", Ending(), may_start=False)
        await here.open()
        await asyncio.to_thread(ask)
        await here.close()

    def ask() -> None:
        with refused("loop_not_asked") as caught:
            ask_loop(tmp_path / "a.json", RequestKind.HOLD)
        failures.append(caught.value.code)

    asyncio.run(ended())
    assert failures == ["loop_not_asked"]


def test_the_state_file_is_found_in_a_configuration_whose_secrets_are_not(tmp_path: Path) -> None:
    path = tmp_path / "lathe.toml"
    path.write_text("[connection.a]\npassword_environment = 'NOT_SET'\n", encoding="utf-8")
    assert state_file_of(path) == tmp_path / "lathe.state.json"
    path.write_text("[machine]\nstate_file = 'here/s.json'\n", encoding="utf-8")
    assert state_file_of(path) == tmp_path / "here" / "s.json"
