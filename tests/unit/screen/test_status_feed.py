"""What the screen makes of what the loop says, and of what it does not say."""

import asyncio
import gc
import itertools
import json
import math
import tracemalloc
from collections.abc import Awaitable, Callable
from dataclasses import replace

import pytest
from hypothesis import given, strategies as st
from pydantic import ValidationError

from tests.opcua_server import until
from tests.unit.runtime.status_server_parts import (
    HandClock,
    Pairs,
    compensation,
    run,
    served,
    status,
    viewers,
)
from tests.unit.screen.feed_parts import STATUS, Loop, altered, read_as, text_of
from thermaxis.runtime import (
    ConnectionSettings,
    Role,
    Secret,
    ServerSettings,
    StatusServer,
    SystemClock,
    User,
    VirtualClock,
    hash_password,
    run_in_virtual_time,
    write_users,
)
from thermaxis.runtime.status import Snapshot, as_json, facts_of
from thermaxis.screen.feed import StatusFeed, StatusSnapshot, _status_feed
from thermaxis.screen.feed._status_feed import (
    LARGEST_STATUS_BYTES,
    REMEMBERED_LOOKS,
    WHO_AM_I_S,
    parse_status,
)

ANYWHERE = ConnectionSettings(name="loop", url="opc.tcp://127.0.0.1:1", security="none")


def look(
    loop: Loop, act: Callable[[StatusFeed, VirtualClock], Awaitable[None]], **times: float
) -> None:
    """Let an act watch a feed in virtual time."""

    async def life() -> None:
        clock = VirtualClock()
        feed = StatusFeed(ANYWHERE, clock, session=loop, **times)
        await feed.open()
        try:
            await act(feed, clock)
        finally:
            await feed.close()
        assert loop.users == 0
        assert len(asyncio.all_tasks()) == 1

    run_in_virtual_time(life())


async def looks(feed: StatusFeed, count: int) -> list[StatusSnapshot]:
    """Return the next looks, none left out."""
    found: list[StatusSnapshot] = []
    number = feed.latest.number
    for _ in range(count):
        told = await feed.after(number)
        assert told.number == number + 1
        number = told.number
        found.append(told)
    return found


def test_a_status_is_shown_as_the_loop_said_it() -> None:
    loop = Loop()

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        told = await feed.after(0)
        assert told.live
        assert not told.why
        assert told.text == loop.text
        assert told.status == json.loads(loop.text)
        assert told.received_s == clock.monotonic_s()
        assert told.received_utc == clock.utc()

    look(loop, act)


def test_without_a_connection_a_look_comes_every_second_and_says_why() -> None:
    loop = Loop()
    loop.lose()

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        assert feed.latest.number == 0
        assert not feed.latest.live
        times = [await _time_of(feed, clock) for _ in range(60)]
        assert max(b - a for a, b in itertools.pairwise(times)) <= 1.0 + 1e-9
        told = feed.latest
        assert not told.live
        assert told.why == "feed-no_connection"
        assert told.text == ""
        assert told.status == {}
        assert told.received_utc is None

    look(loop, act)


@pytest.mark.parametrize(("stated_s", "taken_s"), [(1.0, 4.0), (9.0, 9.0)])
def test_a_loop_that_is_slow_to_check_a_password_is_not_asked_again_and_again(
    monkeypatch: pytest.MonkeyPatch, stated_s: float, taken_s: float
) -> None:
    taken: list[float] = []

    def session(settings: ConnectionSettings, _: object) -> Loop:
        taken.append(settings.timeout_s)
        return Loop()

    async def life() -> None:
        StatusFeed(replace(ANYWHERE, timeout_s=stated_s), VirtualClock())
        StatusFeed(replace(ANYWHERE, timeout_s=stated_s), VirtualClock(), patience_s=0.5)

    monkeypatch.setattr(_status_feed, "OpcUaSession", session)
    run_in_virtual_time(life())
    assert taken == [taken_s, stated_s]


