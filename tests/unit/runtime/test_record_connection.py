"""The tables ``[connection.NAME]``: secrets stay secret, and every mistake has its words."""

from pathlib import Path

import pytest
from pydantic import BaseModel, ConfigDict, ValidationError

from thermaxis.errors import ConfigurationError
from thermaxis.runtime.config import ConnectionSection, explain, read_tables, refuse
from thermaxis.runtime.config._connection import read_secret

OPEN = {"url": "opc.tcp://127.0.0.1:4840", "security": "none"}
CLOSED = OPEN | {
    "security": "Basic256Sha256",
    "certificate": "own.der",
    "private_key": "own.pem",
    "server_certificate": "server.der",
}
SECRET = "correct horse"  # noqa: S105 - a test's own


class File(BaseModel):
    model_config = ConfigDict(extra="forbid")

    connection: dict[str, ConnectionSection] = {}
    number: int = 0


def refusal(table: dict[str, object]) -> str:
    try:
        File.model_validate({"connection": {"control": table}})
    except ValidationError as error:
        return str(refuse(explain(error, File), "record.toml"))
    raise AssertionError("it was taken")


@pytest.fixture
def pki(tmp_path: Path) -> Path:
    for name in ("own.der", "own.pem", "server.der", "password"):
        (tmp_path / name).write_text(f"{SECRET}\nnot this\n")
        (tmp_path / name).chmod(0o600)
    return tmp_path


def test_an_open_connection_needs_an_address_and_the_word_none(tmp_path: Path) -> None:
    settings = ConnectionSection.model_validate(OPEN).settings("control", tmp_path)
    assert (settings.name, settings.url, settings.security) == ("control", OPEN["url"], "none")
    assert (settings.certificate, settings.timeout_s, settings.retry_s) == (None, 1.0, 0.5)


def test_files_count_from_the_folder_of_the_configuration(pki: Path) -> None:
    table = CLOSED | {"user": "u", "password_file": "password"}
    settings = ConnectionSection.model_validate(table).settings("control", pki)
    assert settings.certificate == pki / "own.der"
    assert settings.private_key == pki / "own.pem"
    assert settings.server_certificate == pki / "server.der"
    assert settings.password.reveal() == SECRET
    assert SECRET not in repr(settings)


def test_a_password_may_come_from_the_environment(
    pki: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    table = CLOSED | {"user": "u", "password_environment": "OPC_PASSWORD"}
    section = ConnectionSection.model_validate(table)
    with pytest.raises(ConfigurationError, match="OPC_PASSWORD is not set"):
        section.settings("control", pki)
    monkeypatch.setenv("OPC_PASSWORD", SECRET)
    assert section.settings("control", pki).password.reveal() == SECRET


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"security": "Basic256"}, "'Basic256Sha256'"),
        ({"securty": "none"}, "Did you mean security"),
        ({"url": "http://h:1"}, "no address of an OPC UA server"),
        ({"url": "opc.tcp://:1"}, "no address of an OPC UA server"),
        ({"url": "opc.tcp://h:99999"}, "no address of an OPC UA server"),
        ({"url": f"opc.tcp://u:{SECRET}@h:1"}, "contains a user or a password"),
        ({"password": SECRET}, "the password itself stands in the file"),
        ({"user": "u", "password_file": "p"}, "never sent over a connection that is not encrypted"),
        ({"user": "u"}, "a user and no password"),
        ({"password_file": "p"}, "a password and no user"),
        ({"user": "u", "password_file": "p", "password_environment": "P"}, "stated twice"),
        ({"certificate": "own.der"}, "not encrypted, and a certificate is stated"),
        ({"security": "Basic256Sha256"}, "certificate is missing"),
        ({"timeout_s": 0}, "less than 0.05"),
        ({"timeout_s": 61}, "more than 60"),
        ({"retry_s": "1"}, "not a number"),
        ({"url": 3}, "not a text"),
    ],
)
def test_a_mistake_is_said_in_words_and_no_secret_with_it(
    change: dict[str, object], words: str
) -> None:
    said = refusal(OPEN | change)
    assert words in said
    assert "[connection.control]" in said
    assert SECRET not in said


def test_a_missing_key_is_said_after_the_one_that_is_misspelt() -> None:
    said = refusal({"url": OPEN["url"], "securty": "none"})
    assert said.index("'securty' is not a key") < said.index("security is missing")


def test_a_secret_that_others_can_read_is_refused(pki: Path) -> None:
    section = ConnectionSection.model_validate(CLOSED | {"user": "u", "password_file": "password"})
    for name in ("password", "own.pem"):
        for mode in (0o640, 0o604, 0o620):
            (pki / name).chmod(mode)
            with pytest.raises(ConfigurationError, match="by others than its owner"):
                section.settings("control", pki)
        (pki / name).chmod(0o600)


@pytest.mark.parametrize("content", [b"", b"\nsecond\n", b"\xff\xfe", b"a\x00b", b"x" * 5000])
def test_a_file_without_a_secret_is_refused_and_not_shown(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "password").write_bytes(content)
    (tmp_path / "password").chmod(0o600)
    with pytest.raises(ConfigurationError, match="does not hold a secret"):
        read_secret("password", "", folder=tmp_path, where="[connection.control]")


@pytest.mark.parametrize("missing", ["own.der", "own.pem", "server.der"])
def test_a_missing_file_is_named(pki: Path, missing: str) -> None:
    (pki / missing).unlink()
    with pytest.raises(ConfigurationError, match=missing):
        ConnectionSection.model_validate(CLOSED).settings("control", pki)


def test_what_is_no_table_or_no_toml_is_said(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_text("[connection\n")
    with pytest.raises(ConfigurationError, match=r"this is not TOML: .*line 1"):
        read_tables(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigurationError, match="not UTF-8"):
        read_tables(path)
    with pytest.raises(ConfigurationError, match="cannot be read"):
        read_tables(tmp_path / "none.toml")
    path.write_bytes(b"#" * 1_000_001)
    with pytest.raises(ConfigurationError, match="longer than"):
        read_tables(path)
    assert "not a table" in refusal(3)


def test_a_byte_order_mark_is_no_mistake(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_bytes(b"\xef\xbb\xbfa = 1\r\n")
    assert read_tables(path) == {"a": 1}
