"""The status server: the loop's status and its operators' requests, as an OPC UA server."""

import asyncio
import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import final

from asyncua import ua

from thermaxis import __version__
from thermaxis.codes import Message, Value, printable, values_as_json
from thermaxis.compensation import Request
from thermaxis.errors import ConfigurationError
from thermaxis.messages import sentence_of
from thermaxis.runtime._ports import Clock, EventRecord, LoopAnswer, RequestBox, RequestOutcome
from thermaxis.runtime.config import ServerSettings
from thermaxis.runtime.opcua import certificate_of, check_own_pair, private_key_of
from thermaxis.runtime.status._fields import (
    Kind,
    Leaf,
    Shape,
    StatusValue,
    as_json,
    leaves_of,
    shape_of,
)
from thermaxis.runtime.status._requests import ASKS, Argument, Ask
from thermaxis.runtime.status._sessions import GuardedServer, caller
from thermaxis.runtime.status._status import RuntimeStatus
from thermaxis.runtime.status._tree import (
    Tree,
    data_value,
    status_code,
    values_of,
    variant_of,
)
from thermaxis.runtime.users import ANONYMOUS, Identity, Role, Users

NAMESPACE = "urn:thermaxis:runtime"
"""Namespace of the nodes."""
PATH = "thermaxis"
"""Path in the server's address."""
PROMPT_S = 0.2
"""States and alarms are told to subscribers so soon. [s]"""
TELL_S = 1.0
"""All other values so often; a value that is read is always that of the last cycle. [s]"""
STALE_CYCLES = 3.0
"""After so many cycles without a status every value is called uncertain. [1]"""
_SHORTEST_STALE_S = 2.0
"""... but never sooner. [s]"""
_POLICIES = [
    ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt,
    ua.SecurityPolicyType.Aes128Sha256RsaOaep_SignAndEncrypt,
    ua.SecurityPolicyType.Aes256Sha256RsaPss_SignAndEncrypt,
]
_EVERYTHING = "Status/Everything"
_ANSWER_S = 10.0
_ANSWER_CYCLES = 3.0


def _no_audit(event: EventRecord) -> None:
    del event