async def _time_of(feed: StatusFeed, clock: VirtualClock) -> float:
    await feed.after(feed.latest.number)
    return clock.monotonic_s()


def test_a_loop_that_is_connected_and_silent_delays_no_look() -> None:
    loop = Loop()
    loop.answers = False

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        times = [await _time_of(feed, clock) for _ in range(30)]
        assert max(b - a for a, b in itertools.pairwise(times)) <= 1.0 + 1e-9
        assert feed.latest.why == "feed-no_answer"
        assert not feed.latest.live

    look(loop, act)


def test_one_answer_that_is_missing_is_no_loss_and_three_seconds_of_silence_are() -> None:
    loop = Loop()

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        first = await feed.after(0)
        loop.answers = False
        second = await feed.after(first.number)
        assert second.live
        assert second.received_s == first.received_s  # and its age is told as it is
        while feed.latest.live:
            await feed.after(feed.latest.number)
        assert 3.0 < clock.monotonic_s() - first.received_s <= 4.0
        assert feed.latest.why == "feed-no_answer"
        assert feed.latest.text == first.text
        assert feed.latest.received_utc == first.received_utc

    look(loop, act)


def test_the_first_look_after_a_lost_connection_is_not_live_and_keeps_what_was_known() -> None:
    loop = Loop()

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        first = await feed.after(0)
        for number in range(2, 5):
            loop.lose()
            gone = await feed.after(feed.latest.number)
            assert (gone.live, gone.why) == (False, "feed-no_connection")
            assert gone.status["number"] == number - 1
            loop.find()
            loop.text = text_of(number)
            back = await feed.after(gone.number)
            assert back.live
            assert back.status["number"] == number
        assert feed.latest.number == first.number + 6

    look(loop, act)


@pytest.mark.parametrize(("cycle_s", "bound_s"), [(0.1, 3.0), (1.0, 3.0), (10.0, 30.0)])
def test_a_cycle_that_does_not_move_for_three_cycles_stands_still(
    cycle_s: float, bound_s: float
) -> None:
    loop = Loop(text_of(7, cycle_s=cycle_s))

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        first = await feed.after(0)
        while feed.latest.live:
            assert clock.monotonic_s() - first.received_s <= bound_s
            await feed.after(feed.latest.number)
        assert bound_s < clock.monotonic_s() - first.received_s <= bound_s + 1.0
        assert feed.latest.why == "feed-stands_still"
        assert feed.latest.received_s == first.received_s
        loop.text = text_of(8, cycle_s=cycle_s)
        moved = await feed.after(feed.latest.number)
        assert moved.live
        assert moved.received_s == clock.monotonic_s()

    look(loop, act)


def test_a_restarted_loop_whose_number_begins_anew_moves() -> None:
    loop = Loop(text_of(28_800))

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        await feed.after(0)
        for number in (1, 2, 3, 4, 5, 6):
            loop.text = text_of(number)
            told = await feed.after(feed.latest.number)
            assert told.live
            assert told.status["number"] == number

    look(loop, act)


def test_the_same_number_of_another_run_of_the_loop_moves_and_of_the_same_run_does_not() -> None:
    loop = Loop(text_of(5))

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        first = await feed.after(0)
        loop.text = text_of(5, overruns=99)
        again = await feed.after(first.number)
        assert again.received_s == first.received_s
        loop.text = text_of(5, started=status().utc)
        other = await feed.after(again.number)
        assert other.received_s == clock.monotonic_s() > first.received_s

    look(loop, act)


def test_an_uncertain_status_is_never_live() -> None:
    loop = Loop()
    loop.code = STATUS.UncertainLastUsableValue

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        for number in range(2, 12):
            told = await feed.after(feed.latest.number)
            assert (told.live, told.why) == (False, "feed-old")
            assert told.status == {}  # it is not taken for the loop's last good word either
            loop.text = text_of(number)
        loop.code = STATUS.Good
        assert (await feed.after(feed.latest.number)).live
        loop.code = STATUS.UncertainSubNormal
        last = await feed.after(feed.latest.number)
        assert (last.live, last.why) == (False, "feed-old")
        assert last.text  # the last good one stays, for whoever shows it as old

    look(loop, act)


