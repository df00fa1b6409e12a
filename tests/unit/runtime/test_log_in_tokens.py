"""Tokens that stand for a password: whose they are, until when, and all that is refused."""

import asyncio
import errno
import hashlib
import logging
import stat
import threading
from collections.abc import Awaitable, Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import BinaryIO

import pytest
from argon2 import PasswordHasher
from asyncua import ua
from hypothesis import given, strategies as st

from tests import scenes
from tests.unit.runtime.status_server_parts import (
    ANSWER_S,
    NOW,
    PASSWORD,
    HandClock,
    Pairs,
    call,
    served,
    users_file,
)
from thermaxis.runtime import (
    FAILURES_BY_NAME,
    REFUSED_S,
    Role,
    hash_password,
    read_users,
    write_users,
)
from thermaxis.runtime.users import ANONYMOUS, TOKEN_S, Users, _tokens
from thermaxis.runtime.users._throttle import LOCAL_SHARE
from thermaxis.runtime.users._tokens import MOST_OF_HOLDER, MOST_TOKENS, IssuedTokens


class Loop:
    """The users of a loop that may be begun anew."""

    def __init__(self, folder: Path, clock: HandClock | None = None) -> None:
        folder.mkdir(exist_ok=True)
        self.file, self.clock = users_file(folder), clock or HandClock()
        self.tokens = folder / "machine.state.tokens"
        self.users = self._new()

    def _new(self) -> Users:
        return Users(self.file, self.clock, None, self.tokens)

    async def begin(self) -> "Loop":
        await self.users.open()
        return self

    async def restart(self) -> None:
        await self.users.close()
        self.users = self._new()
        await self.users.open()

    def change(self, name: str, **changes: object) -> None:
        """Change a user; one without a role is struck off."""
        known = [
            replace(user, **changes) if user.name == name else user
            for user in read_users(self.file)
        ]
        write_users([user for user in known if user.role is not Role.NONE], self.file)

    async def token(self, name: str = "operator") -> str:
        found = await self.users.identify(name, PASSWORD)
        assert found is not None
        return await self.users.issue_token(found)

    async def role(self, token: str, name: str = "operator") -> Role:
        """Return what somebody with a token may do."""
        found = await self.users.identify(name, token)
        return Role.NONE if found is None else await self.users.role_now(found)


@scenes.scene
async def test_a_token_stands_for_the_password_over_restarts_for_eight_hours(
    tmp_path: Path,
) -> None:
    loop = await Loop(tmp_path).begin()
    token = await loop.token()
    assert await loop.role(token) is Role.OPERATOR
    for _ in range(3):
        await loop.restart()
        assert await loop.role(token) is Role.OPERATOR
    found = await loop.users.identify("operator", token)
    assert found is not None
    loop.clock.now_s += TOKEN_S - 1.0
    assert await loop.users.role_now(found) is Role.OPERATOR
    loop.clock.now_s += 1.0
    assert await loop.users.role_now(found) is Role.NONE  # also a session that stands
    assert await loop.role(token) is Role.NONE
    await loop.restart()
    assert await loop.role(token) is Role.NONE
    await loop.users.close()


Attack = Callable[[Loop, str], Awaitable[str]]


async def struck_off(loop: Loop, token: str) -> str:
    loop.change("operator", role=Role.NONE)
    return token


async def lower_role(loop: Loop, token: str) -> str:
    loop.change("operator", role=Role.VIEWER)
    return token


async def higher_role(loop: Loop, token: str) -> str:
    loop.change("operator", role=Role.ENGINEER)
    return token


async def other_password(loop: Loop, token: str) -> str:
    loop.change("operator", hash=hash_password("another horse battery"))
    return token


async def same_password_said_anew(loop: Loop, token: str) -> str:
    loop.change("operator", hash=hash_password(PASSWORD))
    return token


async def eight_hours_later(loop: Loop, token: str) -> str:
    loop.clock.now_s += TOKEN_S
    return token


async def clock_set_back(loop: Loop, token: str) -> str:
    loop.clock.now_s -= 1.0
    return token


async def revoked(loop: Loop, token: str) -> str:
    found = await loop.users.identify("operator", token)
    assert found is not None
    await loop.users.revoke_token(found, token)
    return token


async def its_hash(_: Loop, token: str) -> str:
    return hashlib.sha256(token.encode()).hexdigest()


async def from_the_file(loop: Loop, _: str) -> str:
    return loop.tokens.read_text("utf-8")[:1000]


async def cut(_: Loop, token: str) -> str:
    return token[:-1]


async def longer(_: Loop, token: str) -> str:
    return f"{token}="


async def other_letters(_: Loop, token: str) -> str:
    return token.swapcase()


async def file_of_others(loop: Loop, token: str) -> str:
    loop.tokens.chmod(0o644)
    return token


async def file_cut(loop: Loop, token: str) -> str:
    loop.tokens.write_bytes(loop.tokens.read_bytes()[:-2])
    return token


