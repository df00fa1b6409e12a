"""What the screen makes of what the loop says, and of what it does not say."""

import asyncio
import inspect
import itertools
import json
import math
from collections.abc import Awaitable, Callable
from dataclasses import replace

import pytest
from hypothesis import given, strategies as st
from pydantic import ValidationError

from tests.opcua_server import until
from tests.scenes import scene
from tests.unit.runtime.status_server_parts import (
    HandClock,
    served,
    status,
    viewers,
)
from tests.unit.screen.feed_parts import STATUS, Loop, altered, read_as, text_of
from thermaxis.runtime import (
    ConnectionSettings,
    ServerSettings,
    StatusServer,
    SystemClock,
    VirtualClock,
    run_in_virtual_time,
)
from thermaxis.runtime.status import as_json
from thermaxis.screen.feed import StatusFeed, StatusSnapshot, _status_feed
from thermaxis.screen.feed._status_feed import (
    LARGEST_STATUS_BYTES,
    REMEMBERED_LOOKS,
    WHO_AM_I_S,
    parse_status,
)

ANYWHERE = ConnectionSettings(name="loop", url="opc.tcp://127.0.0.1:1", security="none")


def watching(act: Callable[..., Awaitable[None]]) -> Callable[[], None]:
    """Make a test of an act that moves a loop and watches the feed, in virtual time."""

    async def life() -> None:
        loop, clock = Loop(), VirtualClock()
        feed = StatusFeed(ANYWHERE, clock, session=loop)
        await feed.open()
        given = {"loop": loop, "feed": feed, "clock": clock}
        try:
            await act(**{name: given[name] for name in inspect.signature(act).parameters})
        finally:
            await feed.close()
        assert loop.users == 0
        assert len(asyncio.all_tasks()) == 1

    def test() -> None:
        run_in_virtual_time(life())

    test.__name__, test.__doc__ = act.__name__, act.__doc__
    return test


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


@watching
async def test_a_status_is_shown_as_the_loop_said_it(
    loop: Loop, feed: StatusFeed, clock: VirtualClock
) -> None:

    told = await feed.after(0)
    assert told.live
    assert not told.why
    assert told.text == loop.text
    assert told.status == json.loads(loop.text)
    assert told.received_s == clock.monotonic_s()
    assert told.received_utc == clock.utc()


@watching
async def test_without_a_connection_a_look_comes_every_second_and_says_why(
    loop: Loop, feed: StatusFeed, clock: VirtualClock
) -> None:
    loop.lose()

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


def test_a_loop_that_is_slow_to_check_a_password_is_not_asked_again_and_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    taken: list[float] = []

    def session(settings: ConnectionSettings, _: object) -> Loop:
        taken.append(settings.timeout_s)
        return Loop()

    async def life() -> None:
        for stated_s in (1.0, 9.0):
            StatusFeed(replace(ANYWHERE, timeout_s=stated_s), VirtualClock())
        StatusFeed(replace(ANYWHERE, timeout_s=1.0), VirtualClock(), patience_s=0.5)

    monkeypatch.setattr(_status_feed, "OpcUaSession", session)
    run_in_virtual_time(life())
    assert taken == [4.0, 9.0, 1.0]


async def _time_of(feed: StatusFeed, clock: VirtualClock) -> float:
    await feed.after(feed.latest.number)
    return clock.monotonic_s()


@watching
async def test_a_loop_that_is_connected_and_silent_delays_no_look(
    loop: Loop, feed: StatusFeed, clock: VirtualClock
) -> None:
    loop.answers = False

    times = [await _time_of(feed, clock) for _ in range(30)]
    assert max(b - a for a, b in itertools.pairwise(times)) <= 1.0 + 1e-9
    assert feed.latest.why == "feed-no_answer"
    assert not feed.latest.live


@watching
async def test_one_answer_that_is_missing_is_no_loss_and_three_seconds_of_silence_are(
    loop: Loop, feed: StatusFeed, clock: VirtualClock
) -> None:

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


@watching
async def test_the_first_look_after_a_lost_connection_is_not_live_and_keeps_what_was_known(
    loop: Loop, feed: StatusFeed
) -> None:

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