@pytest.mark.parametrize(
    "code", [STATUS.BadWaitingForInitialData, STATUS.BadNodeIdUnknown, STATUS.BadNoData]
)
def test_a_loop_that_has_no_status_yet_says_so(code: int) -> None:
    loop = Loop()
    loop.code = code

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        told = await feed.after(0)
        assert (told.live, told.why) == (False, "feed-no_status")

    look(loop, act)


@pytest.mark.parametrize("role", ["operator", "engineer", "none", "admin", ""])
def test_an_account_that_is_more_or_less_than_a_viewer_shows_nothing(role: str) -> None:
    loop = Loop()
    loop.role = role

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        for told in await looks(feed, 3):
            assert (told.live, told.why) == (False, "feed-not_a_viewer")
            assert told.text == ""
            assert told.status == {}
        assert loop.read_times == 0

    look(loop, act)


def test_a_refused_question_who_it_is_shows_nothing() -> None:
    loop = Loop()
    loop.status_of_call = "BadUserAccessDenied"

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        told = await feed.after(0)
        assert told.why == "feed-not_a_viewer"

    look(loop, act)


def test_an_account_that_becomes_an_operator_shows_nothing_soon_and_forgets_what_was_shown() -> (
    None
):
    loop = Loop()

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        await feed.after(0)
        assert feed.recent("T_spindle_C")
        loop.role, began_s = "operator", clock.monotonic_s()
        number = 1
        while feed.latest.why != "feed-not_a_viewer":
            number += 1
            loop.text = text_of(number)
            await feed.after(feed.latest.number)
        assert clock.monotonic_s() - began_s <= WHO_AM_I_S + 1.0
        assert feed.latest.text == ""
        assert feed.recent("T_spindle_C") == ()
        loop.role = "viewer"
        assert (await feed.after(feed.latest.number)).live

    look(loop, act)


def test_who_it_is_is_asked_with_every_connection_and_rarely_otherwise() -> None:
    loop = Loop()

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        await looks(feed, 9)
        assert loop.asked_who == 1
        loop.lose()
        await looks(feed, 1)
        loop.find()
        loop.role = "operator"  # the next connection may be to another server
        told = (await looks(feed, 1))[0]
        assert told.why == "feed-not_a_viewer"

    look(loop, act)


