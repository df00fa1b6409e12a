"""One address has a share of the failed log-ins that are allowed to all, and no more."""

import asyncio
import re
from collections import Counter, defaultdict
from typing import NoReturn

import pytest
from hypothesis import given, strategies as st

from tests.scenes import scene
from tests.unit.runtime.status_server_parts import HandClock
from thermaxis.errors import ConfigurationError
from thermaxis.messages import LANGUAGES, sentence
from thermaxis.runtime import FAILURES_BY_NAME, FAILURES_IN_ALL, REFUSED_S, Secret
from thermaxis.screen.access import FAILURES_BY_ADDRESS, UserSessions, _user_sessions
from thermaxis.screen.access._failed_log_ins import FailuresByAddress, counted_as
from thermaxis.screen.access._login_page import _STATUS
from thermaxis.screen.access._user_sessions import (
    BUSY,
    IMPOSSIBLE,
    MOST_AT_ONCE,
    REFUSED,
    TOO_MANY,
    TOO_MANY_FROM_HERE,
    TOO_MANY_IN_ALL,
    Refusal,
)

GUESSER, SHOP = "10.0.0.9", "10.0.0.10"


def no_server(name: str, password: Secret) -> NoReturn:
    """Stand for the loop's server: whoever comes so far has had the password looked at."""
    del name, password
    raise ConfigurationError("no_server")


class Door:
    """Sessions before which somebody stands; names with a bracket are no names of users."""

    def __init__(self) -> None:
        self.clock = HandClock()
        self.persons = UserSessions(no_server, self.clock, idle_s=900.0, longest_s=28_800.0)

    async def knock(self, name: str, address: str) -> Refusal:
        found = await self.persons.log_in(name, "a password", address)
        assert isinstance(found, Refusal)
        return found


def played(act) -> None:
    async def scene() -> None:
        door = Door()
        await door.persons.open()
        try:
            await act(door)
        finally:
            await door.persons.close()

    asyncio.run(scene())


def test_one_address_uses_up_its_own_share_and_nobody_elses() -> None:
    async def act(door: Door) -> None:
        keys = [(await door.knock(f"<{i}>", GUESSER)).key for i in range(FAILURES_IN_ALL)]
        assert keys.count(REFUSED) == FAILURES_BY_ADDRESS == 10
        assert set(keys[FAILURES_BY_ADDRESS:]) == {TOO_MANY_FROM_HERE}
        assert (await door.knock("novak", GUESSER)).key == TOO_MANY_FROM_HERE
        assert (await door.knock("novak", SHOP)).key == IMPOSSIBLE, "the password was looked at"

    played(act)


def test_the_share_comes_back_failure_by_failure_after_a_minute() -> None:
    async def act(door: Door) -> None:
        for i in range(FAILURES_BY_ADDRESS):
            assert (await door.knock(f"<{i}>", GUESSER)).key == REFUSED
            door.clock.now_s += 1.0
        refused = await door.knock("<x>", GUESSER)
        assert refused == Refusal(TOO_MANY_FROM_HERE, left_s=int(REFUSED_S) - FAILURES_BY_ADDRESS)
        door.clock.now_s += refused.left_s
        assert (await door.knock("<x>", GUESSER)).key == REFUSED
        assert (await door.knock("<y>", GUESSER)).key == TOO_MANY_FROM_HERE

    played(act)


def test_the_limits_of_all_and_of_a_name_stand_as_before() -> None:
    async def act(door: Door) -> None:
        for i in range(FAILURES_BY_NAME):
            assert (await door.knock("<novak>", f"10.1.{i}.1")).key == REFUSED
        assert (await door.knock("<novak>", "10.1.99.1")).key == TOO_MANY
        for i in range(FAILURES_IN_ALL - FAILURES_BY_NAME):
            assert (await door.knock(f"<{i}>", f"10.2.{i}.1")).key == REFUSED
        assert (await door.knock("dvorak", "10.1.99.1")).key == TOO_MANY_IN_ALL

    played(act)


def test_whoever_is_refused_takes_no_place_among_those_who_wait() -> None:
    async def act(door: Door) -> None:
        for i in range(FAILURES_BY_ADDRESS):
            await door.knock(f"<{i}>", GUESSER)
        many = await asyncio.gather(*(door.knock("novak", GUESSER) for _ in range(100)))
        assert {one.key for one in many} == {TOO_MANY_FROM_HERE}

    played(act)


