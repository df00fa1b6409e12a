"""Failed log-ins cost whoever failed, by address and name, and nobody else."""

import asyncio
import re
from collections import Counter
from typing import NoReturn

from hypothesis import given, strategies as st

from tests.scenes import scene
from tests.unit.runtime.status_server_parts import HandClock
from thermaxis.errors import ConfigurationError
from thermaxis.messages import LANGUAGES, sentence
from thermaxis.runtime import (
    FAILURES_BY_ADDRESS,
    FAILURES_BY_NAME,
    REFUSED_S,
    LogInThrottle,
    Secret,
)
from thermaxis.runtime.users._throttle import LOCAL_SHARE, Refused, counted_as
from thermaxis.screen.access import UserSessions
from thermaxis.screen.access._login_page import _STATUS
from thermaxis.screen.access._user_sessions import (
    IMPOSSIBLE,
    MOST_AT_ONCE,
    REFUSED,
    TOO_MANY,
    TOO_MANY_FROM_HERE,
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
        keys = [(await door.knock(f"<{i}>", GUESSER)).key for i in range(3 * FAILURES_BY_ADDRESS)]
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


def test_nobody_is_refused_for_what_comes_from_elsewhere() -> None:
    async def act(door: Door) -> None:
        for _ in range(FAILURES_BY_NAME):
            assert (await door.knock("<novak>", GUESSER)).key == REFUSED
        assert (await door.knock("<novak>", GUESSER)).key == TOO_MANY
        for i in range(300):
            assert (await door.knock("<novak>", f"10.2.{i // 200}.{i % 200}")).key == REFUSED
        assert (await door.knock("<novak>", SHOP)).key == REFUSED, "the password was looked at"
        assert (await door.knock("dvorak", SHOP)).key == IMPOSSIBLE, "this one, too"

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

    def __init__(self) -> None:
        self.looked_at, self.known = 0, asyncio.Event()

    async def log_in(self, *_: object) -> None:
        self.looked_at += 1
        await self.known.wait()


@scene
async def test_passwords_that_are_checked_at_once_do_not_pass_the_share() -> None:
    server = SlowServer()
    persons = UserSessions(server.log_in, HandClock(), idle_s=900.0, longest_s=28_800.0)
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
    assert keys == {REFUSED: 1, TOO_MANY_FROM_HERE: MOST_AT_ONCE - 1}
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
    throttle = LogInThrottle()
    for i in range(FAILURES_BY_ADDRESS):
        assert throttle.refused("x", f"2001:db8::{i:x}", float(i)) is None
        throttle.count("x" * i, f"2001:db8::{i:x}", float(i))
    refused = throttle.refused("x", "2001:db8::ffff", 20.0)
    assert refused == Refused(address=True, left_s=REFUSED_S - 20.0)
    assert throttle.refused("x", "2001:db8:0:1::1", 20.0) is None


def test_behind_this_computer_a_name_alone_is_refused_and_later() -> None:
    throttle = LogInThrottle()
    for i in range(LOCAL_SHARE * FAILURES_BY_NAME):
        assert throttle.refused("novak", "", 1.0) is None
        throttle.count("novak", "", 1.0)
        throttle.count(f"name {i}", "", 1.0)
    assert throttle.refused("novak", "", 1.0) == Refused(address=False, left_s=REFUSED_S)
    assert throttle.refused("dvorak", "", 1.0) is None


def test_a_success_clears_its_name_at_its_address_and_not_the_address() -> None:
    throttle = LogInThrottle()
    for i in range(FAILURES_BY_ADDRESS - 1):
        throttle.count("novak" if i < FAILURES_BY_NAME - 1 else f"<{i}>", GUESSER, 0.0)
    throttle.succeeded("novak", SHOP)
    throttle.count("novak", GUESSER, 1.0)
    assert throttle.refused("novak", GUESSER, 1.0) is not None
    throttle.succeeded("novak", GUESSER)
    assert throttle.refused("novak", GUESSER, 1.0) is None
    for _ in range(FAILURES_BY_NAME):
        assert throttle.refused("x", GUESSER, 1.0) is None
        throttle.count("x", GUESSER, 1.0)
    assert throttle.refused("y", GUESSER, 1.0) is not None


def test_the_memory_is_bounded_whatever_the_number_of_addresses_and_names() -> None:
    throttle = LogInThrottle()
    for i in range(20_000):
        throttle.count(f"name {i}", f"10.{i >> 16}.{i >> 8 & 255}.{i & 255}", i * 1e-6)
        throttle.count(f"name {i}", "", i * 1e-6)
    assert sum(map(len, throttle._counted.values())) <= 1_000


@given(
    st.lists(
        st.tuples(
            st.floats(0.0, 20.0),
            st.sampled_from([GUESSER, SHOP]),
            st.sampled_from(["a", "b", "c"]),
        ),
        max_size=60,
    )
)
def test_no_minute_holds_more_failures_than_the_shares(
    knocks: list[tuple[float, str, str]],
) -> None:
    throttle, now_s = LogInThrottle(), 0.0
    tried: list[tuple[float, str, str]] = []
    for pause_s, address, name in knocks:
        now_s += pause_s
        recent = [(n, a) for at_s, a, n in tried if at_s > now_s - REFUSED_S and a == address]
        refused = throttle.refused(name, address, now_s)
        full = len(recent) >= FAILURES_BY_ADDRESS
        assert (refused is not None) == (full or recent.count((name, address)) >= FAILURES_BY_NAME)
        if refused is None:
            throttle.count(name, address, now_s)
            tried.append((now_s, address, name))
        else:
            assert refused.address is full
            assert 0.0 < refused.left_s <= REFUSED_S


def test_the_page_says_that_it_is_the_address_and_for_how_long() -> None:
    assert _STATUS[TOO_MANY_FROM_HERE] == 429
    for language in LANGUAGES:
        said = sentence(TOO_MANY_FROM_HERE, {"seconds": "48"}, language=language).lower()
        assert "48" in said
        # several computers may stand behind one address: it is addresses that are told apart
        assert len(re.findall("add?res", said)) == 2