HOSTILE = {
    "no JSON": "{",
    "nothing": "",
    "no object": "[]",
    "a number": "7",
    "another format": altered(format="other-status"),
    "another version": altered(version=1),
    "a version that is no number": altered(version=True),
    "no number": altered(number=None),
    "a number that is a text": altered(number="7"),
    "a number that is true": altered(number=True),
    "no cycle": altered(cycle_s=None),
    "a cycle of nothing": altered(cycle_s=0.0),
    "a negative cycle": altered(cycle_s=-1),
    "a cycle that is true": altered(cycle_s=True),
    "an endless cycle": altered(cycle_s=1e300),
    "NaN": text_of().replace('"overruns":3', '"overruns":NaN'),
    "a number beyond all": text_of().replace('"overruns":3', '"overruns":1e999'),
    "a whole number beyond all": text_of().replace('"overruns":3', f'"overruns":{"9" * 400}'),
    "outputs that are a list": altered(outputs=[]),
    "an input that is a number": altered(inputs={"T": 4}),
    "signals that are missing": altered(signals=None),
    "an alarm that is a text": altered(alarms=["fire"]),
    "reasons that are numbers": altered(reasons=[1]),
    "a state that is a number": altered(state=3),
    "half a pair of surrogates": altered(machine="\ud800"),
    "a deep nest": "[" * 200_000,
    "a deep nest of objects": '{"a":' * 100_000,
    "a megabyte": altered(machine="x" * LARGEST_STATUS_BYTES),
    "a megabyte of long letters": altered(machine="x").replace(
        '"x"', '"' + "µ" * (LARGEST_STATUS_BYTES // 2) + '"'
    ),
    "bytes": b"{}",
    "a number in place of a text": 7.0,
    "no value": ...,
}


@pytest.mark.parametrize("name", HOSTILE)
def test_what_is_no_status_is_refused_in_words_and_ends_nothing(name: str) -> None:
    loop = Loop(HOSTILE[name])

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        told = await feed.after(0)
        assert (told.live, told.why) == (False, "feed-not_understood")
        assert told.status == {}
        loop.text = text_of(2)
        assert (await feed.after(told.number)).live

    look(loop, act)


def test_the_largest_status_that_is_taken_is_a_megabyte() -> None:
    room = LARGEST_STATUS_BYTES - len(altered(machine=""))
    assert parse_status(altered(machine="x" * room))["machine"] == "x" * room
    with pytest.raises(ValueError, match="too large"):
        parse_status(altered(machine="x" * (room + 1)))


def test_what_the_loop_writes_is_read_back_whole() -> None:
    told = status("Z_um", "X_um")
    text = as_json(Snapshot(told, facts_of(compensation("Z_um", "X_um"))))
    assert parse_status(text) == json.loads(text)


ALARM = dict.fromkeys(("priority", "text", "cause", "remedy", "since"), "high")
MEMBERS = ("historian", "model_file", "model_sha256", "quality", "enabled", "source_connected")
WRONG_PARTS = [
    ("outputs", "parts_um", None),
    ("outputs", "limits", []),
    ("outputs", "correction_um", "12"),
    ("outputs", "trim_um", True),
    ("inputs", "quality", 1),
    ("inputs", "value_c", {}),
]


def told_with(group: str, name: str, value: object) -> str:
    told = json.loads(text_of())
    next(iter(told[group].values()))[name] = value
    return json.dumps(told)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        *((altered(**{name: None}), (name,)) for name in (*MEMBERS, "signals")),
        *((told_with(*part), part[:2]) for part in WRONG_PARTS),
        (altered(historian={"waiting": 0}), ("historian", "storing")),
        *((altered(alarms=[{**ALARM, name: None}]), ("alarms", name)) for name in ALARM),
    ],
)
def test_what_a_page_looks_up_is_there_and_of_its_kind(text: str, place: tuple[str, ...]) -> None:
    with pytest.raises(ValidationError) as refused:
        parse_status(text)
    (found,) = refused.value.errors()
    named = [one for one in found["loc"] if isinstance(one, str)]
    assert (named[0], named[-1]) == (place[0], place[-1]) or found["loc"][-2] == place[-1]


def test_an_alarm_of_an_older_loop_has_no_code() -> None:
    assert parse_status(altered(alarms=[ALARM]))["alarms"] == [ALARM]


@given(st.text(max_size=200))
def test_any_text_is_a_status_or_refused(text: str) -> None:
    with pytest.raises(ValueError):  # noqa: PT011 - of JSON, or of what it holds
        parse_status(text)


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=10,
)


@given(st.sampled_from(sorted(json.loads(text_of()))), _JSON)
def test_whatever_one_member_is_the_kinds_that_the_pages_rely_on_hold(
    name: str, value: object
) -> None:
    told = json.loads(text_of())
    told[name] = value
    try:
        found = parse_status(json.dumps(told))
    except ValueError:
        return
    assert isinstance(found["number"], int)
    assert 0.0 < found["cycle_s"] < math.inf
    for group in ("outputs", "inputs", "signals"):
        assert all(isinstance(member, dict) for member in found[group].values())
    assert all(isinstance(alarm, dict) for alarm in found["alarms"])
    assert json.loads(json.dumps(found, allow_nan=False, ensure_ascii=False).encode()) == found