async def file_of_another_kind(loop: Loop, token: str) -> str:
    loop.tokens.write_text('[{"sha256": 1, "holder": [], "until": 0}]')
    return token


async def file_gone(loop: Loop, token: str) -> str:
    loop.tokens.unlink()
    return token


ATTACKS: Sequence[Attack] = (
    *(struck_off, lower_role, higher_role, other_password, same_password_said_anew),
    *(eight_hours_later, clock_set_back, revoked),
    *(its_hash, from_the_file, cut, longer, other_letters),
    *(file_of_others, file_cut, file_of_another_kind, file_gone),
)


@pytest.mark.parametrize("attack", ATTACKS, ids=lambda one: one.__name__)
def test_a_token_that_may_not_stand_is_refused_before_and_after_a_restart(
    tmp_path: Path, attack: Attack
) -> None:
    async def scene() -> None:
        loop = await Loop(tmp_path).begin()
        token = await loop.token()
        tried = await attack(loop, token)
        if not attack.__name__.startswith("file_"):  # a file is read at the start
            assert await loop.role(tried) is Role.NONE
        await loop.restart()
        assert await loop.role(tried) is Role.NONE
        await loop.users.close()

    asyncio.run(scene())


@scenes.scene
async def test_a_token_that_is_revoked_while_the_disk_is_full_is_gone_after_a_restart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> AbstractContextManager[BinaryIO]:
        raise OSError(errno.ENOSPC, "no space left")

    loop = await Loop(tmp_path).begin()
    token = await loop.token()
    monkeypatch.setattr(_tokens, "whole_file", full)
    await revoked(loop, token)
    await loop.restart()
    assert await loop.role(token) is Role.NONE
    await loop.users.close()


@scenes.scene
async def test_a_token_is_no_other_users_and_no_other_loops(tmp_path: Path) -> None:
    clock = HandClock()
    one = await Loop(tmp_path / "one", clock).begin()
    other = await Loop(tmp_path / "other", clock).begin()
    other.file.write_bytes(one.file.read_bytes())  # the same people, to the hash
    token = await one.token()
    assert await other.role(token) is Role.NONE
    assert await one.role(token, "engineer") is Role.NONE
    assert await one.role(token, "nobody") is Role.NONE
    assert await one.role(token) is Role.OPERATOR
    for loop in (one, other):
        await loop.users.close()


@scenes.scene
async def test_a_token_buys_no_other_and_nobody_gets_one(tmp_path: Path) -> None:
    loop = await Loop(tmp_path).begin()
    by_password = await loop.users.identify("operator", PASSWORD)
    assert by_password is not None
    token = await loop.users.issue_token(by_password)
    by_token = await loop.users.identify("operator", token)
    assert by_token is not None
    assert await loop.users.issue_token(by_token) == ""
    assert await loop.users.issue_token(ANONYMOUS) == ""
    loop.change("operator", role=Role.NONE)
    assert await loop.users.issue_token(by_password) == ""
    await loop.users.close()


@scenes.scene
async def test_who_asks_for_tokens_on_and_on_has_the_file_written_so_often_and_no_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    loop = await Loop(tmp_path).begin()
    found, other = [await loop.users.identify(one, PASSWORD) for one in ("operator", "engineer")]
    assert found is not None
    assert other is not None
    most, writes = LOCAL_SHARE * FAILURES_BY_NAME, list[Path]()
    written = _tokens.whole_file

    def counted(path: Path, *, mode: int) -> AbstractContextManager[BinaryIO]:
        writes.append(path)
        return written(path, mode=mode)

    monkeypatch.setattr(_tokens, "whole_file", counted)
    for i in range(2 * most):
        token = await loop.users.issue_token(found)
        assert bool(token) is (i < most)
        await loop.users.revoke_token(found, token)
        await loop.users.revoke_token(found, "no token")
    assert len(writes) == 2 * most
    assert await loop.users.issue_token(other)
    loop.clock.now_s += REFUSED_S
    assert await loop.users.issue_token(found)
    await loop.users.close()


@scenes.scene
async def test_nobody_ends_the_token_of_another(tmp_path: Path) -> None:
    loop = await Loop(tmp_path).begin()
    token = await loop.token()
    other = await loop.users.identify("engineer", PASSWORD)
    assert other is not None
    await loop.users.revoke_token(other, token)
    assert await loop.role(token) is Role.OPERATOR
    await loop.users.close()


@scenes.scene
async def test_guesses_at_the_name_keep_no_token_out_and_a_token_helps_no_guesser(
    tmp_path: Path,
) -> None:
    loop = await Loop(tmp_path).begin()
    token, far = await loop.token(), "10.0.0.9"
    for _ in range(FAILURES_BY_NAME):
        assert await loop.users.identify("operator", "wrong", far) is None
    assert await loop.users.identify("operator", token, far) is not None
    assert await loop.users.identify("operator", PASSWORD, far) is None
    await loop.users.close()


