"""Who may ask the loop for something: users, roles, and passwords that nobody can read back.

A file of users is TOML, written by ``thermaxis user`` and readable by its owner only::

    [[user]]
    name = "novak"
    role = "operator"
    hash = "$argon2id$v=19$m=19456,t=2,p=1$..."

It is read again when it changes. While it cannot be read nobody is known: the safe side.
"""

import asyncio
import contextlib
import hmac
import os
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import StrEnum
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple, TypeVar, TypeVarTuple, cast, final

from argon2 import PasswordHasher, Type, extract_parameters
from argon2.exceptions import InvalidHashError, VerificationError

from thermaxis.codes import Message, Place
from thermaxis.errors import ConfigurationError, ThermaxisError
from thermaxis.files.settings import parse_toml
from thermaxis.runtime._ports import Clock
from thermaxis.runtime.host import read_private, whole_file
from thermaxis.runtime.users._throttle import PIN_REFUSED_S, LogInThrottle
from thermaxis.runtime.users._tokens import IssuedToken, IssuedTokens, may_be_token

LONGEST_NAME = 64
"""Longest name of a user. [1]"""
LONGEST_PASSWORD = 1024
"""Longest password, in bytes of UTF-8. [byte]"""
SHORTEST_PASSWORD = 8
"""Shortest password that is accepted for a new user. Origin: NIST SP 800-63B, 5.1.1.1. [1]"""
SHORTEST_PIN = 6
"""Fewest digits of a PIN. Origin: with five tries in five minutes a guesser needs a year. [1]"""
LONGEST_PIN = 32
"""Most digits of a PIN. [1]"""
PIN_MARK = "\0pin:"
"""Stands before a PIN in place of a password: said by a screen that has judged the panel."""
MOST_USERS = 1000
"""Largest number of users in a file. [1]"""
LARGEST_FILE_BYTES = 1_000_000
"""Largest file of users. [byte]"""

HASH_MEMORY_KIB = 19_456
"""Memory of one hash. Origin: OWASP's first choice for argon2id; the 64 MiB of RFC 9106 would take
a third of what the whole loop may use. [KiB]"""
HASH_PASSES = 2
"""Passes over that memory. Origin: as above. [1]"""
_LARGEST_MEMORY_KIB = 262_144
_MOST_PASSES = 20
_T = TypeVar("_T")
_Ts = TypeVarTuple("_Ts")
_NAME = Place(key="name")
_NAME_SIGNS = frozenset("-_.@ ")


class Role(StrEnum):
    """What a user may do; every role may do what the ones before it may."""

    NONE = "none"
    """Nothing, not even look."""
    VIEWER = "viewer"
    """Look."""
    OPERATOR = "operator"
    """Enable, disable, hold, resume, trim, state a diameter, acknowledge."""
    ENGINEER = "engineer"
    """Choose another model as well."""

    def at_least(self, other: "Role") -> bool:
        """Return whether this role may do what another may."""
        order = list(Role)
        return order.index(self) >= order.index(other)


@final
@dataclass(frozen=True, slots=True)
class User:
    """One entry of a file of users."""

    name: str
    """Name that is given at log-in."""
    role: Role
    """What the user may do."""
    hash: str
    """The password's argon2id hash, with its salt and parameters."""
    pin: str = ""
    """The same of the PIN of an operator; empty without one."""

    def __repr__(self) -> str:
        """Return name and role; a hash belongs in no log."""
        return f"User({self.name!r}, {self.role})"


class Identity(NamedTuple):
    """Who has logged in, and with which password: a changed one ends what the old one allowed."""

    name: str
    """Name of the user; empty for somebody without one."""
    hash: str = ""
    """Hash that the password was checked against."""
    token: IssuedToken | None = None
    """What stood for the password, if a token did: it ends with that."""


ANONYMOUS = Identity("")
"""Somebody without a name."""