class SlowServer:
    """Refuses whoever comes, once it is told to, as the loop's server does after argon2."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.looked_at, self.known = 0, asyncio.Event()
        monkeypatch.setattr(_user_sessions.LoopSession, "log_in", self.log_in)
        monkeypatch.setattr(
            _user_sessions, "is_refusal", lambda error: isinstance(error, TimeoutError)
        )

    async def log_in(self, *_: object) -> NoReturn:
        self.looked_at += 1
        await self.known.wait()
        raise TimeoutError


def slow_door(clock: HandClock) -> UserSessions:
    return UserSessions(lambda *_: None, clock, idle_s=900.0, longest_s=28_800.0)


@scene
async def test_passwords_that_are_checked_at_once_do_not_pass_the_share(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    server, clock = SlowServer(monkeypatch), HandClock()
    persons = slow_door(clock)
    await persons.open()
    for i in range(FAILURES_BY_ADDRESS - 1):
        await persons.log_in(f"<{i}>", "a password", GUESSER)
    knocks = [
        asyncio.ensure_future(persons.log_in(f"user{i}", "a password", GUESSER))
        for i in range(MOST_AT_ONCE)
    ]
    for _ in range(5):
        await asyncio.sleep(0.0)
    assert server.looked_at == 1, "the ninth has failed, the tenth is being looked at"
    server.known.set()
    keys = Counter([one.key for one in await asyncio.gather(*knocks)])
    assert keys == {REFUSED: 1, BUSY: MOST_AT_ONCE - 1}
    assert (await persons.log_in("user9", "a password", GUESSER)).key == TOO_MANY_FROM_HERE
    await persons.close()


@scene
async def test_a_failure_has_one_time_for_its_name_and_its_address_that_at_which_it_is_known(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    server, clock = SlowServer(monkeypatch), HandClock()
    persons = slow_door(clock)
    await persons.open()
    knock = asyncio.ensure_future(persons.log_in("novak", "a password", GUESSER))
    for _ in range(5):
        await asyncio.sleep(0.0)
    clock.now_s += 20.0
    server.known.set()
    assert (await knock).key == REFUSED
    assert list(persons._failures._in_all) == [clock.now_s]
    assert persons._by_address._times(GUESSER, clock.now_s) == [clock.now_s]
    await persons.close()


def test_a_log_in_that_is_not_refused_for_its_password_counts_for_nobody() -> None:
    async def act(door: Door) -> None:
        for _ in range(3 * FAILURES_BY_ADDRESS):
            assert (await door.knock("novak", SHOP)).key == IMPOSSIBLE

    played(act)


def test_an_address_is_counted_as_whoever_can_take_it() -> None:
    for written, counted in (
        ("127.0.0.1", "127.0.0.1"),
        ("::ffff:10.0.0.9", "10.0.0.9"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("fe80::1%eth0", "fe80::/64"),
        ("", ""),
        ("x" * 500, "x" * 64),
    ):
        assert counted_as(written) == counted


def test_a_network_of_ipv6_has_one_share_however_many_addresses_it_has() -> None:
    failures = FailuresByAddress()
    for i in range(FAILURES_BY_ADDRESS):
        assert failures.left_s(f"2001:db8::{i:x}", float(i)) is None
        failures.failed(f"2001:db8::{i:x}", float(i))
    assert failures.left_s("2001:db8::ffff", 20.0) == REFUSED_S - 20.0
    assert failures.left_s("2001:db8:0:1::1", 20.0) is None


def test_the_memory_is_bounded_whatever_the_number_of_addresses() -> None:
    failures = FailuresByAddress()
    for i in range(100_000):
        failures.failed(f"10.{i >> 16}.{i >> 8 & 255}.{i & 255}", i * 1e-6)
        assert len(failures) <= 2 * FAILURES_IN_ALL
    assert failures.left_s("10.0.0.1", 2.0 * REFUSED_S) is None
    assert len(failures) == 0


@given(
    st.lists(
        st.tuples(st.floats(0.0, 40.0), st.sampled_from([GUESSER, SHOP, "10.0.0.11"])),
        max_size=60,
    )
)
def test_no_minute_holds_more_failures_of_an_address_than_its_share(
    knocks: list[tuple[float, str]],
) -> None:
    failures, now_s = FailuresByAddress(), 0.0
    looked_at: defaultdict[str, list[float]] = defaultdict(list)
    for pause_s, address in knocks:
        now_s += pause_s
        in_a_minute = sum(t > now_s - REFUSED_S for t in looked_at[address])
        left_s = failures.left_s(address, now_s)
        assert (left_s is None) == (in_a_minute < FAILURES_BY_ADDRESS)
        if left_s is None:
            failures.failed(address, now_s)
            looked_at[address].append(now_s)
        else:
            assert 0.0 < left_s <= REFUSED_S


def test_the_page_says_that_it_is_the_address_and_for_how_long() -> None:
    assert _STATUS[TOO_MANY_FROM_HERE] == 429
    for language in LANGUAGES:
        said = sentence(TOO_MANY_FROM_HERE, {"seconds": "48"}, language=language).lower()
        assert "48" in said
        # several computers may stand behind one address: it is addresses that are told apart
        assert len(re.findall("add?res", said)) == 2
