"""Two programs at one machine: the token that one of them renews keeps the other from writing."""

import asyncio
from collections.abc import Sequence
from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

import pytest
from asyncua import ua
from asyncua.ua.status_codes import StatusCodes

from thermaxis.cli.machine.commission import wait_for_machine
from thermaxis.codes import Message
from thermaxis.errors import DataError
from thermaxis.runtime import AWAY, OpcUaSession
from thermaxis.runtime.sinks import OpcUaOutput, OpcUaSink, Token

if TYPE_CHECKING:
    from thermaxis.cli.machine._machine_parts import MachineParts
    from thermaxis.runtime import MachineConfiguration

VIRTUAL_TIME = True
OFFSET, TOKEN = "ns=2;s=Offset", "ns=2;s=Token"
WAIT_S = 0.5
TOKEN_S = 5.0
"""As docs/limits-and-hazards.md says. [s]"""


class Session:
    """A connection to nodes in memory."""

    failure: Message | None = None
    connected, generation = True, 1

    def __init__(self, nodes: dict[str, float]) -> None:
        self.nodes = nodes
        self.reads_token, self.late_s = True, 0.0

    async def types(self, nodes: Sequence[str], _: float) -> dict[str, str]:
        return dict.fromkeys(nodes, "Double")

    async def read(self, nodes: Sequence[str], _: float) -> list[ua.DataValue]:
        bad = ua.DataValue(ua.Variant(7.0), ua.StatusCode(ua.UInt32(StatusCodes.BadNoData)))
        values = [ua.DataValue(ua.Variant(self.nodes[node])) for node in nodes]
        return values if self.reads_token else [*values[:-1], bad]

    async def write(self, values: Sequence[tuple[str, float]], _: float) -> list[str]:
        if self.late_s:
            asyncio.get_running_loop().call_later(self.late_s, self.nodes.update, dict(values))
        else:
            self.nodes.update(values)
        return ["Good"] * len(values)


def program(nodes: dict[str, float]) -> OpcUaSink:
    outputs = {"Z_um": OpcUaOutput(node=OFFSET, unit="um", sign=AWAY)}
    return OpcUaSink(cast("OpcUaSession", Session(nodes)), outputs, None, Token(TOKEN, 0.1, 10.0))


async def cycle(sink: OpcUaSink, um: float) -> bool:
    """Look and write, as the loop does; return whether it was written."""
    await sink.found(WAIT_S)
    await sink.read_back(WAIT_S)
    return sink.connected and await sink.write({"Z_um": um}, WAIT_S)


async def turns(*sinks: OpcUaSink, seconds: float) -> list[int]:
    """Let programs run side by side; return how often each wrote."""
    wrote = [0] * len(sinks)
    for _ in range(round(seconds / 0.1)):
        for k, sink in enumerate(sinks):
            wrote[k] += await cycle(sink, float(k))
        await asyncio.sleep(0.1)
    return wrote


@pytest.fixture
def nodes() -> dict[str, float]:
    return {OFFSET: 0.0, TOKEN: 0.0}


async def test_nothing_is_written_before_a_token_that_stands_there_is_old(
    nodes: dict[str, float],
) -> None:
    sink = program(nodes)
    assert await turns(sink, seconds=TOKEN_S - 0.2) == [0]
    assert sink.failure == Message("error-token_not_old_yet")
    assert await turns(sink, seconds=2.0) >= [17]
    assert sink.failure is None
    nodes[TOKEN] = 0.0  # the machine starts anew
    assert await turns(sink, seconds=1.0) == [0]
    assert sink.failure == Message("error-token_not_old_yet")


async def test_the_second_of_two_copies_writes_when_the_first_has_ended(
    nodes: dict[str, float],
) -> None:
    first, second = program(nodes), program(nodes)
    await turns(first, seconds=TOKEN_S + 1.0)
    assert await turns(first, second, seconds=60.0) == [600, 0]
    assert second.failure == Message("error-another_program_writes")
    assert await turns(second, seconds=TOKEN_S - 0.2) == [0]
    assert await turns(second, seconds=2.0) >= [17]
    assert await turns(first, second, seconds=60.0) == [0, 600], "who comes back waits"


async def test_of_two_that_begin_at_once_one_writes_at_most_once(nodes: dict[str, float]) -> None:
    first, second = program(nodes), program(nodes)
    wrote = await turns(first, second, seconds=60.0)
    assert min(wrote) <= 1
    assert max(wrote) > 500


async def test_a_token_that_cannot_be_read_for_long_is_nobody_s(nodes: dict[str, float]) -> None:
    sink, unread = program(nodes), Message("error-token_unread")
    session = cast("Session", sink.session)
    await turns(sink, seconds=TOKEN_S + 1.0)
    session.reads_token = False
    assert await turns(sink, seconds=TOKEN_S - 0.2) >= [47]
    session.reads_token = True
    assert await turns(sink, seconds=1.0) == [10]
    session.reads_token = False
    assert await turns(sink, seconds=20.0) == pytest.approx([50], abs=2)
    assert sink.failure == unread
    session.reads_token = True
    assert await turns(sink, seconds=1.0) >= [9]
    other = program(nodes)
    cast("Session", other.session).reads_token = False
    assert await turns(other, seconds=20.0) == [0]
    assert other.failure == unread


@pytest.mark.parametrize("late_s", [0.5, 1.5, 8.0])
async def test_the_own_token_is_known_on_a_machine_that_shows_it_late(
    nodes: dict[str, float], late_s: float
) -> None:
    sink = program(nodes)
    cast("Session", sink.session).late_s = late_s
    await turns(sink, seconds=TOKEN_S + 1.0)
    assert await turns(sink, seconds=30.0) == [300]


async def test_commissioning_says_that_another_program_writes(nodes: dict[str, float]) -> None:
    async def read(_: float) -> None: ...

    first, second = program(nodes), program(nodes)
    others = asyncio.ensure_future(turns(first, seconds=60.0))
    await asyncio.sleep(TOKEN_S + 1.0)
    ports = SimpleNamespace(source=SimpleNamespace(read=read))
    parts = SimpleNamespace(ports=ports, sink=second, sessions={"": second.session})
    with pytest.raises(DataError) as caught:
        await wait_for_machine(
            cast("MachineParts", parts), cast("MachineConfiguration", SimpleNamespace(path="m"))
        )
    assert caught.value.values["cause"] == (Message("error-another_program_writes"),)
    others.cancel()
