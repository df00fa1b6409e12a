"""A loop's status server with users, which several scenes of a file use one after the other."""

import asyncio
from collections.abc import Iterator

import pytest

from tests.unit.runtime.status_server_parts import Pairs
from tests.unit.screen.person_parts import Stage


@pytest.fixture(scope="module")
def runner() -> Iterator[asyncio.Runner]:
    with asyncio.Runner() as runner:
        yield runner


@pytest.fixture(scope="module")
def loops_stage(
    runner: asyncio.Runner, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Stage]:
    one = Stage(Pairs(tmp_path_factory.mktemp("persons")))
    runner.run(one.open())
    yield one
    runner.run(one.close())
