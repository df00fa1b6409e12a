"""Users: files that only their owner reads, hashes, roles, and guesses that are slowed down."""

import asyncio
import functools
import logging
import os
import stat
import time
from pathlib import Path

import pytest
from argon2 import PasswordHasher, extract_parameters
from argon2.exceptions import VerifyMismatchError
from hypothesis import given, strategies as st

from tests.refusals import refused
from tests.unit.runtime.status_server_parts import PASSWORD, HandClock, users_file
from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.runtime import (
    FAILURES_BY_NAME,
    REFUSED_S,
    Role,
    User,
    check_name,
    hash_password,
    read_users,
    write_users,
)
from thermaxis.runtime.users import ANONYMOUS, Identity, Users, _users
from thermaxis.runtime.users._users import HASH_MEMORY_KIB, HASH_PASSES, _checked_hash

GOOD_HASH = PasswordHasher(1, 64, 1).hash("anything at all")


def file_of(folder: Path, text: str, mode: int = 0o600) -> Path:
    path = folder / "users.toml"
    path.write_text(text, encoding="utf-8")
    path.chmod(mode)
    return path


def entry(name: str = "novak", role: str = "operator", text: str = GOOD_HASH) -> str:
    return f'[[user]]\nname = "{name}"\nrole = "{role}"\nhash = "{text}"\n'


# ---- roles, names, hashes ---------------------------------------------------------------------


def test_every_role_may_do_what_the_ones_before_it_may() -> None:
    order = [Role.NONE, Role.VIEWER, Role.OPERATOR, Role.ENGINEER]
    table = [[a.at_least(b) for b in order] for a in order]
    assert table == [[i >= j for j in range(4)] for i in range(4)]


def test_a_hash_is_argon2id_of_the_stated_cost_with_a_salt_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(_users, "HASH_MEMORY_KIB", HASH_MEMORY_KIB)  # other tests have it less
    monkeypatch.setattr(_users, "HASH_PASSES", HASH_PASSES)
    one, two = hash_password("correct horse"), hash_password("correct horse")
    found = extract_parameters(one)
    assert one != two
    assert (found.type.name, found.memory_cost, found.time_cost, found.parallelism) == (
        "ID",
        HASH_MEMORY_KIB,
        HASH_PASSES,
        1,
    )
    assert PasswordHasher().verify(one, "correct horse")
    with pytest.raises(VerifyMismatchError):
        PasswordHasher().verify(one, "correct house")


def test_a_password_that_is_too_short_or_too_long_is_refused_without_showing_it() -> None:
    for password in ("", "1234567", "x" * 1025, "ř" * 513):
        with pytest.raises(ConfigurationError) as caught:
            hash_password(password)
        assert not password or password not in str(caught.value)


def test_only_a_name_that_could_forge_no_line_and_no_page_is_taken() -> None:
    for name in ("novak", "Jan Novák", "j.novak@plant-2", "A_1", "ž" * 64):
        assert check_name(name) == name
    for name in (
        *("", " novak", "novak ", "a" * 65, 'a"b', "a\nb", "a\x1b[2J", "<b>", "a/b", "a=b"),
        "\u202e",
    ):
        with refused("no_user_name") as caught:
            check_name(name)
        assert str(caught.value).isprintable()


# ---- the file ---------------------------------------------------------------------------------


def test_users_come_back_from_their_file_and_only_the_owner_can_read_it(tmp_path: Path) -> None:
    users = (User("novak", Role.OPERATOR, GOOD_HASH), User("Jan Dvořák", Role.ENGINEER, GOOD_HASH))
    path = tmp_path / "users.toml"
    old_mask = os.umask(0)
    try:
        write_users(users, path)
    finally:
        os.umask(old_mask)
    assert read_users(path) == users
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert [p.name for p in tmp_path.iterdir()] == ["users.toml"]


def test_a_file_that_cannot_be_written_leaves_the_old_one_and_nothing_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = file_of(tmp_path, entry())

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        write_users((), path)
    assert path.read_text(encoding="utf-8") == entry()
    assert [p.name for p in tmp_path.iterdir()] == ["users.toml"]


def test_a_link_stays_a_link_when_its_file_is_written(tmp_path: Path) -> None:
    folder = tmp_path / "real"
    folder.mkdir()
    path = file_of(folder, entry())
    link = tmp_path / "users.toml"
    link.symlink_to(path)
    write_users((), link)
    assert link.is_symlink()
    assert read_users(path) == ()