@watching
async def test_a_cycle_that_does_not_move_for_three_cycles_stands_still(
    loop: Loop, feed: StatusFeed, clock: VirtualClock
) -> None:
    for number, (cycle_s, bound_s) in enumerate(((0.1, 3.0), (10.0, 30.0))):
        loop.text = text_of(7 + number, cycle_s=cycle_s)
        first = await feed.after(feed.latest.number)
        while feed.latest.live:
            assert clock.monotonic_s() - first.received_s <= bound_s
            await feed.after(feed.latest.number)
        assert bound_s < clock.monotonic_s() - first.received_s <= bound_s + 1.0
        assert feed.latest.why == "feed-stands_still"
        assert feed.latest.received_s == first.received_s
        loop.text = text_of(70 + number, cycle_s=cycle_s)
        moved = await feed.after(feed.latest.number)
        assert moved.live
        assert moved.received_s == clock.monotonic_s()


@watching
async def test_a_restarted_loop_whose_number_begins_anew_moves(
    loop: Loop, feed: StatusFeed
) -> None:
    loop.text = text_of(28800)

    await feed.after(0)
    for number in (1, 2, 3, 4, 5, 6):
        loop.text = text_of(number)
        told = await feed.after(feed.latest.number)
        assert told.live
        assert told.status["number"] == number


@watching
async def test_the_same_number_of_another_run_of_the_loop_moves_and_of_the_same_run_does_not(
    loop: Loop, feed: StatusFeed, clock: VirtualClock
) -> None:
    loop.text = text_of(5)

    first = await feed.after(0)
    loop.text = text_of(5, overruns=99)
    again = await feed.after(first.number)
    assert again.received_s == first.received_s
    loop.text = text_of(5, started=status().utc)
    other = await feed.after(again.number)
    assert other.received_s == clock.monotonic_s() > first.received_s


@watching
async def test_an_uncertain_status_is_never_live(loop: Loop, feed: StatusFeed) -> None:
    loop.code = STATUS.UncertainLastUsableValue

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


@watching
async def test_a_loop_that_has_no_status_yet_says_so(loop: Loop, feed: StatusFeed) -> None:
    for code in (STATUS.BadWaitingForInitialData, STATUS.BadNodeIdUnknown, STATUS.BadNoData):
        loop.code = code
        told = await feed.after(feed.latest.number)
        assert (told.live, told.why) == (False, "feed-no_status")


@watching
async def test_an_account_that_is_more_or_less_than_a_viewer_shows_nothing(
    loop: Loop, feed: StatusFeed
) -> None:
    for role, status_of_call in (
        ("operator", "Good"),
        ("none", "Good"),
        ("admin", "Good"),
        ("viewer", "BadUserAccessDenied"),
    ):
        loop.role, loop.status_of_call = role, status_of_call
        for told in await looks(feed, 2):
            assert (told.live, told.why) == (False, "feed-not_a_viewer")
            assert (told.text, told.status) == ("", {})
    assert loop.read_times == 0


@watching
async def test_an_account_that_becomes_an_operator_shows_nothing_soon_and_forgets_what_was_shown(
    loop: Loop, feed: StatusFeed, clock: VirtualClock
) -> None:

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


@watching
async def test_who_it_is_is_asked_with_every_connection_and_rarely_otherwise(
    loop: Loop, feed: StatusFeed
) -> None:

    await looks(feed, 9)
    assert loop.asked_who == 1
    loop.lose()
    await looks(feed, 1)
    loop.find()
    loop.role = "operator"  # the next connection may be to another server
    told = (await looks(feed, 1))[0]
    assert told.why == "feed-not_a_viewer"


