"""The tables ``[connection.NAME]``: secrets stay secret, and every mistake has its words."""

import json
from pathlib import Path

import pytest

from tests.refusals import refused
from thermaxis.codes import Message
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings import read_toml
from thermaxis.runtime import ConnectionSettings, read_record

OPEN = {"url": "opc.tcp://127.0.0.1:4840", "security": "none"}
CLOSED = OPEN | {
    "security": "Basic256Sha256",
    "certificate": "own.der",
    "private_key": "own.pem",
    "server_certificate": "server.der",
}
SECRET = "correct horse"  # noqa: S105 - a test's own


def opened(table: object, folder: Path) -> ConnectionSettings:
    """Return the connection of a recording with this table."""
    path = folder / "record.toml"
    channel = '\n[channel.T_C]\nnode = "i=85"\nunit = "degC"\n'
    text = f"[connection]\ncontrol = {as_toml(table)}\n{channel}"
    path.write_text(text, encoding="utf-8")
    return read_record(path).connections["control"]


def as_toml(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {as_toml(one)}" for key, one in value.items()) + "}"
    return json.dumps(value)


def refusal(table: object, folder: Path) -> ConfigurationError:
    with pytest.raises(ConfigurationError) as caught:
        opened(table, folder)
    return caught.value


@pytest.fixture
def pki(tmp_path: Path) -> Path:
    for name in ("own.der", "own.pem", "server.der", "password"):
        (tmp_path / name).write_text(f"{SECRET}\nnot this\n")
        (tmp_path / name).chmod(0o600)
    return tmp_path


def test_an_open_connection_needs_an_address_and_the_word_none(tmp_path: Path) -> None:
    settings = opened(OPEN, tmp_path)
    assert (settings.name, settings.url, settings.security) == ("control", OPEN["url"], "none")
    assert (settings.certificate, settings.timeout_s, settings.retry_s) == (None, 1.0, 0.5)


def test_files_count_from_the_folder_of_the_configuration(pki: Path) -> None:
    table = CLOSED | {"user": "u", "password_file": "password"}
    settings = opened(table, pki)
    assert settings.certificate == pki / "own.der"
    assert settings.private_key == pki / "own.pem"
    assert settings.server_certificate == pki / "server.der"
    assert settings.password.reveal() == SECRET
    assert SECRET not in repr(settings)


def test_a_password_may_come_from_the_environment(
    pki: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = CLOSED | {"user": "u", "password_environment": "OPC_PASSWORD"}
    error = refusal(table, pki)
    assert (error.code, error.values) == ("variable_not_set", {"name": "OPC_PASSWORD"})
    monkeypatch.setenv("OPC_PASSWORD", SECRET)
    assert opened(table, pki).password.reveal() == SECRET


WRONG: tuple[tuple[dict[str, object], str, str], ...] = (
    ({"security": "Basic256"}, "value_unknown", "security"),
    ({"securty": "none"}, "unknown_key_near", "securty"),
    ({"url": "http://h:1"}, "no_opcua_address", ""),
    ({"url": "opc.tcp://:1"}, "no_opcua_address", ""),
    ({"url": "opc.tcp://h:99999"}, "no_opcua_address", ""),
    ({"url": f"opc.tcp://u:{SECRET}@h:1"}, "user_in_address", ""),
    ({"password": SECRET}, "secret_in_file", "password"),
    ({"user": "u", "password_file": "password"}, "user_unencrypted", ""),
    ({"user": "u"}, "user_needs_password", "user"),
    ({"password_file": "password"}, "password_without_user", ""),
    (
        {"user": "u", "password_file": "p", "password_environment": "P"},
        "stated_twice",
        "password_environment",
    ),
    ({"certificate": "own.der"}, "certificate_unused", "certificate"),
    ({"security": "Basic256Sha256"}, "certificate_missing", ""),
    ({"timeout_s": 0}, "below_bound", "timeout_s"),
    ({"timeout_s": 61}, "above_bound", "timeout_s"),
    ({"retry_s": "1"}, "no_number", "retry_s"),
    ({"url": 3}, "not_a_text", "url"),
)


def test_a_mistake_is_said_in_words_and_no_secret_with_it(pki: Path) -> None:
    for change, code, key in WRONG:
        error = refusal(OPEN | change, pki)
        assert (error.code, error.place.key) == (code, f"connection.control.{key}".rstrip("."))
        assert SECRET not in str(error)


def test_a_missing_key_is_said_after_the_one_that_is_misspelt(tmp_path: Path) -> None:
    error = refusal({"url": OPEN["url"], "securty": "none"}, tmp_path)
    problems = error.values["problems"]
    codes = [one.code for one in problems if isinstance(one, Message)]
    assert codes == ["error-unknown_key_near", "error-key_needed"]
    assert "securty" in str(error)
    assert "security" in str(error)


def test_what_is_no_toml_is_said_and_a_byte_order_mark_is_no_mistake(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    with refused("file_not_found", file=path):
        read_toml(path)
    for content, code in (
        *((b"[connection\n", "not_toml"), (b"\xff\xfe\x00", "not_utf8")),
        (b"#" * 1_000_001, "file_too_large"),
    ):
        path.write_bytes(content)
        with refused(code, file=path):
            read_toml(path)
    assert refusal(3, tmp_path).code == "not_a_table"
    path.write_bytes(b"\xef\xbb\xbfa = 1\r\n")
    assert read_toml(path) == {"a": 1}
