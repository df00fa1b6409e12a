"""Where ``thermaxis history`` takes a database's password from, and where not."""

import argparse

import pytest

from thermaxis.cli.machine import history
from thermaxis.errors import ConfigurationError


def parsed(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    history.add_arguments(parser)
    return parser.parse_args(words)


@pytest.mark.parametrize(
    "url",
    [
        "postgresql://a:hunter2@127.0.0.1/x",
        "postgresql+psycopg://a:hunter2@plant.example/x?sslmode=verify-full",
        "postgresql://a@127.0.0.1/x?password=hunter2",
        "postgresql://a:@127.0.0.1/x",
    ],
)
def test_a_password_in_an_address_is_refused_and_not_repeated(url):
    with pytest.raises(ConfigurationError, match="contains a password") as refused:
        history.run(parsed("check", url))
    assert "hunter2" not in str(refused.value)
    assert "--password-file" in str(refused.value)


def test_the_password_of_a_url_comes_from_a_private_file(tmp_path):
    secret = tmp_path / "secret"
    secret.write_text("hunter2\n")
    arguments = parsed("check", "postgresql://a@127.0.0.1/x", "--password-file", str(secret))
    secret.chmod(0o644)
    with pytest.raises(ConfigurationError, match="others than its owner"):
        history.run(arguments)
    secret.chmod(0o600)
    url = arguments.history
    assert history._address_of(arguments) == (url, "hunter2")


@pytest.mark.parametrize("name", ["h.db", "machine.toml"])
def test_a_file_takes_no_password(tmp_path, name):
    with pytest.raises(ConfigurationError, match="belongs to the URL"):
        history.run(parsed("check", str(tmp_path / name), "--password-file", "secret"))


def test_a_connection_to_another_computer_without_encryption_is_refused():
    with pytest.raises(ConfigurationError, match="not encrypted for certain"):
        history.run(parsed("check", "postgresql://a@plant.example/x"))
