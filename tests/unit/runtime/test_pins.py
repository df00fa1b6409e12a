"""PINs: of operators, from this computer, five tries, then five minutes."""

from dataclasses import replace
from pathlib import Path

import pytest
from argon2 import PasswordHasher

from tests import scenes
from tests.refusals import refused
from tests.unit.runtime.status_server_parts import PASSWORD, HandClock, users_file
from thermaxis.runtime import (
    FAILURES_BY_NAME,
    PIN_MARK,
    PIN_REFUSED_S,
    Role,
    ScreenSettings,
    hash_password,
    hash_pin,
    read_users,
    write_users,
)
from thermaxis.runtime.users import Users

PIN = "481516"


def with_pins(folder: Path) -> Path:
    """Write users who all have a PIN, also those who may have none."""
    path = users_file(folder)
    write_users([replace(user, pin=hash_pin(PIN)) for user in read_users(path)], path)
    return path


def change(path: Path, **changes: object) -> None:
    known = [replace(one, **changes) if one.name == "operator" else one for one in read_users(path)]
    write_users(known, path)


def test_a_pin_is_digits_six_or_more_and_comes_back_as_its_hash_only(tmp_path: Path) -> None:
    for pin in ("", "12345", "12345a", "１２３４５６", "1234 56", "9" * 33, "-12345"):
        with refused("no_pin") as caught:
            hash_pin(pin)
        assert not pin or pin not in str(caught.value)
    path = with_pins(tmp_path)
    kept = {user.pin for user in read_users(path)}
    assert len(kept) == 3  # a salt each
    assert all(one.startswith("$argon2id$") for one in kept)
    assert PIN not in path.read_text("utf-8") + repr(read_users(path))


@scenes.scene
async def test_a_pin_lets_an_operator_in_from_this_computer_and_nobody_else(
    tmp_path: Path,
) -> None:
    path = with_pins(tmp_path)
    users = Users(path, HandClock())
    await users.open()
    found = await users.identify("operator", PIN_MARK + PIN)
    assert found is not None
    assert await users.role_now(found) is Role.OPERATOR
    for name, secret, address in (
        ("operator", PIN, ""),  # said as a password
        ("operator", PIN_MARK + PASSWORD, ""),
        ("operator", PIN_MARK, ""),
        ("operator", PIN_MARK + PIN + "0", ""),
        ("operator", PIN_MARK + PIN, "10.0.0.9"),
        ("viewer", PIN_MARK + PIN, ""),
        ("engineer", PIN_MARK + PIN, ""),
        ("nobody", PIN_MARK + PIN, ""),
    ):
        assert await users.identify(name, secret, address) is None, (name, secret, address)
    assert await users.identify("engineer", PASSWORD) is not None
    await users.close()


@pytest.mark.parametrize(
    "changes",
    [
        {"pin": hash_pin(PIN)},
        {"pin": ""},
        {"role": Role.ENGINEER},
        {"role": Role.VIEWER},
    ],
    ids=["another pin", "no pin", "engineer", "viewer"],
)
def test_another_pin_or_role_ends_what_the_old_one_allowed_and_its_token(
    tmp_path: Path, changes: dict[str, object]
) -> None:
    @scenes.scene
    async def scene() -> None:
        path = with_pins(tmp_path)
        users = Users(path, HandClock())
        await users.open()
        found = await users.identify("operator", PIN_MARK + PIN)
        assert found is not None
        token = await users.issue_token(found)
        renewed = await users.identify("operator", token)
        assert renewed is not None
        assert await users.role_now(renewed) is Role.OPERATOR
        change(path, hash=hash_password(PASSWORD))  # the password is another matter
        assert await users.role_now(renewed) is Role.OPERATOR
        change(path, **changes)
        assert await users.role_now(found) is Role.NONE
        assert await users.role_now(renewed) is Role.NONE
        assert await users.identify("operator", token) is None
        await users.close()

    scene()


@scenes.scene
async def test_a_token_for_a_pin_is_taken_where_the_pin_is_and_one_for_a_password_everywhere(
    tmp_path: Path,
) -> None:
    users = Users(with_pins(tmp_path), HandClock())
    await users.open()
    for secret, far in ((PIN_MARK + PIN, False), (PASSWORD, True)):
        found = await users.identify("operator", secret)
        assert found is not None
        token = await users.issue_token(found)
        assert (await users.identify("operator", token, "10.0.0.9") is not None) is far
        assert await users.identify("operator", token) is not None
    await users.close()


@scenes.scene
async def test_after_five_wrong_pins_the_right_one_waits_five_minutes_and_the_password_not(
    tmp_path: Path,
) -> None:
    clock = HandClock()
    users = Users(with_pins(tmp_path), clock)
    await users.open()
    for i in range(FAILURES_BY_NAME):
        assert await users.identify("operator", f"{PIN_MARK}00000{i}") is None
    assert await users.identify("operator", PIN_MARK + PIN) is None
    assert await users.identify("operator", PASSWORD) is not None
    clock.now_s += PIN_REFUSED_S - 0.1
    assert await users.identify("operator", PIN_MARK + PIN) is None
    clock.now_s += 0.2
    assert await users.identify("operator", PIN_MARK + PIN) is not None
    await users.close()
    assert (FAILURES_BY_NAME, PIN_REFUSED_S) == (5, 300.0)


def wrong(*_: object) -> bool:
    return False


@scenes.scene
async def test_what_other_names_fail_neither_frees_a_name_nor_refuses_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = HandClock()
    users = Users(with_pins(tmp_path), clock)
    await users.open()
    for _ in range(FAILURES_BY_NAME):
        assert await users.identify("operator", f"{PIN_MARK}000000") is None
    monkeypatch.setattr(PasswordHasher, "verify", wrong)  # which is slow by design
    for i in range(400):
        assert await users.identify(f"name {i}", f"{PIN_MARK}000000") is None
    monkeypatch.undo()
    assert await users.identify("operator", PIN_MARK + PIN) is None
    clock.now_s += PIN_REFUSED_S + 0.1
    assert await users.identify("operator", PIN_MARK + PIN) is not None
    await users.close()


def test_a_pin_is_taken_from_this_computer_and_from_panels_that_are_named() -> None:
    here = ScreenSettings(pin_from=("10.0.0.7", "fd00::7"))
    for address in ("127.0.0.1", "127.0.0.9", "::1", "::ffff:127.0.0.1", "10.0.0.7", "fd00::7"):
        assert here.takes_pin(address), address
    for address in ("10.0.0.8", "::ffff:10.0.0.8", "", "localhost", "testclient", "10.0.0.70"):
        assert not here.takes_pin(address), address
    assert here.takes_pin("::ffff:10.0.0.7")
    for address in ("127.0.0.1", "10.0.0.5", "::"):  # everybody comes from this computer's proxy
        behind_a_proxy = ScreenSettings(address=address, hosts=("lathe-3.shop",))
        assert not behind_a_proxy.takes_pin("127.0.0.1"), address
        assert replace(behind_a_proxy, pin_from=("127.0.0.1",)).takes_pin("127.0.0.1")