def hash_password(password: str) -> str:
    """Return the argon2id hash of a password, with a salt of its own.

    Returns
    -------
    str
        The hash in the usual text form, which names its parameters.

    Raises
    ------
    ConfigurationError
        If the password is shorter than 8 characters or longer than 1024 bytes.

    References
    ----------
    RFC 9106 (argon2); OWASP Password Storage Cheat Sheet (parameters).
    """
    if len(password) < SHORTEST_PASSWORD:
        raise ConfigurationError("password_short", fewest=SHORTEST_PASSWORD, key="password")
    if len(password.encode()) > LONGEST_PASSWORD:
        raise ConfigurationError(
            "text_too_long",
            characters=len(password.encode()),
            most=LONGEST_PASSWORD,
            key="password",
        )
    return _hasher().hash(password)


def hash_pin(pin: str) -> str:
    """Return the argon2id hash of a PIN.

    Raises
    ------
    ConfigurationError
        If it is not of 6 to 32 digits.
    """
    if not (SHORTEST_PIN <= len(pin) <= LONGEST_PIN and pin.isascii() and pin.isdigit()):
        raise ConfigurationError("no_pin", fewest=SHORTEST_PIN, key="pin")
    return _hasher().hash(pin)


def _hasher() -> PasswordHasher:
    return PasswordHasher(
        time_cost=HASH_PASSES, memory_cost=HASH_MEMORY_KIB, parallelism=1, type=Type.ID
    )


def check_name(name: str, place: Place = _NAME) -> str:
    """Return the name of a user if it may stand in the file, in logs and on a screen.

    It has letters, digits, space and ``- _ . @`` only, and neither begins nor ends with a space.
    """
    fits = 0 < len(name) <= LONGEST_NAME and name == name.strip()
    if not (fits and all(sign.isalnum() or sign in _NAME_SIGNS for sign in name)):
        raise ConfigurationError("no_user_name", name=name, most=LONGEST_NAME, place=place)
    return name


def read_users(path: Path | str) -> tuple[User, ...]:
    """Read a file of users."""
    place = Place(str(path))
    tables = parse_toml(read_private(Path(path), limit_bytes=LARGEST_FILE_BYTES), file=str(path))
    entries = tables.pop("user", [])
    if tables or not isinstance(entries, list):
        raise ConfigurationError("not_a_user_table", name=next(iter(tables), "user"), place=place)
    rows = cast("list[object]", entries)
    if len(rows) > MOST_USERS:
        raise ConfigurationError("too_many_users", most=MOST_USERS, place=place)
    users = tuple(_user(row, place._replace(key=f"user {i}")) for i, row in enumerate(rows, 1))
    names = [user.name for user in users]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ConfigurationError("stated_twice", name=twice, place=place)
    return users


def _user(row: object, place: Place) -> User:
    if not isinstance(row, dict):
        raise ConfigurationError("not_a_table", place=place)
    entry = cast("dict[str, object]", row)
    texts = {key: value for key, value in entry.items() if isinstance(value, str)}
    if set(texts) - {"pin"} != {"name", "role", "hash"} or len(entry) != len(texts):
        raise ConfigurationError("user_keys", place=place)
    roles = [role.value for role in Role if role is not Role.NONE]
    if texts["role"] not in roles:
        raise ConfigurationError(
            "unknown_choice", name=texts["role"], known=tuple(roles), place=place
        )
    name = check_name(texts["name"], place)
    pin = _checked_hash(texts["pin"], place) if "pin" in texts else ""
    return User(name, Role(texts["role"]), _checked_hash(texts["hash"], place), pin)


def _checked_hash(text: str, place: Place) -> str:
    """Return a hash if checking a password against it takes reasonable time and memory."""
    try:
        found = extract_parameters(text)
    except ValueError:
        found = None
    if (
        found is None
        or found.type is not Type.ID
        or found.memory_cost > _LARGEST_MEMORY_KIB
        or found.time_cost > _MOST_PASSES
        or found.parallelism > _MOST_PASSES
    ):
        raise ConfigurationError("no_argon2id_hash", place=place)
    return text


