"""OPC UA servers that all tests of a worker share: they are put back before each of them."""

import asyncio
import inspect
from collections.abc import Iterator

import pytest
from asyncua import ua

from tests.opcua_server import KINDS, Machine, start_machine
from thermaxis.runtime import run_in_virtual_time

FLOATS = {**KINDS, "Offset": (0.0, ua.VariantType.Float)}


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Run a test that is a coroutine: in virtual time, or in the event loop of the servers."""
    if not inspect.iscoroutinefunction(pyfuncitem.obj):
        return None
    names = inspect.signature(pyfuncitem.obj).parameters
    test = pyfuncitem.obj(**{name: pyfuncitem.funcargs[name] for name in names})
    if getattr(pyfuncitem.module, "VIRTUAL_TIME", False):
        run_in_virtual_time(test)
    else:
        pyfuncitem._request.getfixturevalue("runner").run(test)
    return True


@pytest.fixture(scope="session")
def runner() -> Iterator[asyncio.Runner]:
    """Return the event loop in which the servers live."""
    with asyncio.Runner() as runner:
        yield runner


@pytest.fixture(scope="session")
def started(runner: asyncio.Runner) -> Iterator[Machine]:
    machine = runner.run(start_machine())
    yield machine
    runner.run(machine.stop())


@pytest.fixture
def machine(started: Machine) -> Machine:
    """Return a machine as it was at its start."""
    started.reset()
    return started


@pytest.fixture
def other(runner: asyncio.Runner) -> Iterator[Machine]:
    """Return the same machine after a change of its software: other indices, another type."""
    machine = runner.run(start_machine(other_namespaces=3, kinds=FLOATS))
    yield machine
    runner.run(machine.stop())