def test_a_file_that_others_may_read_or_write_is_refused(tmp_path: Path) -> None:
    for mode in (0o640, 0o622):
        with refused("file_open_to_others"):
            read_users(file_of(tmp_path, entry(), mode))


DAMAGED = (
    ("[[user]\n", "not_toml"),
    ("a." * 4_000 + "b = 1", "not_toml"),
    (entry() + entry(), "stated_twice"),
    (entry(role="boss"), "unknown_choice"),
    (entry(role="none"), "unknown_choice"),
    (entry(name=""), "no_user_name"),
    (entry(text="plain text"), "no_argon2id_hash"),
    (entry(text="$argon2i$v=19$m=64,t=1,p=1$c29tZXNhbHQ$aGFzaGhhc2hoYXNo"), "no_argon2id_hash"),
    (
        entry(text="$argon2id$v=19$m=4194304,t=1,p=1$c29tZXNhbHQ$aGFzaGhhc2hoYXNo"),
        "no_argon2id_hash",
    ),
    (
        entry(text="$argon2id$v=19$m=64,t=9999,p=1$c29tZXNhbHQ$aGFzaGhhc2hoYXNo"),
        "no_argon2id_hash",
    ),
    ('[[user]]\nname = "novak"\nrole = "viewer"\n', "user_keys"),
    (entry() + 'password = "secret"\n', "user_keys"),
    ('[[user]]\nname = 1\nrole = "viewer"\nhash = "x"\n', "user_keys"),
    ("[[users]]\n", "not_a_user_table"),
    ('user = "novak"\n', "not_a_user_table"),
    ("user = [1]\n", "not_a_table"),
)


def test_a_damaged_file_is_said_in_words_without_its_content(tmp_path: Path) -> None:
    for text, code in DAMAGED:
        with refused(code) as caught:
            read_users(file_of(tmp_path, text))
        error = caught.value
        assert error.place.file == str(tmp_path / "users.toml")
        assert "secret" not in str(error)
        assert "c29tZXNhbHQ" not in str(error)


@functools.cache
def unread_users() -> Users:
    users = Users(Path("unread.toml"), HandClock())
    users._read_again = lambda: None
    return users


@given(
    st.one_of(
        st.text(max_size=100),
        st.lists(
            st.sampled_from(
                [
                    "$argon2id",
                    "$v=19",
                    "$m=64",
                    ",t=1",
                    ",p=1",
                    "$c29tZXNhbHQ",
                    "$",
                    "=",
                    "x",
                    "9" * 30,
                ]
            ),
            max_size=9,
        ).map("".join),
    )
)
def test_any_text_instead_of_a_hash_is_refused_or_fits_no_password(text: str) -> None:
    try:
        _checked_hash(text, Place("here"))
    except ConfigurationError:
        return
    users = unread_users()
    users._users = {"novak": User("novak", Role.VIEWER, text)}
    assert users._checked("novak", "correct horse") is None


def test_files_that_are_not_there_or_far_too_large_are_refused(tmp_path: Path) -> None:
    with refused("file_unreadable"):
        read_users(tmp_path / "none.toml")
    with refused("file_too_long"):
        read_users(file_of(tmp_path, "#" * 1_000_001))
    with refused("too_many_users"):
        read_users(file_of(tmp_path, "[[user]]\n" * 1001))


def test_a_hash_is_in_no_text_of_a_user() -> None:
    assert GOOD_HASH not in f"{User('novak', Role.VIEWER, GOOD_HASH)!r}"


@given(st.text(max_size=80))
def test_any_name_is_either_refused_or_survives_the_file(name: str) -> None:
    try:
        check_name(name)
    except ConfigurationError:
        return
    assert name.isprintable()
    assert not set('"\\\n') & set(name)


# ---- log-ins ----------------------------------------------------------------------------------


def with_users(path: Path, clock: HandClock | None = None) -> Users:
    return Users(path, clock or HandClock())


def test_a_password_is_checked_and_the_role_is_that_of_the_file(tmp_path: Path) -> None:
    async def scene() -> None:
        users = with_users(users_file(tmp_path))
        await users.open()
        found = await users.identify("operator", PASSWORD)
        assert found is not None
        assert found.name == "operator"
        assert await users.role_now(found) is Role.OPERATOR
        assert await users.identify("operator", PASSWORD + " ") is None
        assert await users.identify("nobody", PASSWORD) is None
        assert await users.identify("operator", "") is None
        assert await users.role_now(ANONYMOUS) is Role.NONE
        assert await users.role_now(Identity("operator", "another hash")) is Role.NONE
        await users.close()

    asyncio.run(scene())


