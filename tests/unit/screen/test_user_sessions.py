"""Who logs in at the screen, for how long, and what the loop answers to whom."""

import asyncio
import functools
import gc
import inspect
import logging
from collections.abc import Awaitable, Callable
from dataclasses import replace

import pytest
from argon2 import Parameters, PasswordHasher, extract_parameters

from tests import scenes
from tests.opcua_server import until
from tests.unit.runtime.status_server_parts import PASSWORD, Pairs, served
from tests.unit.screen.person_parts import (
    HERE,
    IDLE_S,
    LONGEST_S,
    ROLES,
    Shop,
    Stage,
    appoint,
    asks,
    connection_to,
    shop,
)
from thermaxis.codes import Message
from thermaxis.compensation import RequestKind
from thermaxis.errors import ConfigurationError
from thermaxis.messages import sentence_of
from thermaxis.runtime import (
    FAILURES_BY_NAME,
    PIN_REFUSED_S,
    REFUSED_S,
    LoopAnswer,
    RequestOutcome,
    Role,
    Secret,
    hash_pin,
    read_users,
    write_users,
)
from thermaxis.runtime.status import ASKS
from thermaxis.screen.access import (
    Answer,
    LoopSession,
    UserSession,
    _loop_session,
    _user_sessions,
)
from thermaxis.screen.access._user_sessions import (
    KEEP_ALIVE_S,
    MOST_AT_ONCE,
    MOST_OF_ONE,
    Refusal,
)

PIN = "481516"
Act = Callable[..., Awaitable[None]]


def at_the_shop(**changes: object) -> Callable[[Act], Callable[..., None]]:
    """Make a test of an act with persons of its own; its other parameters pytest fills in."""

    def made(act: Act) -> Callable[..., None]:
        def test(runner: asyncio.Runner, loops_stage: Stage, **given: object) -> None:
            async def scene() -> None:
                async with asyncio.timeout(scenes.LONGEST_S), shop(loops_stage, **changes) as place:
                    await act(place, **given)

            runner.run(scene())

        own = list(inspect.signature(test).parameters.values())[:2]
        asked = list(inspect.signature(act).parameters.values())[1:]
        functools.update_wrapper(test, act)
        test.__signature__ = inspect.Signature([*own, *asked])
        return test

    return made


# ---- log-in -------------------------------------------------------------------------------------


@at_the_shop()
async def test_a_wrong_name_or_password_is_refused_in_the_same_words_and_leaves_nothing(
    place: Shop,
) -> None:
    for name, password in (("novak", "wrong"), ("nobody", PASSWORD), ("n" * 65, PASSWORD)):
        place.clock.now_s += REFUSED_S
        assert await place.refused(name, password) == Refusal("login-refused")
    assert place.persons.count == 0
    await place.empty()


@at_the_shop()
async def test_cookie_and_token_are_secrets_and_a_cookie_is_kept_as_its_hash(
    place: Shop,
) -> None:
    found = [await place.log_in("novak") for _ in range(MOST_OF_ONE)]
    cookies = {cookie for cookie, _ in found}
    tokens = {person.token for _, person in found}
    assert len(cookies | tokens) == 2 * MOST_OF_ONE
    assert all(len(cookie) >= 43 for cookie in cookies)  # 256 bits in base64
    assert all(len(token) >= 22 for token in tokens)  # 128 bits and more
    kept = texts_within(place.persons)
    assert not cookies & kept
    assert tokens <= kept  # the search finds what is there
    shown = "".join(f"{person!r}{person}" for _, person in found) + repr(place.persons)
    assert not any(secret in shown for secret in cookies | tokens)
    cookie, person = found[0]
    assert place.persons.of(person.token) is None
    for known in place.persons._standing:
        assert place.persons.of(known.hex()) is None
        assert place.persons.of(known.decode("latin-1")) is None
    for other in (None, "", cookie[:-1], cookie + "x", cookie.upper(), "é" * 43, "x" * 10_000):
        assert place.persons.of(other) is None


