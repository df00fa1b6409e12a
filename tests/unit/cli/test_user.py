"""``thermaxis user``: users are added, changed, removed and listed, and no password is shown."""

import getpass
import io
import stat
import sys

import pytest
from argon2 import PasswordHasher

from tests.unit.cli.refusals import code_of, refusal
from thermaxis.cli import execute
from thermaxis.runtime import Role, read_users

SECRET = "correct horse battery"  # noqa: S105 - of users that exist in tests only


def run(*words: object) -> int:
    return execute(["user", *map(str, words)])


@pytest.fixture
def piped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(f"{SECRET}\nsecond line\n"))


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def typed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What a person types; the list is emptied from its front."""
    answers: list[str] = []
    monkeypatch.setattr(sys, "stdin", Terminal())
    monkeypatch.setattr(getpass, "getpass", lambda _: answers.pop(0))
    return answers


@pytest.mark.usefixtures("piped")
def test_a_user_is_added_with_a_password_from_a_pipe(tmp_path, capsys):
    path = tmp_path / "users.toml"
    assert run("add", path, "novak", "--role", "operator", "--stdin") == 0
    (user,) = read_users(path)
    assert (user.name, user.role) == ("novak", Role.OPERATOR)
    assert PasswordHasher().verify(user.hash, SECRET)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    said = capsys.readouterr()
    assert said.out == f"novak (operator) added to {path}.\n"
    assert SECRET not in said.out + said.err + path.read_text(encoding="utf-8")


def test_a_password_is_asked_for_twice(tmp_path, typed):
    path = tmp_path / "users.toml"
    typed += [SECRET, SECRET]
    assert run("add", path, "novak", "--role", "viewer") == 0
    assert typed == []
    typed += [SECRET, SECRET + "!"]
    assert code_of("user", "add", path, "dvorak", "--role", "viewer") == "passwords_differ"
    assert [user.name for user in read_users(path)] == ["novak"]


def test_a_user_keeps_the_place_when_role_and_password_change(tmp_path, typed, capsys):
    path = tmp_path / "users.toml"
    for name in ("novak", "dvorak"):
        typed += [SECRET, SECRET]
        run("add", path, name, "--role", "viewer")
    typed += ["another password", "another password"]
    capsys.readouterr()
    assert run("add", path, "novak", "--role", "engineer") == 0
    assert capsys.readouterr().out == f"novak (engineer) changed in {path}.\n"
    novak, dvorak = read_users(path)
    assert (novak.name, novak.role, dvorak.name) == ("novak", Role.ENGINEER, "dvorak")
    assert PasswordHasher().verify(novak.hash, "another password")
    assert run("list", path) == 0
    assert capsys.readouterr().out == "novak   engineer\ndvorak  viewer\n"
    assert run("remove", path, "novak") == 0
    assert [user.name for user in read_users(path)] == ["dvorak"]
    assert run("remove", path, "dvorak") == 0
    capsys.readouterr()
    assert run("list", path) == 0
    assert capsys.readouterr().out == "There are no users.\n"


def test_somebody_who_is_not_there_cannot_be_removed(tmp_path, typed):
    path = tmp_path / "users.toml"
    typed += [SECRET, SECRET]
    run("add", path, "novak", "--role", "viewer")
    error = refusal("user", "remove", path, "dvorak")
    assert (error.code, error.values["name"]) == ("unknown_name", "dvorak")


@pytest.mark.usefixtures("piped")
def test_a_pipe_is_never_taken_for_a_person(tmp_path):
    asked = ("user", "add", tmp_path / "users.toml", "novak", "--role", "viewer")
    assert code_of(*asked) == "no_terminal"


def test_a_short_password_is_refused_and_no_file_appears(tmp_path, typed):
    typed += ["1234567", "1234567"]
    refusal("user", "add", tmp_path / "users.toml", "novak", "--role", "viewer")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("piped")
def test_a_file_that_others_may_read_is_not_added_to(tmp_path):
    path = tmp_path / "users.toml"
    path.write_text("", encoding="utf-8")
    path.chmod(0o644)
    refusal("user", "add", path, "novak", "--role", "viewer", "--stdin")
    assert path.read_text(encoding="utf-8") == ""


def test_an_operator_gets_a_pin_which_another_password_ends_and_nobody_else_has_one(
    tmp_path, typed, capsys
):
    path = tmp_path / "users.toml"
    typed += [SECRET] * 4
    assert run("add", path, "novak", "--role", "operator") == 0
    assert run("add", path, "dvorak", "--role", "engineer") == 0
    typed += ["481516", "481516"]
    assert run("pin", path, "novak") == 0
    novak, dvorak = read_users(path)
    assert PasswordHasher().verify(novak.pin, "481516")
    assert PasswordHasher().verify(novak.hash, SECRET)
    assert dvorak.pin == ""
    assert "481516" not in capsys.readouterr().out
    assert code_of("user", "pin", path, "dvorak") == "pin_of_operators"
    assert code_of("user", "pin", path, "nobody") == "unknown_name"
    typed += ["12345", "12345"]
    assert code_of("user", "pin", path, "novak") == "no_pin"
    assert read_users(path)[0] == novak
    typed += [SECRET, SECRET]
    assert run("add", path, "novak", "--role", "operator") == 0
    assert read_users(path)[0].pin == ""
