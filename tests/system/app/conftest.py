"""One app for every test of it."""

from collections.abc import Iterator

import pytest

from tests.system.app.stand import App


@pytest.fixture(scope="package")
def app(tmp_path_factory: pytest.TempPathFactory) -> Iterator[App]:
    with App(tmp_path_factory.mktemp("app")) as made:
        yield made