@at_the_shop()
async def test_a_password_is_kept_nowhere_after_the_log_in(
    place: Shop, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.DEBUG), caplog.at_level(logging.DEBUG, "asyncua"):
        _, person = await place.log_in("novak")
        await place.refused("novak", "wrong but secret words")
    kept = texts_within(person)
    assert place.pairs.client.uri in kept  # the search reaches what asyncua keeps
    assert not [text for text in kept if PASSWORD in text or "wrong but secret" in text]
    assert PASSWORD not in caplog.text
    assert "wrong but secret" not in caplog.text
    assert PASSWORD not in repr(person)


def texts_within(thing: object) -> set[str]:
    """Return every text that can be reached from an object, as far as it holds data."""
    seen: set[int] = set()
    found: set[str] = set()
    waiting: list[object] = [thing]
    while waiting:
        one = waiting.pop()
        if id(one) in seen or isinstance(one, type) or callable(one) or _is_a_loop(one):
            continue
        seen.add(id(one))
        if isinstance(one, str):
            found.add(one)
        elif isinstance(one, bytes | bytearray):
            found.add(bytes(one).decode("latin-1"))
        if isinstance(one, dict):
            waiting.extend(one)  # not every key is told as a referent
        waiting.extend(gc.get_referents(one))
        waiting.extend(getattr(one, "__dict__", {}).values())
    return found


def _is_a_loop(one: object) -> bool:
    return isinstance(one, asyncio.AbstractEventLoop | asyncio.Task)


@at_the_shop()
async def test_two_log_ins_of_one_user_are_two_sessions(place: Shop) -> None:
    first, one = await place.log_in("novak")
    second, other = await place.log_in("novak")
    assert one is not other
    assert place.sessions == 2
    await place.persons.log_out(first)
    assert place.persons.of(first) is None
    assert place.persons.of(second) is other
    assert (await place.ask(other, "Hold")).answer is Answer.ACCEPTED
    assert (await place.ask(one, "Hold")).answer is Answer.REFUSED
    assert [request.who for request in place.box.requests] == ["novak"]


@at_the_shop()
async def test_one_user_cannot_take_every_place(place: Shop) -> None:
    found = [await place.log_in("novak") for _ in range(MOST_OF_ONE + 2)]
    assert place.persons.count == MOST_OF_ONE
    assert [person.ended for _, person in found] == ["login-elsewhere"] * 2 + [""] * MOST_OF_ONE
    assert place.persons.why_ended(found[0][0]) == "login-elsewhere"
    await until(lambda: place.sessions == MOST_OF_ONE)


@at_the_shop(most=2)
async def test_no_more_persons_than_may_be_and_a_place_that_is_free_is_free(place: Shop) -> None:
    names = ("novak", "dvorak", "host", "svoboda")
    found = await asyncio.gather(*(place.persons.log_in(name, PASSWORD, HERE) for name in names))
    refused = [one for one in found if isinstance(one, Refusal)]
    assert refused == [Refusal("login-full")] * 2
    assert place.persons.count == 2
    await until(lambda: place.sessions == 2)
    cookie = next(one[0] for one in found if not isinstance(one, Refusal))
    await place.persons.log_out(cookie)
    await place.log_in("host")
    assert await place.refused("dvorak") == Refusal("login-full")
    place.clock.now_s += IDLE_S  # the others go by themselves, when their place is wanted
    await place.log_in("svoboda")
    assert place.persons.count == 1


@at_the_shop()
async def test_a_flood_of_log_ins_is_bounded(place: Shop) -> None:
    wanted = MOST_AT_ONCE + 5
    found = await asyncio.gather(
        *(place.persons.log_in(f"n{i}", PASSWORD, f"10.0.0.{i}") for i in range(wanted))
    )
    assert found.count(Refusal("login-busy")) == 5
    assert found.count(Refusal("login-refused")) == MOST_AT_ONCE


@at_the_shop()
async def test_a_log_in_that_its_browser_gives_up_leaves_no_session(place: Shop) -> None:
    for pause_s in (0.0, 0.005, 0.02, 0.05, 0.08):  # whichever step it is given up in
        task = asyncio.create_task(place.persons.log_in("novak", PASSWORD, HERE))
        await asyncio.sleep(pause_s)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
    count = place.persons.count
    await until(lambda: place.sessions == count)
    await place.log_in("dvorak")