def test_a_changed_file_counts_at_once(tmp_path: Path) -> None:
    async def scene() -> None:
        path = users_file(tmp_path)
        users = with_users(path)
        await users.open()
        found = await users.identify("operator", PASSWORD)
        assert found is not None
        told = {user.name: user for user in read_users(path)}
        write_users([User("operator", Role.VIEWER, told["operator"].hash)], path)
        assert await users.role_now(found) is Role.VIEWER
        write_users([User("operator", Role.OPERATOR, hash_password("another one"))], path)
        assert await users.role_now(found) is Role.NONE  # the old password's session
        write_users([told["engineer"]], path)
        assert await users.role_now(found) is Role.NONE
        assert await users.identify("operator", PASSWORD) is None
        await users.close()

    asyncio.run(scene())


def test_while_the_file_cannot_be_read_nobody_is_known_and_the_reason_is_told(
    tmp_path: Path,
) -> None:
    async def scene() -> None:
        path = users_file(tmp_path)
        users = with_users(path)
        await users.open()
        assert users.problem is None
        found = await users.identify("operator", PASSWORD)
        assert found is not None
        path.chmod(0o644)
        assert await users.role_now(found) is Role.NONE
        assert users.problem is not None
        assert users.problem.code == "error-file_open_to_others"
        assert await users.identify("operator", PASSWORD) is None
        path.chmod(0o600)
        assert await users.role_now(found) is Role.OPERATOR
        path.rename(tmp_path / "elsewhere")
        assert await users.role_now(found) is Role.NONE
        await users.close()

    asyncio.run(scene())


def test_after_five_wrong_passwords_the_right_one_has_to_wait(tmp_path: Path) -> None:
    async def scene() -> None:
        clock = HandClock()
        users = with_users(users_file(tmp_path), clock)
        await users.open()
        for _ in range(FAILURES_BY_NAME):
            assert await users.identify("operator", "wrong", "10.0.0.9") is None
        assert await users.identify("operator", PASSWORD, "10.0.0.9") is None
        assert await users.identify("engineer", PASSWORD, "10.0.0.9") is not None
        assert await users.identify("operator", PASSWORD, "10.0.0.10") is not None
        clock.now_s += REFUSED_S
        assert await users.identify("operator", PASSWORD) is not None
        await users.close()

    asyncio.run(scene())


def test_guesses_at_the_same_time_are_counted_before_they_are_answered(tmp_path: Path) -> None:
    looked_at: list[str] = []

    async def scene() -> None:
        users = Users(users_file(tmp_path), HandClock(), lambda name, _: looked_at.append(name))
        await users.open()
        await asyncio.gather(
            *(users.identify("operator", f"guess {i}", "10.0.0.9") for i in range(100))
        )
        await users.close()

    asyncio.run(scene())
    assert len(looked_at) == FAILURES_BY_NAME


def test_a_name_that_does_not_exist_takes_as_long_as_one_that_does(tmp_path: Path) -> None:
    async def scene() -> tuple[float, float]:
        clock = HandClock()
        users = with_users(users_file(tmp_path), clock)
        await users.open()
        spent_s: dict[str, list[float]] = {"operator": [], "nobody": []}
        for _ in range(7):
            for name, times in spent_s.items():
                clock.now_s += REFUSED_S
                before_s = time.process_time()  # of all threads, whatever else computes
                await users.identify(name, "wrong")
                times.append(time.process_time() - before_s)
        await users.close()
        return min(spent_s["operator"]), min(spent_s["nobody"])

    known_s, unknown_s = asyncio.run(scene())
    assert 0.4 < known_s / unknown_s < 2.5


def test_no_password_reaches_a_log(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    async def scene() -> None:
        users = with_users(users_file(tmp_path))
        await users.open()
        await users.identify("operator", "unlucky guess")
        await users.identify("operator", PASSWORD)
        await users.close()

    with caplog.at_level(logging.DEBUG):
        asyncio.run(scene(), debug=True)
    assert "unlucky" not in caplog.text
    assert PASSWORD not in caplog.text