def write_users(users: Sequence[User], path: Path | str) -> None:
    """Write a file of users beside the old one and put it in its place."""
    target = Path(path).resolve()
    text = "".join(
        f'[[user]]\nname = "{check_name(u.name)}"\nrole = "{u.role}"\nhash = "{u.hash}"\n'
        + (f'pin = "{u.pin}"\n\n' if u.pin else "\n")
        for u in users
    )
    with whole_file(target, mode=0o600) as stream:
        stream.write(text.encode())


def _without_folder(error: ThermaxisError) -> Message:
    """Return what is told of an error on a page."""
    place = error.place
    return error.at(place._replace(file=Path(place.file).name)).message


@final
class Users:
    """The users of a file: who somebody is, and what they may do now.

    Passwords are checked in a thread of its own, one after the other, at a lower priority where
    the system knows one: argon2 is slow by design and must not delay the loop. A name that does
    not exist takes the same time as one that does.

    A PIN is taken from this computer only, where the screen stands that has judged the panel, for
    an operator only, and after five failures with one name for five minutes not at all.

    Not protected: whoever may write the file may do everything; who may run programs on this
    computer may try PINs as at a panel.
    """

    def __init__(
        self,
        path: Path,
        clock: Clock,
        tell: Callable[[str, bool], None] | None = None,
        tokens: Path | None = None,
    ) -> None:
        self._path = path
        self._tokens = IssuedTokens(tokens)
        self._clock = clock
        self._tell = tell
        self._throttle, self._renewals = LogInThrottle(), LogInThrottle()
        self._pins: dict[str, LogInThrottle] = {}
        self._issued = LogInThrottle()
        self._users: Mapping[str, User] = {}
        self._stamp: object = None
        self._problem: Message | None = Message("why-no_file")
        self._reading = threading.Lock()
        self._thread = ThreadPoolExecutor(1, "thermaxis-users", _step_back)
        self._nobody = _hasher().hash(os.urandom(16).hex())

    @property
    def problem(self) -> Message | None:
        """Why nobody is known; None while the file is good."""
        return self._problem

    def _read_again(self) -> None:
        """Read the file if it is another one than before."""
        with self._reading:
            try:
                found = self._path.stat()
                stamp: object = (found.st_mtime_ns, found.st_size, found.st_ino, found.st_mode)
            except OSError:
                stamp = None
            if stamp is not None and stamp == self._stamp:
                return
            try:
                users = read_users(self._path)
            except ThermaxisError as error:
                self._users, self._problem = {}, _without_folder(error)
            else:
                self._users, self._problem = {user.name: user for user in users}, None
            self._stamp = stamp

    async def open(self) -> None:
        """Read the file; a bad one is told by `problem` and read again when it changes."""
        await asyncio.to_thread(self._read_again)
        await asyncio.to_thread(self._tokens.read)

    async def close(self) -> None:
        """End the thread; a password that is being checked is waited for."""
        await asyncio.to_thread(self._thread.shutdown, wait=True, cancel_futures=True)

    async def identify(self, name: str, password: str, address: str = "") -> Identity | None:
        """Return who logs in from an address; None: name or password is wrong, or too many were.

        A token stands for the password until it ends; guesses at others keep nobody from that, and
        one that has ended keeps nobody from a password: what may be a token is counted apart.
        """
        now_s = self._clock.monotonic_s()
        name = name[: LONGEST_NAME + 1]
        renewed = await asyncio.to_thread(self._renewed, name, password, address)
        if renewed is not None:
            self._told(name, right=True)
            return renewed
        pin = password.startswith(PIN_MARK)
        ended = self._renewals if may_be_token(password) else self._throttle
        throttle = self._throttle_of_pins(name) if pin else ended
        if (pin and address) or throttle.refused(name, address, now_s) is not None:
            return None
        throttle.count(name, address, now_s)
        found = await self._in_turn(self._checked, name, password)
        if found is not None:
            throttle.succeeded(name, address)
        self._told(name, right=found is not None)
        return found

    async def _in_turn(self, act: Callable[[*_Ts], _T], *given: *_Ts) -> _T:
        return await asyncio.get_running_loop().run_in_executor(self._thread, act, *given)

    def _throttle_of_pins(self, name: str) -> LogInThrottle:
        """Return what counts the PINs of a name; of one that has none, nothing is kept."""
        user, new = self._users.get(name), LogInThrottle(PIN_REFUSED_S, local_share=1)
        return self._pins.setdefault(name, new) if user is not None and user.pin else new

    def _told(self, name: str, *, right: bool) -> None:
        if self._tell is not None:
            self._tell(name, right)

    def _checked(self, name: str, password: str) -> Identity | None:
        self._read_again()
        user = self._users.get(name)
        known = "" if user is None else user.hash
        if password.startswith(PIN_MARK):
            known = user.pin if user is not None and user.role is Role.OPERATOR else ""
            password = password.removeprefix(PIN_MARK)
        fits = len(name) <= LONGEST_NAME and len(password.encode()) <= LONGEST_PASSWORD
        right = False
        with contextlib.suppress(VerificationError, InvalidHashError):
            right = PasswordHasher().verify(known or self._nobody, password if fits else "")
        return Identity(name, known) if known and right and fits else None

    def _renewed(self, name: str, token: str, address: str) -> Identity | None:
        """Return whose token it is, if user, password and role are those that it was issued to.

        One that was issued after a PIN is taken where the PIN is.
        """
        self._read_again()
        found, user = self._tokens.find(token, self._clock.utc()), self._users.get(name)
        if found is None or user is None:
            return None
        for known in (user.hash,) if address else (user.hash, user.pin):
            if hmac.compare_digest(found.holder, _holder(user, known)):
                return Identity(name, known, found)
        return None

    async def role_now(self, identity: Identity) -> Role:
        """Return what somebody who has logged in may do now."""
        user = await self._user_of(identity)
        return Role.NONE if user is None else user.role

    async def _user_of(self, identity: Identity) -> User | None:
        await asyncio.to_thread(self._read_again)  # never behind a password that is being checked
        user, token = self._users.get(identity.name), identity.token
        if user is None or not identity.hash:
            return None
        if token is not None and not self._tokens.stands(token, self._clock.utc()):
            return None
        by_pin = identity.hash == user.pin and user.role is Role.OPERATOR
        return user if by_pin or identity.hash == user.hash else None

    async def issue_token(self, identity: Identity) -> str:
        """Return what stands for the password of somebody who has logged in, for some hours.

        It ends with `revoke_token`, and as soon as the user, the password or the role is another
        one. A token buys no other: nothing is issued to whoever has logged in by one, nor to
        whoever is nobody now, nor more often than passwords of a name are tried: each is written.
        """
        user, now_s = await self._user_of(identity), self._clock.monotonic_s()
        if user is None or identity.token is not None:
            return ""
        if self._issued.refused(user.name, "", now_s) is not None:
            return ""
        self._issued.count(user.name, "", now_s)
        return await self._in_turn(
            self._tokens.issue, _holder(user, identity.hash), self._clock.utc()
        )

    async def revoke_token(self, identity: Identity, token: str) -> None:
        """End a token of somebody, and what every session that was opened by it allows."""
        user = await self._user_of(identity)
        if user is not None:
            await self._in_turn(self._tokens.revoke, token, _holder(user, identity.hash))


def _holder(user: User, known: str) -> str:
    """Return what a token remembers of a user, and of the password or PIN of the log-in."""
    return sha256(f"{user.name}\n{user.role}\n{known}".encode()).hexdigest()


def _step_back() -> None:
    """Let the thread give way to the loop, where the system knows priorities of threads."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), 10)