@final
class StatusServer:
    """Shows the loop's status and takes requests, as an OPC UA server.

    A value is computed when somebody reads it: a status that nobody looks at costs nothing.
    Subscribers are told what has changed, states and alarms within 0.2 s, the rest every second.
    Should that fail it ends with all its connections, until somebody opens another: a subscriber
    never keeps a good value that nobody renews.

    Not protected: an operator who may log in may ask for everything an operator may. In `run` a
    flood of connections costs this process time, not the loop: see `Publisher`.

    Parameters
    ----------
    settings : ServerSettings
        Address, users and certificate.
    box : RequestBox
        Where requests go.
    clock : Clock
        Time.
    audit : callable, optional
        Takes log-ins and refusals. Default: nothing is kept of them.
    tokens : Path, optional
        File of the tokens that are issued. Default: they end with the server.

    """

    def __init__(
        self,
        settings: ServerSettings,
        box: RequestBox,
        clock: Clock,
        *,
        audit: Callable[[EventRecord], None] = _no_audit,
        tokens: Path | None = None,
    ) -> None:
        self._settings = settings
        self._box = box
        self._clock = clock
        self._audit = audit
        self._users = (
            None
            if settings.users is None
            else Users(settings.users, clock, self._logged_in, tokens)
        )
        self._server: GuardedServer | None = None
        self._leaves: Mapping[str, Leaf] = leaves_of(Shape()).shown
        self._shape = Shape()
        self._status: RuntimeStatus | None = None
        self._published_s = 0.0
        self._everything: tuple[RuntimeStatus | None, str] = (None, "")
        self._told: dict[str, tuple[StatusValue, bool]] = {}
        self._problem: Message | None = None
        self._task: asyncio.Task[None] | None = None
        self._ending: asyncio.Task[None] | None = None

    # ---- life -----------------------------------------------------------------------------------

    @property
    def port(self) -> int:
        """Port at which it listens, 0 while it does not. [1]"""
        server = self._server
        return 0 if server is None or server.bserver is None else server.bserver.port

    @property
    def url(self) -> str:
        """Its address, as a client states it."""
        return self._url(self.port)

    def _url(self, port: int) -> str:
        host = self._settings.address
        return f"opc.tcp://{f'[{host}]' if ':' in host else host}:{port}/{PATH}"

    async def open(self) -> None:
        """Begin to listen.

        Raises
        ------
        ConfigurationError
            If certificate or key cannot be read or do not belong together, others may read the
            key, the address is not this computer's, or the port is taken.
        """
        settings = self._settings
        anonymous = settings.anonymous_role == "viewer"
        self._published_s = self._clock.monotonic_s()
        users = self._users
        if users is not None:
            await users.open()
            self._tell_problem(users)
        server = GuardedServer(None if users is None else users.identify, anonymous=anonymous)
        await server.init()
        await self._secure(server, anonymous=anonymous)
        server.set_endpoint(self._url(settings.port))
        server.set_server_name("thermaxis")
        tree = Tree(server, await server.register_namespace(NAMESPACE), self._read)
        await tree.add_leaves(tuple(self._leaves.values()))
        await self._make_methods(tree)
        try:
            await server.start()
        except OSError as error:
            if users is not None:
                await users.close()
            raise ConfigurationError(
                "cannot_listen",
                cause=error.strerror or str(error),
                port=settings.port,
                file=settings.address,
                key="server",
            ) from None
        self._server = server
        self._told.clear()
        self._task = asyncio.create_task(self._tell(tree), name="status server")
        self._task.add_done_callback(self._telling_ended)

    async def _secure(self, server: GuardedServer, *, anonymous: bool) -> None:
        """Give the server its certificate and the ways in that the settings allow."""
        settings = self._settings
        policies = [ua.SecurityPolicyType.NoSecurity] if anonymous else []
        uri = f"{NAMESPACE}:server"
        if settings.certificate is not None and settings.private_key is not None:
            policies = [*policies, *_POLICIES]
            own, key = certificate_of(settings.certificate), private_key_of(settings.private_key)
            uri = own.application_uris[0] if own.application_uris else uri
            check_own_pair(own, key, uri, file=str(settings.certificate))
            server.iserver.certificate, server.iserver.private_key = own.parsed, key
        server.set_security_policy(policies)
        server.product_uri = NAMESPACE
        server.manufacturer_name = "thermaxis"
        await server.set_application_uri(uri)
        started = self._clock.utc()
        await server.set_build_info(NAMESPACE, "thermaxis", "thermaxis", __version__, "", started)

    def publish(self, status: RuntimeStatus) -> None:
        """Show a status. Returns at once; nothing is computed here that nobody asks for.

        Parameters
        ----------
        status : RuntimeStatus
            Status after a cycle.
        """
        self._published_s = self._clock.monotonic_s()
        shape = shape_of(status)
        if shape != self._shape:
            self._shape = shape
            self._leaves = leaves_of(shape).shown
        self._status = status

    async def close(self) -> None:
        """End; every connection is closed."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
            self._task = None
        if self._ending is not None:
            await asyncio.gather(self._ending, return_exceptions=True)
            self._ending = None
        await self._stop()

    async def _stop(self) -> None:
        server, self._server = self._server, None
        if server is not None:
            await server.stop()
            if self._users is not None:
                await self._users.close()

    # ---- what is read ---------------------------------------------------------------------------

    def _stale(self) -> bool:
        """Whether the last status is too old to be called the present one."""
        cycle_s = 0.0 if self._status is None else self._status.cycle_s
        age_s = self._clock.monotonic_s() - self._published_s
        return age_s > max(STALE_CYCLES * cycle_s, _SHORTEST_STALE_S)

    def _told_now(self, path: str) -> StatusValue:
        status = self._status
        if status is None:
            return StatusValue(None, "BadWaitingForInitialData")
        leaf = self._leaves.get(path)
        if leaf is None:
            return StatusValue(None, "BadNoData")
        if path == _EVERYTHING:
            if self._everything[0] is not status:
                self._everything = (status, as_json(status))
            return StatusValue(self._everything[1])
        return leaf.read(status)

    def _read(self, path: str) -> ua.DataValue:
        """Return the present value of a path, when a client reads it."""
        return self._as_value(path, self._told_now(path), stale=self._stale())

    def _as_value(self, path: str, told: StatusValue, *, stale: bool) -> ua.DataValue:
        leaf, status = self._leaves.get(path), self._status
        quality = told.quality
        if stale and not quality.startswith("Bad"):
            quality = "UncertainLastUsableValue"
        time = told.time or (None if status is None else status.utc)
        kind = Kind.TEXT if leaf is None else leaf.field.kind
        return data_value(kind, told.value, quality, time, self._clock.utc())

    # ---- what is told to subscribers ------------------------------------------------------------

    def _telling_ended(self, task: asyncio.Task[None]) -> None:
        """End after a failure: a good value that no longer changes deceives."""
        error = None if task.cancelled() else task.exception()
        if error is None or task is not self._task:
            return
        self._task = None
        values = {"detail": printable(repr(error), 200)}
        self._tell_event("alarm", "", "event-status_server_ended", values)
        self._ending = asyncio.create_task(self._stop(), name="end of the status server")

    async def _tell(self, tree: Tree) -> None:
        """Tell subscribers what has changed, and make the nodes of a new shape."""
        due_s = self._clock.monotonic_s()
        told_s = due_s
        made = Shape()
        while True:
            due_s = max(due_s, self._clock.monotonic_s() - PROMPT_S) + PROMPT_S
            await self._clock.sleep_until(due_s)
            if self._shape != made:
                made = self._shape
                await tree.add_leaves(tuple(self._leaves.values()))
            everything = due_s >= told_s + TELL_S
            if everything:
                told_s = due_s
            await self._tell_changes(tree, everything=everything)

    async def _tell_changes(self, tree: Tree, *, everything: bool) -> None:
        stale = self._stale()
        for path in tree.watched():
            leaf = self._leaves.get(path)
            if not (everything or (leaf is not None and leaf.field.prompt)):
                continue
            told = self._told_now(path)
            if self._told.get(path) != (told, stale):
                self._told[path] = (told, stale)
                await tree.tell(path, self._as_value(path, told, stale=stale))

    # ---- requests -------------------------------------------------------------------------------

    async def _make_methods(self, tree: Tree) -> None:
        for ask in ASKS:
            await tree.add_method(
                ask.name, ask.text, (ask.arguments, _ANSWER), partial(self._asked, ask)
            )
        await tree.add_method("WhoAmI", "Name and role of the caller.", ((), _WHO), self._who_am_i)
        text = "A token that stands for the caller's password for eight hours."
        await tree.add_method("IssueToken", text, ((), (_TOKEN,)), self._issue_token)
        text = "End a token of the caller."
        await tree.add_method("RevokeToken", text, ((_TOKEN,), ()), self._revoke_token)

    async def _role_of(self, identity: Identity) -> Role:
        if identity == ANONYMOUS or self._users is None:
            return Role(self._settings.anonymous_role)
        role = await self._users.role_now(identity)
        self._tell_problem(self._users)
        return role

    async def _who_am_i(self, arguments: Sequence[ua.Variant]) -> list[ua.Variant] | ua.StatusCode:
        if arguments:
            return status_code("BadTooManyArguments")
        identity = caller()
        role = await self._role_of(identity)
        return [variant_of(identity.name), variant_of(role.value)]

    async def _issue_token(
        self, arguments: Sequence[ua.Variant]
    ) -> list[ua.Variant] | ua.StatusCode:
        token = "" if self._users is None else await self._users.issue_token(caller())
        if not token:
            return status_code("BadUserAccessDenied")
        return status_code("BadTooManyArguments") if arguments else [variant_of(token)]

    async def _revoke_token(
        self, arguments: Sequence[ua.Variant]
    ) -> list[ua.Variant] | ua.StatusCode:
        values, wrong = values_of((_TOKEN,), arguments)
        if wrong:
            return status_code(wrong)
        if self._users is not None:
            await self._users.revoke_token(caller(), str(values[0]))
        return []

    async def _asked(
        self, ask: Ask, arguments: Sequence[ua.Variant]
    ) -> list[ua.Variant] | ua.StatusCode:
        """Return the answer to a call, or the status code that refuses it."""
        identity = caller()
        role = await self._role_of(identity)
        if not role.at_least(ask.role):
            self._refused(identity, ask, role)
            return status_code("BadUserAccessDenied")
        values, wrong = values_of(ask.arguments, arguments)
        if wrong:
            return status_code(wrong)
        outcome = await self._submit(ask.request(identity.name, values))
        told = json.dumps(values_as_json(outcome.values))
        sentence = sentence_of(outcome.message)
        return [variant_of(one) for one in (outcome.accepted, sentence, outcome.code, told)]

    async def _submit(self, request: Request) -> RequestOutcome:
        """Hand a request to the loop and wait for its answer within a bound."""
        cycle_s = 0.0 if self._status is None else self._status.cycle_s
        try:
            async with asyncio.timeout(max(_ANSWER_S, _ANSWER_CYCLES * cycle_s)):
                return await self._box.submit(request)
        except TimeoutError:
            return RequestOutcome(accepted=False, code=LoopAnswer.NO_ANSWER)

    # ---- audit ----------------------------------------------------------------------------------

    def _refused(self, identity: Identity, ask: Ask, role: Role) -> None:
        values = {"method": ask.name, "role": role.value, "needed": ask.role.value}
        self._tell_event("request", identity.name, "event-role_refused", values)

    def _logged_in(self, name: str, right: bool) -> None:  # noqa: FBT001 - as Users tells it
        shown = printable(name, 70)
        code = "event-logged_in" if right else "event-log_in_refused"
        self._tell_event("connection", shown, code, {"name": shown})
        if self._users is not None:
            self._tell_problem(self._users)

    def _tell_problem(self, users: Users) -> None:
        """Tell once that the file of users cannot be read, and that it can be again."""
        problem = users.problem
        if problem != self._problem:
            self._problem = problem
            if problem is not None:
                self._tell_event("alarm", "", "event-users_unreadable", {"problem": problem})
            else:
                self._tell_event("alarm", "", "event-users_readable", {})

    def _tell_event(self, kind: str, who: str, code: str, values: Mapping[str, Value]) -> None:
        self._audit(EventRecord.of(self._clock.utc(), kind, who, Message(code, values)))


_ANSWER = (
    Argument("accepted", Kind.FLAG, "Whether it takes effect."),
    Argument("reason", Kind.TEXT, "Why not, or what follows, in English."),
    Argument("code", Kind.TEXT, "The same as a code."),
    Argument("values", Kind.TEXT, "Values that belong to the code, JSON."),
)
_TOKEN = Argument("token", Kind.TEXT, "The token.")
_WHO = (
    Argument("name", Kind.TEXT, "Name that was given at log-in; empty without one."),
    Argument("role", Kind.TEXT, "Role that it has now."),
)