@at_the_shop()
async def test_a_user_without_a_role_is_not_let_in(place: Shop, monkeypatch) -> None:
    users = place.server._users
    assert users is not None

    async def nobody(_identity: object) -> Role:
        return Role.NONE

    monkeypatch.setattr(users, "role_now", nobody)
    assert await place.refused("novak") == Refusal("login-no_role")
    await place.empty()


@at_the_shop()
async def test_a_configuration_or_a_key_that_lets_nobody_log_in_is_no_wrong_password(
    place: Shop, tmp_path_factory: pytest.TempPathFactory
) -> None:
    def connection_for(name: str, password: object):
        raise ConfigurationError("password_needs_encryption")

    settings = connection_to(place.pairs, lambda: place.cable.url)("novak", Secret(PASSWORD))
    away = tmp_path_factory.mktemp("away") / "key.pem"
    for wrong in (connection_for, lambda *_: replace(settings, private_key=away)):
        place.persons._open_session = lambda *given, wrong=wrong: LoopSession.log_in(
            wrong(*given), place.clock
        )
        assert (await place.refused("novak")).key == "login-impossible"


@at_the_shop()
async def test_a_loop_that_is_away_is_no_wrong_password_and_counts_for_nobody(place: Shop) -> None:
    await place.cable.cut()
    for _ in range(FAILURES_BY_NAME + 2):
        found = await place.refused("novak")
        assert found.key == "login-no_connection"
    await place.cable.mend()
    await place.log_in("novak")


