"""The stand-in for log-ins holds to what the program's own do, so that pages meet no other."""

import asyncio
import inspect
from collections.abc import Awaitable, Callable
from types import MethodType

import pytest

from tests.unit.runtime.status_server_parts import PASSWORD as PASSWORD_AT_THE_LOOP
from tests.unit.screen.people import HERE, PASSWORD, People
from tests.unit.screen.person_parts import Stage, appoint, asks, shop
from thermaxis.codes import Message
from thermaxis.runtime import Role, SystemClock
from thermaxis.screen.access import Answer, UserSession, UserSessions
from thermaxis.screen.access._user_sessions import Refusal

OWN = {"person", "come", "lose", "end", "end_cookie"}
"""What only the stand-in has: a test moves it so."""
ROLES = {role.value: role for role in Role if role is not Role.NONE}


def public(kind: type) -> dict[str, object]:
    """Return what others may call, as they have to call it."""
    found: dict[str, object] = {}
    for name, member in inspect.getmembers_static(kind):
        if name.startswith("_"):
            continue
        if isinstance(member, property):
            found[name] = "property"
        else:
            asked = inspect.signature(member).parameters.values()
            shape = [(one.name, one.kind, one.default) for one in asked]
            found[name] = (inspect.iscoroutinefunction(member), shape)
    return found


def test_the_stand_in_is_called_as_persons_are() -> None:
    stand_in = public(People)
    assert set(stand_in) == set(public(UserSessions)) | OWN
    for name, how in public(UserSessions).items():
        assert stand_in[name] == how, name


# ---- the same scenes for both -------------------------------------------------------------------

Scene = Callable[[UserSessions, str, Callable[[UserSession], Awaitable[None]]], Awaitable[None]]


@pytest.fixture(params=["the stand-in", "the program's own"])
def play(
    request: pytest.FixtureRequest, runner: asyncio.Runner, loops_stage: Stage
) -> Callable[[Scene], None]:
    async def before_people(scene: Scene) -> None:
        people = People(SystemClock())

        async def lose(person: UserSession) -> None:
            people.lose(person)

        await people.open()
        await scene(people, PASSWORD, lose)
        await people.close()

    async def before_persons(scene: Scene) -> None:
        async with asyncio.timeout(50.0), shop(loops_stage) as place:
            appoint(place.pairs.users, ROLES)

            async def lose(person: UserSession) -> None:
                person.session.give_up()

            await scene(place.persons, PASSWORD_AT_THE_LOOP, lose)

    chosen = before_people if request.param == "the stand-in" else before_persons
    return lambda scene: runner.run(chosen(scene))


async def logged_in(persons: UserSessions, name: str, password: str) -> tuple[str, UserSession]:
    found = await persons.log_in(name, password, HERE)
    assert not isinstance(found, Refusal), found
    return found


def test_somebody_comes_is_known_by_the_cookie_alone_and_goes(play) -> None:
    async def scene(persons: UserSessions, password: str, _: MethodType) -> None:
        for name, role in ROLES.items():
            cookie, person = await logged_in(persons, name, password)
            assert (person.name, person.role) == (name, role)
            assert person.ended == ""
            assert persons.of(cookie) is person
            assert persons.of(cookie, touch=True) is person
            assert persons.why_ended(cookie) == ""
            assert persons.count == 1
            for other in (None, "", cookie + "x", person.token):
                assert persons.of(other) is None
                await persons.log_out(other)
            assert persons.of(cookie) is person
            await persons.log_out(cookie)
            assert persons.of(cookie) is None
            assert person.ended == persons.why_ended(cookie) == "login-out"
            assert persons.count == 0

    play(scene)


def test_a_wrong_name_or_password_comes_to_nothing(play) -> None:
    async def scene(persons: UserSessions, password: str, _: MethodType) -> None:
        for name, given in (("operator", "wrong"), ("nobody", password), ("", ""), ("none", "x")):
            assert await persons.log_in(name, given, HERE) == Refusal("login-refused")
        assert persons.count == 0

    play(scene)


def test_whoever_has_lost_the_session_asks_for_nothing_nor_after_the_end(play) -> None:
    async def scene(persons: UserSessions, password: str, lose: MethodType) -> None:
        cookie, person = await logged_in(persons, "engineer", password)
        await lose(person)
        assert persons.of(cookie) is person
        assert (person.role, person.ended) == (Role.ENGINEER, "")
        outcome = await persons.ask(person, asks("Hold"))
        assert outcome == (Answer.REFUSED, Message("login-loop_gone"))
        cookie, person = await logged_in(persons, "engineer", password)
        trim = asks("Trim", "Z_um", -5, 3600)
        assert (await persons.ask(person, trim)).answer is Answer.ACCEPTED
        await persons.log_out(cookie)
        assert await persons.ask(person, trim) == (Answer.REFUSED, Message("login-out"))

    play(scene)


def test_the_end_of_the_screen_ends_every_log_in_and_lets_nobody_in(play) -> None:
    async def scene(persons: UserSessions, password: str, _: MethodType) -> None:
        found = [await logged_in(persons, name, password) for name in ROLES]
        await persons.close()
        assert {person.ended for _, person in found} == {"login-out"}
        assert {persons.why_ended(cookie) for cookie, _ in found} == {"login-out"}
        assert persons.count == 0
        assert await persons.log_in("operator", password, HERE) == Refusal("login-busy")

    play(scene)