def test_raw_values_are_kept_for_the_last_looks_only_and_without_gaps_filled() -> None:
    loop = Loop()

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        first_s = clock.monotonic_s()
        for number in range(2, REMEMBERED_LOOKS + 52):
            loop.text = read_as(None if number % 10 == 0 else 20.0 + number / 64.0, number)
            await feed.after(feed.latest.number)
        found = feed.recent("T_spindle_C")
        assert len(found) == REMEMBERED_LOOKS - REMEMBERED_LOOKS // 10
        for at_s, raw in found:
            number = round(at_s - first_s) + 2
            assert raw == pytest.approx(20.0 + number / 64.0)
        assert len(feed.recent("T_column_C")) == REMEMBERED_LOOKS
        assert feed.recent("interlock.referenced")[-1][1] == 1.0
        assert feed.recent("nobody") == ()

    look(loop, act)


def test_a_cycle_that_is_seen_twice_is_one_raw_value() -> None:
    loop = Loop(text_of(3, cycle_s=10.0))

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        await looks(feed, 8)
        assert len(feed.recent("T_spindle_C")) == 1

    look(loop, act)


def test_looks_beyond_those_that_are_remembered_take_no_memory() -> None:
    loop = Loop()
    used: list[int] = []

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        tracemalloc.start()
        for number in range(2, 802):
            loop.text = read_as(20.0 + number / 64.0, number)
            await feed.after(feed.latest.number)
            if number % 200 == 1:
                gc.collect()
                used.append(tracemalloc.get_traced_memory()[0])
        tracemalloc.stop()

    look(loop, act)
    assert len(used) == 4
    assert max(used[2:]) - used[1] < 40_000, used  # 100 byte for each of 400 looks


def test_a_connection_that_was_made_anew_during_a_look_shows_nothing_unasked() -> None:
    loop = Loop()

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        await feed.after(0)
        asked = loop.read

        async def renewed(*given: object) -> object:
            loop.find()
            loop.role = "operator"
            loop.text = text_of(99)
            return await asked(*given)

        loop.read = renewed
        told = await feed.after(feed.latest.number)
        assert told.status["number"] == 1  # what the new connection said was not taken
        told = await feed.after(told.number)
        assert told.why == "feed-not_a_viewer"

    look(loop, act)


def test_a_mistake_in_the_program_reaches_whoever_waits_and_whoever_closes() -> None:
    loop = Loop()

    async def broken(*_: object) -> None:
        raise ZeroDivisionError

    async def scene() -> None:
        feed = StatusFeed(ANYWHERE, VirtualClock(), session=loop)
        await feed.open()
        await feed.after(0)
        waiting = asyncio.create_task(feed.after(feed.latest.number))
        loop.read = broken
        with pytest.raises(ZeroDivisionError):
            await waiting
        with pytest.raises(ZeroDivisionError):
            await feed.after(feed.latest.number)
        with pytest.raises(ZeroDivisionError):
            await feed.close()
        assert loop.users == 0

    run_in_virtual_time(scene())


def test_a_status_with_a_flood_of_names_is_remembered_within_a_bound() -> None:
    names = {f"T{i}": {"read": 1.0} for i in range(5000)}
    loop = Loop(altered(signals=names))

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        await feed.after(0)
        kept = [name for name in (*names, "T_spindle_C") if feed.recent(name)]
        assert len(kept) == 999  # and the other input: the first thousand

    look(loop, act)


def test_whoever_waits_is_told_of_the_end() -> None:
    loop = Loop()
    ended: list[StatusSnapshot] = []

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        await feed.after(0)

        async def wait() -> None:
            ended.append(await feed.after(feed.latest.number))

        waiting = asyncio.create_task(wait())
        await asyncio.sleep(0)
        await feed.close()
        await waiting
        await feed.close()  # a second time is nothing

    look(loop, act)
    assert (ended[0].live, ended[0].why) == (False, "feed-ended")