@at_the_shop()
async def test_a_server_with_another_certificate_is_told_no_password(
    place: Shop,
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(_loop_session, "LOG_IN_S", 1.0)
    other = Pairs(tmp_path_factory.mktemp("other"))
    appoint(other.users, ROLES)
    heard: list[str] = []

    async with served(other.settings(), clock=place.clock) as false:
        users = false._users
        assert users is not None

        async def listen(name: str, password: str) -> None:
            heard.append(password)

        users.identify = listen
        place.cable._target = false.port
        found = await place.refused("novak")
        assert found.key == "login-no_connection"
        await place.cable.cut()

    assert heard == []


# ---- guessing -----------------------------------------------------------------------------------


@at_the_shop()
async def test_a_log_in_of_its_own_gives_a_guesser_no_more_guesses(place: Shop) -> None:
    guesses = 0
    for i in range(20):
        if i % 3 == 0:
            await place.persons.log_in("svoboda", PASSWORD, HERE)  # the guesser's own
        else:
            found = await place.refused("dvorak", f"guess {i}")
            guesses += found.key == "login-refused"
    assert guesses <= FAILURES_BY_NAME


@at_the_shop()
async def test_a_name_that_nobody_has_costs_as_much_as_a_wrong_password(
    place: Shop, monkeypatch: pytest.MonkeyPatch
) -> None:
    costs: list[Parameters] = []
    verify = PasswordHasher.verify

    def counted(hasher: PasswordHasher, known: str, password: str) -> bool:
        costs.append(extract_parameters(known))
        return verify(hasher, known, password)

    monkeypatch.setattr(PasswordHasher, "verify", counted)
    for name in ("novak", "nobody"):
        await place.refused(name, "wrong horse battery")
    known, unknown = costs
    assert known == unknown


def takes_pin(address: str) -> bool:
    return address == HERE


@at_the_shop(takes_pin=takes_pin)
async def test_a_pin_is_taken_at_a_panel_and_nowhere_else(place: Shop) -> None:
    appoint(place.pairs.users, ROLES)
    known = [replace(user, pin=hash_pin(PIN)) for user in read_users(place.pairs.users)]
    write_users(known, place.pairs.users)
    far, log_in = "10.0.0.9", place.persons.log_in
    found = await log_in("novak", PIN, HERE, pin=True)
    assert not isinstance(found, Refusal)
    cookie, person = found
    assert person.role is Role.OPERATOR
    assert (await place.ask(person, "Hold")).answer is Answer.ACCEPTED
    assert await log_in("novak", PIN, far, pin=True) == Refusal("login-no_panel")
    for said in (PIN, f"pin:{PIN}", f"\0pin:{PIN}", f"\0\0pin:{PIN}"):
        assert await log_in("novak", said, far) == Refusal("login-refused"), said
    for name in ("host", "dvorak"):
        assert await log_in(name, PIN, HERE, pin=True) == Refusal("login-refused")
    assert await log_in("novak", PASSWORD, HERE, pin=True) == Refusal("login-refused")
    await place.cable.cut()
    await until(lambda: person.session.lost)
    await place.cable.mend()
    await place.clock.move(KEEP_ALIVE_S)
    await until(lambda: not person.session.lost)
    assert (await place.ask(person, "Hold")).answer is Answer.ACCEPTED
    await place.persons.log_out(cookie)


@at_the_shop(takes_pin=takes_pin)
async def test_five_wrong_pins_block_pins_of_the_name_for_five_minutes(place: Shop) -> None:
    for i in range(FAILURES_BY_NAME):
        found = await place.persons.log_in("novak", f"00000{i}", HERE, pin=True)
        assert found == Refusal("login-refused")
    found = await place.persons.log_in("novak", PIN, HERE, pin=True)
    assert found == Refusal("login-too_many", left_s=round(PIN_REFUSED_S))
    await place.log_in("novak")


# ---- the end of a log-in ------------------------------------------------------------------------


@at_the_shop()
async def test_a_log_out_ends_the_session_at_the_server(place: Shop) -> None:
    cookie, person = await place.log_in("novak")
    assert place.sessions == 1
    await place.persons.log_out(cookie)
    await place.empty()
    assert await place.ask(person, "Disable") == (Answer.REFUSED, Message("login-out"))
    assert place.box.requests == []


@at_the_shop()
async def test_a_log_in_without_a_sign_of_its_person_ends_after_a_time(
    place: Shop,
) -> None:
    cookie, person = await place.log_in("novak")
    place.clock.now_s += IDLE_S - 1.0
    assert place.persons.of(cookie) is person  # looking is no sign
    place.clock.now_s += 1.0
    assert place.persons.of(cookie, touch=True) is None
    assert person.ended == place.persons.why_ended(cookie) == "login-idle"
    await place.empty()
    _, person = await place.log_in("novak")
    await place.clock.move(IDLE_S + KEEP_ALIVE_S)  # nobody asks
    await until(lambda: person.ended == "login-idle")
    await place.empty()


@at_the_shop()
async def test_every_sign_of_a_person_moves_the_end_until_the_longest_time(place: Shop) -> None:
    cookie, person = await place.log_in("novak")
    began_s, passed_s = place.clock.now_s, 0.0
    while passed_s < LONGEST_S - IDLE_S:
        passed_s += IDLE_S - 1.0
        place.clock.now_s = began_s + passed_s
        if person.session.lost:  # the server itself keeps no session that is silent so long
            break
        assert place.persons.of(cookie, touch=True) is person
    place.clock.now_s = began_s + LONGEST_S - 0.001
    person.seen_s = place.clock.now_s
    assert place.persons.of(cookie) is person
    place.clock.now_s = began_s + LONGEST_S
    assert place.persons.of(cookie, touch=True) is None
    assert place.persons.why_ended(cookie) == "login-too_long"


@at_the_shop()
async def test_a_request_is_a_sign_and_an_expired_log_in_asks_for_nothing(place: Shop) -> None:
    _, person = await place.log_in("novak")
    place.clock.now_s += IDLE_S - 1.0
    assert (await place.ask(person, "Hold")).answer is Answer.ACCEPTED
    place.clock.now_s += IDLE_S - 1.0
    assert (await place.ask(person, "Resume")).answer is Answer.ACCEPTED
    place.clock.now_s += IDLE_S
    outcome = await place.ask(person, "Disable")
    assert outcome == (Answer.REFUSED, Message("login-idle"))
    assert len(place.box.requests) == 2


@at_the_shop()
async def test_a_session_that_nobody_uses_is_kept_alive_and_its_role_followed(place: Shop) -> None:
    cookie, person = await place.log_in("novak")
    assert person.role is Role.OPERATOR
    appoint(place.pairs.users, {**ROLES, "novak": Role.VIEWER})
    await place.clock.move(KEEP_ALIVE_S)
    await until(lambda: person.role is Role.VIEWER)
    assert place.persons.of(cookie) is person


@at_the_shop()
async def test_a_user_who_is_struck_off_or_has_another_password_is_logged_out(place: Shop) -> None:
    for change in (
        lambda: appoint(place.pairs.users, {"dvorak": Role.ENGINEER}),
        lambda: appoint(place.pairs.users, ROLES, "another horse battery"),
    ):
        appoint(place.pairs.users, ROLES)
        cookie, person = await place.log_in("novak")
        change()
        assert await place.ask(person, "Enable") == (Answer.REFUSED, Message("ask-role"))
        assert person.ended == "login-role_gone"
        assert place.persons.of(cookie) is None
        assert place.box.requests == []
        await place.empty()


def test_after_a_restart_of_the_loop_everybody_goes_on_without_a_password(
    runner: asyncio.Runner, loops_stage: Stage
) -> None:
    async def scene() -> None:
        other = Stage(loops_stage.pairs)
        await other.open()
        async with shop(other) as place:
            found = [await place.log_in(name) for name in ROLES]
            for _ in range(2):
                await other.close()
                await until(lambda: all(person.session.lost for _, person in found))
                for cookie, person in found:
                    outcome = await place.ask(person, "Enable")
                    assert outcome == (Answer.REFUSED, Message("login-loop_gone"))
                    assert place.persons.of(cookie) is person
                await place.clock.move(KEEP_ALIVE_S)  # it is not there yet
                await other.open()
                place.cable._target = other.server.port
                await until(lambda: not any(person.renewing for _, person in found))
                await place.clock.move(KEEP_ALIVE_S)
                await until(lambda: not any(person.session.lost for _, person in found))
                assert place.box.requests == []
            for name, (cookie, person) in zip(ROLES, found, strict=True):
                assert place.persons.of(cookie) is person
                assert (person.name, person.role, person.ended) == (name, ROLES[name], "")
                asked = await place.ask(person, "Hold")
                may = ROLES[name].at_least(Role.OPERATOR)
                assert asked.answer is (Answer.ACCEPTED if may else Answer.REFUSED)
            await place.persons.close()
            await other.close()

    runner.run(scene())


async def without_session(place: Shop, name: str = "novak") -> tuple[str, UserSession]:
    """Log somebody in and take the connection away."""
    cookie, person = await place.log_in(name)
    await place.cable.cut()
    await until(lambda: person.session.lost)
    assert place.persons.of(cookie) is person
    return cookie, person


@at_the_shop()
async def test_whoever_has_lost_the_session_ends_after_the_same_times(place: Shop) -> None:
    cookie, person = await without_session(place)
    place.clock.now_s += IDLE_S - 1.0
    assert place.persons.of(cookie, touch=True) is person
    place.clock.now_s += IDLE_S - 1.0
    assert place.persons.of(cookie) is person
    place.clock.now_s += 1.0
    assert place.persons.of(cookie, touch=True) is None
    assert place.persons.why_ended(cookie) == "login-idle"
    await place.cable.mend()
    cookie, person = await without_session(place)
    began_s = place.clock.now_s
    while place.clock.now_s - began_s < LONGEST_S - IDLE_S:
        place.clock.now_s += IDLE_S - 1.0
        assert place.persons.of(cookie, touch=True) is person
    place.clock.now_s = began_s + LONGEST_S
    assert place.persons.of(cookie, touch=True) is None
    assert place.persons.why_ended(cookie) == "login-too_long"


@at_the_shop()
async def test_whoever_is_another_one_when_the_loop_is_back_is_logged_out(place: Shop) -> None:
    for changed in (
        lambda: appoint(place.pairs.users, {"dvorak": Role.ENGINEER}),
        lambda: appoint(place.pairs.users, {**ROLES, "novak": Role.ENGINEER}),
        lambda: appoint(place.pairs.users, ROLES, "another horse battery"),
    ):
        appoint(place.pairs.users, ROLES)
        cookie, person = await without_session(place)
        changed()
        await place.cable.mend()
        await place.clock.move(KEEP_ALIVE_S)
        await until(lambda one=person: bool(one.ended))
        assert person.ended == place.persons.why_ended(cookie) == "login-role_gone"
        assert place.persons.of(cookie) is None
        assert place.box.requests == []
        await place.empty()


@at_the_shop()
async def test_the_token_of_a_log_in_ends_with_it_and_is_in_no_text(place: Shop) -> None:
    users = place.server._users
    assert users is not None
    cookie, person = await place.log_in("novak")
    token = person.session.token.reveal()
    assert await users.identify("novak", token) is not None
    assert token not in f"{person!r}{person.session!r}{person.session.token!r}{place.persons!r}"
    await place.persons.log_out(cookie)
    assert await users.identify("novak", token) is None


@at_the_shop()
async def test_who_logs_out_while_a_session_is_renewed_leaves_none(place: Shop) -> None:
    cookie, person = await without_session(place)
    token = person.session.token.reveal()
    await place.cable.mend()
    place.cable.stop()  # what is asked now is answered later
    await place.clock.move(KEEP_ALIVE_S)
    assert person.renewing
    await place.persons.log_out(cookie)
    await place.cable.mend()
    await until(lambda: not person.renewing)
    await place.empty()
    users = place.server._users
    assert users is not None
    assert await users.identify("novak", token) is None


@at_the_shop()
async def test_a_log_out_ends_every_session_that_was_opened_by_its_token(place: Shop) -> None:
    cookie, person = await place.log_in("novak")
    thief = await place.persons._session_of("novak", person.session.token)
    assert not isinstance(thief, Refusal)
    held = asks("Hold")
    for status in ("Good", "BadUserAccessDenied"):
        answer = await thief.call(held.ask.name, held.arguments, 10.0)
        assert answer is not None
        assert answer.status == status
        await place.persons.log_out(cookie)
    await thief.close()


class Gone:
    """A session that is closed, its token with it."""

    token, lost = Secret(""), True

    async def close(self) -> None: ...


@at_the_shop()
async def test_who_logs_out_without_the_loop_has_the_token_ended_when_it_is_back(
    place: Shop,
) -> None:
    users = place.server._users
    assert users is not None
    cookie, person = await without_session(place)
    token = person.session.token.reveal()
    await place.persons.log_out(cookie)
    assert place.persons.of(cookie) is None
    for number in range(100):  # who has gone for good is forgotten before
        other = replace(person, session=Gone(), ended="")
        place.persons._standing[number.to_bytes(32, "big")] = other
        place.persons._end(other, "login-out")
    await place.clock.move(KEEP_ALIVE_S)  # it is not there yet
    await until(lambda: not person.renewing)
    assert await users.identify("novak", token) is not None
    await place.cable.mend()
    await place.clock.move(KEEP_ALIVE_S)
    await until(lambda: not person.session.token)
    assert await users.identify("novak", token) is None
    assert (person.ended, place.persons.count) == ("login-out", 0)
    await place.empty()


@at_the_shop()
async def test_a_server_that_freezes_costs_nobody_the_log_in(
    place: Shop, monkeypatch: pytest.MonkeyPatch
) -> None:
    cookie, person = await place.log_in("novak")
    monkeypatch.setattr(_user_sessions, "NO_SIGN_S", 0.2)  # only what stays silent waits so long
    place.cable.stop()
    await place.clock.move(KEEP_ALIVE_S)
    await until(lambda: person.session.lost)
    monkeypatch.undo()
    assert place.persons.of(cookie) is person
    await place.cable.cut()
    await place.cable.mend()
    await place.clock.move(KEEP_ALIVE_S)
    await until(lambda: not person.session.lost)
    assert (await place.ask(person, "Hold")).answer is Answer.ACCEPTED


@at_the_shop()
async def test_what_is_remembered_of_ended_log_ins_is_bounded(place: Shop) -> None:
    cookie, person = await place.log_in("novak")
    await place.persons.log_out(cookie)
    for number in range(100):
        other = replace(person, ended="")
        place.persons._standing[number.to_bytes(32, "big")] = other
        place.persons._end(other, "login-out")
    assert len(place.persons._ended) == 16
    assert place.persons.why_ended(cookie) == ""
    await asyncio.gather(*place.persons._leaving)


# ---- requests -----------------------------------------------------------------------------------

ARGUMENTS = {
    "Trim": ("Z_um", 2.0, 3600.0),
    "Touch": ("Z_um", 2.0, 60.0),
    "Diameter": (1500.0,),
    "ChooseModel": ("new.json",),
}


@at_the_shop()
async def test_every_request_is_taken_from_whoever_may_and_from_nobody_else(place: Shop) -> None:
    for name in ("host", "novak", "dvorak"):
        _, person = await place.log_in(name)
        for ask in ASKS:
            place.box.requests.clear()
            outcome = await place.ask(person, ask.name, *ARGUMENTS.get(ask.name, ()))
            if ROLES[name].at_least(ask.role):
                assert outcome == (Answer.ACCEPTED, Message("answer-held", {"longest_s": 60.0}))
                assert place.box.requests[0].who == name
            else:
                assert outcome == (Answer.REFUSED, Message("ask-role"))
                assert place.box.requests == []
        assert not person.ended
    assert (await place.ask(person, "Trim", "Z_um", -5, 3600)).answer is Answer.ACCEPTED
    request = place.box.requests[-1]
    assert request.kind is RequestKind.TRIM
    assert (request.output, request.value, request.duration_s) == ("Z_um", -5.0, 3600.0)


@at_the_shop()
async def test_a_refusal_of_the_loop_comes_as_its_code_and_values(place: Shop) -> None:
    _, person = await place.log_in("novak")
    why = {"why": "the sensor T1 is bad\x1b[2J"}
    place.box.outcome = RequestOutcome(accepted=False, code=LoopAnswer.MODEL_UNUSABLE, values=why)
    outcome = await place.ask(person, "Enable")
    assert (outcome.answer, outcome.message.code) == (Answer.REFUSED, "answer-model_unusable")
    said = sentence_of(outcome.message)
    assert "the sensor T1 is bad" in said
    assert said.isprintable()


@at_the_shop()
async def test_a_role_that_changes_holds_from_the_next_request(place: Shop) -> None:
    _, person = await place.log_in("novak")
    assert (await place.ask(person, "Hold")).answer is Answer.ACCEPTED
    appoint(place.pairs.users, {**ROLES, "novak": Role.VIEWER})
    outcome = await place.ask(person, "Resume")
    assert outcome == (Answer.REFUSED, Message("ask-role"))
    assert person.role is Role.VIEWER
    assert not person.ended
    appoint(place.pairs.users, {**ROLES, "novak": Role.ENGINEER})
    assert (await place.ask(person, "ChooseModel", "new.json")).answer is Answer.ACCEPTED


@at_the_shop()
async def test_two_persons_ask_at_once_and_neither_waits_for_the_other(
    place: Shop,
) -> None:
    _, novak = await place.log_in("novak")
    _, dvorak = await place.log_in("dvorak")
    place.box.gate = asyncio.Event()
    both = asyncio.gather(place.ask(novak, "Hold"), place.ask(dvorak, "Resume"))
    await until(lambda: len(place.box.requests) == 2)
    place.box.gate.set()
    assert [outcome.answer for outcome in await both] == [Answer.ACCEPTED] * 2
    asked = {request.who: request.kind for request in place.box.requests}
    assert asked == {"novak": RequestKind.HOLD, "dvorak": RequestKind.RESUME}


@at_the_shop()
async def test_requests_of_one_person_that_wait_are_bounded(place: Shop) -> None:
    _, person = await place.log_in("novak")
    place.box.gate = asyncio.Event()
    waiting = [asyncio.create_task(place.ask(person, "Hold")) for _ in range(MOST_AT_ONCE)]
    await until(lambda: person.waiting == MOST_AT_ONCE)
    outcome = await place.ask(person, "Hold")
    assert outcome == (Answer.REFUSED, Message("ask-too_many"))
    place.box.gate.set()
    assert all(one.answer is Answer.ACCEPTED for one in await asyncio.gather(*waiting))
    assert len(place.box.requests) == MOST_AT_ONCE
    assert (await place.ask(person, "Hold")).answer is Answer.ACCEPTED


@at_the_shop(answer_s=0.3)
async def test_a_request_without_an_answer_says_that_it_may_still_take_effect(place: Shop) -> None:
    _, person = await place.log_in("novak")
    place.box.gate = asyncio.Event()
    outcome = await place.ask(person, "Disable")
    assert outcome == (Answer.UNKNOWN, Message("ask-no_answer"))
    assert not person.ended
    place.box.gate.set()
    place.persons._answer_s = 15.0
    assert (
        await place.ask(person, "Hold")
    ).answer is Answer.ACCEPTED  # the late answer is nobody's


@at_the_shop()
async def test_a_request_whose_connection_is_lost_says_so_at_once(place: Shop) -> None:
    _, person = await place.log_in("novak")
    place.box.gate = asyncio.Event()
    asking = asyncio.create_task(place.ask(person, "Disable"))
    await until(lambda: bool(place.box.requests))
    await place.cable.cut()
    outcome = await asking
    assert outcome == (Answer.UNKNOWN, Message("ask-lost"))
    assert not person.ended


@at_the_shop()
async def test_a_request_that_waits_for_the_loop_costs_nobody_the_log_in(
    place: Shop, monkeypatch: pytest.MonkeyPatch
) -> None:
    cookie, person = await place.log_in("novak")
    monkeypatch.setattr(_user_sessions, "NO_SIGN_S", 0.1)  # only what stays silent waits so long
    place.box.gate = asyncio.Event()
    asking = asyncio.create_task(place.ask(person, "Hold"))
    await until(lambda: bool(place.box.requests))
    for _ in range(3):
        await place.clock.move(KEEP_ALIVE_S)
    assert len(person.session._link.under_way) == 1  # nothing is heaped up behind it
    await place.persons._refresh(person)  # and one that is asked for ends nothing
    assert place.persons.of(cookie) is person
    place.box.gate.set()
    assert (await asking).answer is Answer.ACCEPTED
    assert not person.ended


@at_the_shop()
async def test_the_server_keeps_the_session_of_a_person_longer_than_any_request_may_take(
    place: Shop,
) -> None:
    await place.log_in("novak")
    inner = place.server._server
    assert inner is not None
    kept_s = [client.processor.session.session_timeout for client in inner.bserver.clients]
    assert kept_s == [90.0]
    assert kept_s[0] > _loop_session.REQUEST_S


@at_the_shop()
async def test_a_page_that_gives_a_request_up_leaves_the_session_whole(place: Shop) -> None:
    _, person = await place.log_in("novak")
    place.box.gate = asyncio.Event()
    asking = asyncio.create_task(place.ask(person, "Disable"))
    await until(lambda: bool(place.box.requests))
    asking.cancel()
    await asyncio.gather(asking, return_exceptions=True)
    assert person.waiting == 0
    place.box.gate.set()
    assert (await place.ask(person, "Hold")).answer is Answer.ACCEPTED


@at_the_shop()
async def test_a_mistake_in_the_program_is_not_hidden(place: Shop, monkeypatch) -> None:
    async def broken(*_: object) -> None:
        raise ZeroDivisionError

    cookie, _ = await place.log_in("novak")
    monkeypatch.setattr(place.persons, "_refresh", broken)
    await place.clock.move(KEEP_ALIVE_S)
    with pytest.raises(ExceptionGroup):
        place.persons.of(cookie)
    with pytest.raises(ExceptionGroup):
        await place.persons.close()
