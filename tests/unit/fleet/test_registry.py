"""A registry in SQLite; PostgreSQL holds the same laws in the tests of the system."""

from pathlib import Path

import pytest

from tests.unit.fleet.registry_laws import Made, RegistryLaws
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.fleet import Registry


@pytest.fixture
def url(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'registry.db'}"


@pytest.fixture
def password() -> str:
    return ""


@pytest.fixture
def made(url: str) -> Made:
    Registry.make(url, "lake").close()
    return lambda: Registry(url)


class TestSqlite(RegistryLaws):
    """The laws, in a file."""


def test_a_file_that_is_not_there_is_not_made_by_who_only_opens_it(tmp_path):
    with pytest.raises(ConfigurationError, match="no such file"):
        Registry(f"sqlite:///{tmp_path / 'nothing.db'}")
    with pytest.raises(ConfigurationError, match="no such folder"):
        Registry.make(f"sqlite:///{tmp_path / 'no' / 'registry.db'}", "lake")
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_moved_away_while_it_is_open_is_not_made_anew(url, made, tmp_path):
    with made() as registry:
        (tmp_path / "registry.db").rename(tmp_path / "moved.db")
        with pytest.raises(ConfigurationError, match="no such file"):
            registry.machines()
        assert [path.name for path in tmp_path.iterdir()] == ["moved.db"]


def test_a_file_that_is_no_database_is_said(tmp_path):
    (tmp_path / "x.db").write_bytes(b"no database at all" * 100)
    with pytest.raises(DataError, match="cannot be read or written"):
        Registry(f"sqlite:///{tmp_path / 'x.db'}")