def test_many_wait_and_each_is_told_the_same() -> None:
    loop = Loop()

    async def act(feed: StatusFeed, clock: VirtualClock) -> None:
        found = await asyncio.gather(*(feed.after(feed.latest.number) for _ in range(50)))
        assert {id(told) for told in found} == {id(feed.latest)}

    look(loop, act)


# ---- with the loop's own status server ----------------------------------------------------------


def fast(url: str) -> ConnectionSettings:
    return ConnectionSettings(name="loop", url=url, security="none", retry_s=0.02)


async def beat(server: StatusServer, clock: HandClock, first: int) -> None:
    """Let the loop run its cycles, quickly."""
    number = first
    while True:
        number += 1
        server.publish(status(number=number))
        await asyncio.sleep(0.01)


def test_the_feed_is_live_again_by_itself_each_time_the_server_comes_back() -> None:
    async def scene() -> None:
        async with served(viewers()) as first:
            port, url = first.port, first.url
        settings = ServerSettings("127.0.0.1", port, None, "viewer", None, None)
        feed = StatusFeed(fast(url), SystemClock(), every_s=0.05)
        await feed.open()
        for time in range(3):
            await until(lambda: feed.latest.why == "feed-no_connection")
            assert not feed.latest.live
            async with served(settings) as server:
                beating = asyncio.create_task(beat(server, HandClock(), 1000 * time))
                await until(lambda: feed.latest.live)
                assert feed.latest.status["number"] > 1000 * time
                beating.cancel()
                await asyncio.gather(beating, return_exceptions=True)
        await until(lambda: not feed.latest.live)
        await feed.close()

    run(scene)


def test_a_loop_that_stops_publishing_is_old_and_then_stands_still() -> None:
    async def scene() -> None:
        clock = HandClock()
        async with served(viewers(), clock=clock) as server:
            server.publish(status(number=1))
            feed = StatusFeed(fast(server.url), SystemClock(), every_s=0.05)
            await feed.open()
            await until(lambda: feed.latest.live)
            clock.now_s += 3.5  # by the server's clock; the feed's own has seen no three seconds
            await until(lambda: not feed.latest.live)
            assert feed.latest.why == "feed-old"
            assert feed.latest.text
            feed._moved_s -= 3.5
            await until(lambda: feed.latest.why == "feed-stands_still")
            server.publish(status(number=2))
            await until(lambda: feed.latest.live)
            await feed.close()

    run(scene)


def test_a_server_before_its_first_cycle_has_no_status() -> None:
    async def scene() -> None:
        async with served(viewers()) as server:
            feed = StatusFeed(fast(server.url), SystemClock(), every_s=0.05)
            await feed.open()
            await until(lambda: feed.latest.why == "feed-no_status")
            server.publish(status())
            await until(lambda: feed.latest.live)
            await feed.close()

    run(scene)


def test_the_account_of_an_operator_is_refused_by_the_feed_and_a_viewer_taken(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    folder = tmp_path_factory.mktemp("feed")
    pairs = Pairs(folder)
    password = "the screen has its own"  # noqa: S105 - of a user that exists in this test only
    known = hash_password(password)

    def appoint(role: Role) -> None:
        write_users([User("screen", role, known)], pairs.users)

    async def scene() -> None:
        appoint(Role.OPERATOR)
        async with served(pairs.settings()) as server:
            server.publish(status())
            settings = ConnectionSettings(
                name="loop",
                url=server.url,
                security="Basic256Sha256",
                user="screen",
                password=Secret(password),
                certificate=pairs.client.certificate,
                private_key=pairs.client.key,
                server_certificate=pairs.server.certificate,
                application_uri=pairs.client.uri,
                timeout_s=5.0,
            )
            feed = StatusFeed(settings, SystemClock(), every_s=0.1)
            await feed.open()
            await until(lambda: feed.latest.why == "feed-not_a_viewer")
            assert feed.latest.text == ""
            appoint(Role.VIEWER)
            await until(lambda: feed.latest.live)
            await feed.close()

    run(scene)
