"""The status server, as a client sees it: values with quality and time, methods by role."""

from datetime import timedelta

import pytest
from asyncua import ua

from tests.unit.runtime.status_server_parts import (
    NOW,
    Box,
    Pairs,
    call,
    client,
    read,
    run,
    served,
    status,
    viewers,
)
from thermaxis.compensation import Request, RequestKind


def test_a_client_reads_the_values_of_the_last_cycle_with_its_time() -> None:
    async def scene() -> None:
        async with served(viewers()) as server, client(server) as one:
            server.publish(status())
            server.publish(status(number=28_801, utc=NOW + timedelta(seconds=1)))
            state = await read(one, "Status/State")
            beat = await read(one, "Status/Heartbeat")
            assert state.Value.Value == "Active"
            assert state.StatusCode.is_good()
            assert state.SourceTimestamp == NOW + timedelta(seconds=1)
            assert (beat.Value.Value, beat.Value.VariantType) == (28_801, ua.VariantType.UInt32)

    run(scene)


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> Pairs:
    return Pairs(tmp_path_factory.mktemp("pairs"))


def test_an_operator_asks_and_the_name_goes_with_the_request(pairs: Pairs) -> None:
    async def scene() -> None:
        box = Box()
        async with served(pairs.settings(), box) as server:
            server.publish(status())
            async with pairs.user(server, "operator") as one:
                assert await call(one, "Enable") == [True, "as you wish"]
                assert await call(one, "WhoAmI") == ["operator", "operator"]
        assert box.requests == [Request(RequestKind.ENABLE, "operator")]

    run(scene)