HOSTILE = {
    "no JSON": "{",
    "no object": "[]",
    "another format": altered(format="other-status"),
    "another version": altered(version=1),
    "a version that is no number": altered(version=True),
    "no number": altered(number=None),
    "a number that is true": altered(number=True),
    "a cycle of nothing": altered(cycle_s=0.0),
    "an endless cycle": altered(cycle_s=1e300),
    "NaN": text_of().replace('"overruns":3', '"overruns":NaN'),
    "a number beyond all": text_of().replace('"overruns":3', '"overruns":1e999'),
    "a whole number beyond all": text_of().replace('"overruns":3', f'"overruns":{"9" * 400}'),
    "outputs that are a list": altered(outputs=[]),
    "an input that is a number": altered(inputs={"T": 4}),
    "an alarm that is a text": altered(alarms=["fire"]),
    "reasons that are numbers": altered(reasons=[1]),
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


@watching
async def test_what_is_no_status_is_refused_in_words_and_ends_nothing(
    loop: Loop, feed: StatusFeed
) -> None:

    for number, (name, text) in enumerate(HOSTILE.items()):
        loop.text = text
        told = await feed.after(feed.latest.number)
        assert (told.live, told.why) == (False, "feed-not_understood"), name
        assert told.status.get("number") == (number or None)  # of the last good one
        loop.text = text_of(number + 1)
        assert (await feed.after(told.number)).live, name


def test_the_largest_status_that_is_taken_is_a_megabyte() -> None:
    room = LARGEST_STATUS_BYTES - len(altered(machine=""))
    assert parse_status(altered(machine="x" * room))["machine"] == "x" * room
    with pytest.raises(ValueError, match="too large"):
        parse_status(altered(machine="x" * (room + 1)))


def test_what_the_loop_writes_is_read_back_whole() -> None:
    told = status("Z_um", "X_um")
    text = as_json(told)
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


LACKING: list[tuple[str, tuple[str, ...]]] = [
    *((altered(**{name: None}), (name,)) for name in (*MEMBERS, "signals")),
    *((told_with(*part), part[:2]) for part in WRONG_PARTS),
    (altered(historian={"waiting": 0, "lost": 0, "text": ""}), ("historian", "storing")),
    *((altered(alarms=[{**ALARM, name: None}]), ("alarms", name)) for name in ALARM),
]


def test_what_a_page_looks_up_is_there_and_of_its_kind() -> None:
    for text, place in LACKING:
        with pytest.raises(ValidationError) as refused:
            parse_status(text)
        (found,) = refused.value.errors()
        named = [one for one in found["loc"] if isinstance(one, str)]
        assert (named[0], named[-1]) == (place[0], place[-1]) or found["loc"][-2] == place[-1]
    assert parse_status(altered(alarms=[ALARM]))["alarms"] == [ALARM]  # of a loop without codes


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


@watching
async def test_raw_values_are_kept_for_the_last_looks_only_and_without_gaps_filled(
    loop: Loop, feed: StatusFeed, clock: VirtualClock
) -> None:

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


@watching
async def test_a_cycle_that_is_seen_twice_is_one_raw_value(loop: Loop, feed: StatusFeed) -> None:
    loop.text = text_of(3, cycle_s=10.0)

    await looks(feed, 8)
    assert len(feed.recent("T_spindle_C")) == 1


@watching
async def test_a_connection_that_was_made_anew_during_a_look_shows_nothing_unasked(
    loop: Loop, feed: StatusFeed
) -> None:

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


@watching
async def test_a_status_with_a_flood_of_names_is_remembered_within_a_bound(
    loop: Loop, feed: StatusFeed
) -> None:
    names = {f"T{i}": {"read": 1.0, "status": "Good", "good": True} for i in range(5000)}
    loop.text = altered(signals=names)

    await feed.after(0)
    kept = [name for name in (*names, "T_spindle_C") if feed.recent(name)]
    assert len(kept) == 999  # and the other input: the first thousand


@watching
async def test_whoever_waits_is_told_of_the_end(loop: Loop, feed: StatusFeed) -> None:
    ended: list[StatusSnapshot] = []

    await feed.after(0)

    async def wait() -> None:
        ended.append(await feed.after(feed.latest.number))

    waiting = asyncio.create_task(wait())
    await asyncio.sleep(0)
    await feed.close()
    await waiting
    await feed.close()  # a second time is nothing

    assert (ended[0].live, ended[0].why) == (False, "feed-ended")


# ---- with the loop's own status server ----------------------------------------------------------


async def beat(server: StatusServer, first: int) -> None:
    """Let the loop run its cycles, quickly."""
    number = first
    while True:
        number += 1
        server.publish(status(number=number))
        await asyncio.sleep(0.01)


@scene
async def test_what_the_feed_says_follows_a_server_that_begins_stops_and_comes_back() -> None:
    clock = HandClock()
    async with served(viewers(), clock=clock) as server:
        settings = ServerSettings("127.0.0.1", server.port, None, "viewer", None, None)
        at = ConnectionSettings(name="loop", url=server.url, security="none", retry_s=0.02)
        feed = StatusFeed(at, SystemClock(), every_s=0.05)
        await feed.open()
        await until(lambda: feed.latest.why == "feed-no_status")
        server.publish(status(number=1))
        await until(lambda: feed.latest.live)
        clock.now_s += 3.5  # by the server's clock; the feed's own has seen no three seconds
        await until(lambda: not feed.latest.live)
        assert feed.latest.why == "feed-old"
        assert feed.latest.text
        server.publish(status(number=2))
        await until(lambda: feed.latest.live)
    for time in range(2):
        await until(lambda: feed.latest.why == "feed-no_connection")
        assert not feed.latest.live
        async with served(settings) as server:
            beating = asyncio.create_task(beat(server, 1000 * time))
            await until(lambda: feed.latest.live)
            assert feed.latest.status["number"] > 1000 * time
            beating.cancel()
            await asyncio.gather(beating, return_exceptions=True)
    await feed.close()