@scenes.scene
async def test_tokens_that_have_ended_keep_no_password_out_and_cost_no_more_looks_than_guesses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    loop = await Loop(tmp_path).begin()
    token, far, looks = await loop.token(), "10.0.0.9", list[str]()
    verify = PasswordHasher.verify

    def counted(hasher: PasswordHasher, known: str, tried: str) -> bool:
        looks.append(tried)
        return verify(hasher, known, tried)

    await other_password(loop, token)
    monkeypatch.setattr(PasswordHasher, "verify", counted)
    for _ in range(2 * FAILURES_BY_NAME):
        assert await loop.users.identify("operator", token, far) is None
    assert len(looks) == FAILURES_BY_NAME
    assert await loop.users.identify("operator", "another horse battery", far) is not None
    await loop.users.close()


@scenes.scene
async def test_neither_a_token_nor_a_refusal_waits_for_a_password_that_is_being_checked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    loop = await Loop(tmp_path).begin()
    token, far = await loop.token(), "10.0.0.9"
    for _ in range(FAILURES_BY_NAME):
        assert await loop.users.identify("operator", "wrong", far) is None
    begun, checked = threading.Event(), threading.Event()

    def verify(*_: object) -> bool:
        begun.set()
        return checked.wait(ANSWER_S)

    monkeypatch.setattr(PasswordHasher, "verify", verify)
    other = asyncio.create_task(loop.users.identify("engineer", PASSWORD))
    await asyncio.to_thread(begun.wait)
    assert await loop.users.identify("operator", token) is not None
    assert await loop.users.identify("operator", PASSWORD, far) is None
    assert not other.done()
    checked.set()
    assert await other is not None
    await loop.users.close()


@scenes.scene
async def test_a_token_is_kept_as_its_hash_where_the_owner_alone_reads_and_in_no_log(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.DEBUG):
        loop = await Loop(tmp_path).begin()
        token = await loop.token()
        found = await loop.users.identify("operator", token)
        await loop.users.close()
    assert len(token) >= 43  # 256 bits in base64
    assert stat.S_IMODE(loop.tokens.stat().st_mode) == 0o600
    kept = loop.tokens.read_text("utf-8")
    assert hashlib.sha256(token.encode()).hexdigest() in kept
    for secret in (token, read_users(loop.file)[1].hash):
        assert secret not in kept + caplog.text
    assert token not in repr((found, loop.users, IssuedTokens(None)))


def test_no_more_tokens_are_kept_than_the_bound_and_the_youngest_hold(tmp_path: Path) -> None:
    path = tmp_path / "tokens"
    issued = IssuedTokens(path)
    given_out = [issued.issue(f"holder {i}", NOW) for i in range(MOST_TOKENS + 2)]
    again = IssuedTokens(path)
    again.read()
    for tokens in (issued, again):
        stand = [tokens.find(one, NOW) is not None for one in given_out]
        assert stand == [False] * 2 + [True] * MOST_TOKENS
    greedy = [issued.issue("greedy", NOW) for _ in range(3 * MOST_OF_HOLDER)]
    stand = [issued.find(one, NOW) is not None for one in greedy]
    assert stand == [False] * 2 * MOST_OF_HOLDER + [True] * MOST_OF_HOLDER
    held = [issued.find(one, NOW) is not None for one in given_out]
    assert held == [False] * (2 + MOST_OF_HOLDER) + [True] * (MOST_TOKENS - MOST_OF_HOLDER)
    later = NOW + timedelta(seconds=TOKEN_S)
    issued.issue("holder", later)
    assert path.read_text("utf-8").count("sha256") == 1  # those that have ended go


ONE = IssuedTokens(None)
STANDS = ONE.issue("holder", NOW)


@given(st.text(max_size=100) | st.text("0123456789abcdef", min_size=64, max_size=64))
def test_no_other_text_is_a_token(text: str) -> None:
    assert (ONE.find(text, NOW) is not None) is (text == STANDS)


# ---- at the status server -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> Pairs:
    return Pairs(tmp_path_factory.mktemp("pairs"))


@scenes.scene
async def test_a_client_logs_in_by_the_token_that_it_was_issued(
    pairs: Pairs, tmp_path: Path
) -> None:
    tokens = tmp_path / "tokens"
    async with (
        served(pairs.settings(), tokens=tokens) as server,
        pairs.user(server, "operator") as one,
    ):
        (token,) = await call(one, "IssueToken")
    said = ua.Variant(token, ua.VariantType.String)
    async with served(pairs.settings(), tokens=tokens) as server:
        async with pairs.user(server, "operator", str(token)) as one:
            assert await call(one, "WhoAmI") == ["operator", "operator"]
            with pytest.raises(ua.uaerrors.BadUserAccessDenied):
                await call(one, "IssueToken")
            with pytest.raises(ua.uaerrors.BadArgumentsMissing):
                await call(one, "RevokeToken")
            await call(one, "RevokeToken", said)
        with pytest.raises(ua.uaerrors.BadUserAccessDenied):
            await pairs.log_in(server, "operator", str(token))
