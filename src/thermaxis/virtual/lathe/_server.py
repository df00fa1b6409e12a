"""The virtual lathe as an OPC UA server.

A value that is read is that of this very moment; subscribers are told ten times a second. Node
ids are the names of the lathe's signals, such as ``ns=2;s=T_spindle_C``, in the namespace
`NAMESPACE`.

Not protected: whoever reaches the server may write its offset, unless it was made with a user.
"""

# asyncua declares the fields of its structures as number types of its own, which plain numbers
# are not, and leaves many members without a type:
# pyright: reportArgumentType=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

import hmac
import math
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, final

from asyncua import ua
from asyncua.crypto.permission_rules import User, UserRole
from asyncua.server.server import Server
from asyncua.server.user_managers import UserManager
from asyncua.ua.attribute_ids import AttributeIds
from asyncua.ua.status_codes import StatusCodes

from thermaxis.errors import ConfigurationError, require_positive, require_range
from thermaxis.runtime import Clock, Secret
from thermaxis.runtime.host import is_loopback
from thermaxis.virtual.lathe._faults import FaultKind
from thermaxis.virtual.lathe._gate import NetworkGate
from thermaxis.virtual.lathe._machine import VirtualLathe
from thermaxis.virtual.lathe._signals import SIGNALS, LatheReading

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Mapping

    from asyncua.common.node import Node
    from asyncua.server.address_space import AttributeValue, NodeData

NAMESPACE: Final = "urn:thermaxis:lathe"
"""Namespace of the lathe's nodes."""
APPLICATION: Final = "urn:thermaxis:lathe:server"
"""Application URI of the server; a certificate must bear it."""
PATH: Final = "lathe"
"""Path in the server's address."""
DEFAULT_PORT: Final = 4840
"""Port of OPC UA. [1]"""
FASTEST: Final = 3600.0
"""Largest factor of the machine's time: an hour per second. [1]"""
_TELL_S = 0.1
_SAME_MOMENT_S = 0.005
_UNITS = {
    "degC": ("CEL", "°C", "degree Celsius"),
    "um": ("4H", "µm", "micrometre"),
    "mm": ("MMT", "mm", "millimetre"),
    "rpm": ("RPM", "r/min", "revolutions per minute"),
    "s": ("SEC", "s", "second"),
}
_UNIT_NAMESPACE = "http://www.opcfoundation.org/UA/units/un/cefact"
_TYPES = {"bool": ua.VariantType.Boolean, "1": ua.VariantType.UInt32}
_NULL = ua.Variant(None, ua.VariantType.Null)
_codes: dict[str, ua.StatusCode] = {}


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class LatheServerSettings:
    """Where and how the lathe is served.

    Raises
    ------
    ConfigurationError
        If the speed is not from above 0 to 3600, certificate, key, user and password do not go
        together, or another address than this computer's own is asked for.
    """

    address: str = "127.0.0.1"
    """Address of this computer to listen on."""
    port: int = DEFAULT_PORT
    """Port to listen on; 0 for a free one. [1]"""
    speed: float = 1.0
    """How many times faster than real time the machine lives. [1]"""
    certificate: Path | None = None
    """Certificate of the server; with it every message is signed and encrypted."""
    private_key: Path | None = None
    user: str = ""
    """Name of the only user; empty: anybody."""
    password: Secret = field(default_factory=lambda: Secret(""))

    def __post_init__(self) -> None:
        """Check the settings against each other."""
        require_positive("--speed", self.speed, FASTEST)
        require_range("--port", self.port, 0, 65_535)
        if (self.certificate is None) != (self.private_key is None):
            raise ConfigurationError("certificate_without_key", key="--certificate, --private-key")
        if bool(self.user) != bool(self.password):
            raise ConfigurationError("user_without_password", key="--user, --password-file")
        if self.user and self.certificate is None:
            raise ConfigurationError("password_unencrypted", key="--user")
        if not is_loopback(self.address):
            raise ConfigurationError("other_computer", key="--address")


@final
class _OneUser(UserManager):
    """Lets one user in, or anybody where there is none."""

    def __init__(self, name: str, password: Secret) -> None:
        self._name, self._password = name, password

    def get_user(
        self,
        iserver: object,
        username: str | None = None,
        password: str | None = None,
        certificate: object = None,
    ) -> User | None:
        """Return the user, None for a stranger."""
        del iserver, certificate
        if not self._name:
            return User(role=UserRole.User)
        known = hmac.compare_digest((username or "").encode(), self._name.encode())
        right = Secret(password or "") == self._password
        return User(role=UserRole.User, name=self._name) if known and right else None


def status_code(name: str) -> ua.StatusCode:
    """Return a status code by its name, such as ``BadSensorFailure``."""
    if name not in _codes:
        _codes[name] = ua.StatusCode(getattr(StatusCodes, name))
    return _codes[name]


def unit_of(unit: str) -> ua.EUInformation | None:
    """Return a unit as OPC UA states it.

    References
    ----------
    OPC 10000-8, 5.6.3: the number of a unit is its UN/CEFACT code, read as bytes.
    """
    if unit not in _UNITS:
        return None
    code, shown, words = _UNITS[unit]
    return ua.EUInformation(
        NamespaceUri=_UNIT_NAMESPACE,
        UnitId=int.from_bytes(code.encode("ascii"), "big"),
        DisplayName=ua.LocalizedText(shown),
        Description=ua.LocalizedText(words),
    )


@final
class LatheServer:
    """Serves a virtual lathe, whose time goes on with a clock.

    Not protected: see the module.

    Parameters
    ----------
    lathe : VirtualLathe
        The machine; from the start on it belongs to the server.
    settings : LatheServerSettings
        Where and how.
    clock : Clock
        Time.
    """

    def __init__(self, lathe: VirtualLathe, settings: LatheServerSettings, clock: Clock) -> None:
        self._lathe = lathe
        self._settings = settings
        self._clock = clock
        self._gate = NetworkGate(settings.address, settings.port)
        self._server = Server(user_manager=_OneUser(settings.user, settings.password))
        self._held: dict[str, AttributeValue] = {}
        self._ids: dict[str, ua.NodeId] = {}
        self._types: dict[str, ua.VariantType] = {}
        self._begin_s = 0.0
        self._read_s = -math.inf
        self._readings: Mapping[str, LatheReading] = {}
        self._now = datetime.now(UTC)
        self._stamps: dict[str, tuple[float, datetime]] = {}
        self._telling = False

    @property
    def endpoint(self) -> str:
        """Address of the server, once it has started."""
        return f"opc.tcp://{self._settings.address}:{self._gate.port}/{PATH}"

    def set_speed(self, speed: float) -> None:
        """Let the machine live so many times faster than real time from now on. [1]

        A speed that `LatheServerSettings` does not take is refused.
        """
        self._settings = replace(self._settings, speed=speed)
        self._lathe.axis.speed = speed
        self._begin_s = self._clock.monotonic_s() - self._lathe.time_s / speed

    async def run(self, started: "asyncio.Future[str] | None" = None) -> None:
        """Serve until cancelled; the future gets the endpoint as soon as clients may connect.

        An address that cannot be listened on, and a certificate or key that cannot be read, are
        refused.
        """
        await self._build()
        await self._gate.open()
        try:
            self._server.set_endpoint(self.endpoint)
            self._server.socket_address = ("127.0.0.1", 0)
            await self._server.start()
            try:
                if self._server.bserver is not None:
                    self._gate.target_port = self._server.bserver.port
                self.set_speed(self._settings.speed)
                self._tell_once()
                if started is not None:
                    started.set_result(self.endpoint)
                await self._live()
            finally:
                await self._gate.close()
                await self._server.stop()
        finally:
            await self._gate.close()

    async def _live(self) -> None:
        next_s = self._clock.monotonic_s()
        while True:
            next_s = max(next_s + _TELL_S, self._clock.monotonic_s())
            await self._clock.sleep_until(next_s)
            self._catch_up()
            await self._obey_faults()
            await self._tell()

    async def _obey_faults(self) -> None:
        fault = self._lathe.network_fault
        self._gate.pause(paused=fault is FaultKind.PAUSE)
        if fault is FaultKind.RESTART:
            await self._gate.close()
        else:
            await self._gate.open()

    # ---- values ----

    def _catch_up(self) -> None:
        """Bring the lathe to this moment and look at it."""
        now_s = self._clock.monotonic_s()
        if now_s - self._read_s < _SAME_MOMENT_S:
            return
        self._lathe.step_to((now_s - self._begin_s) * self._settings.speed)
        self._look()

    def _look(self) -> None:
        self._read_s = self._clock.monotonic_s()
        self._readings = self._lathe.readings()
        self._now = self._clock.utc()

    def _value(self, name: str) -> ua.DataValue:
        reading = self._readings[name]
        kind = self._types[name]
        value: object = reading.value
        if kind is ua.VariantType.UInt32 and value is not None:
            value = int(value) % 2**32 if math.isfinite(value) else None
        stamped_s, stamp = self._stamps.get(name, (None, self._now))
        if stamped_s != reading.stamp_s:  # what stands keeps its time, to the microsecond
            age_s = (self._lathe.time_s - reading.stamp_s) / self._settings.speed
            stamp = self._now - timedelta(seconds=age_s)
            self._stamps[name] = reading.stamp_s, stamp
        return ua.DataValue(
            Value=_NULL if value is None else ua.Variant(value, kind),
            StatusCode=status_code(reading.status),
            SourceTimestamp=stamp,
            ServerTimestamp=self._now,
        )

    def _on_read(self, node_id: ua.NodeId, _attribute: object) -> ua.DataValue:
        self._catch_up()
        return self._value(str(node_id.Identifier))

    def _on_write(self, node: "NodeData", _attribute: object, value: ua.DataValue) -> None:
        """Take what a client wrote; what is no possible value is accepted and not taken."""
        if self._telling:
            return
        name = str(node.nodeid.Identifier)
        written: Any = None if value.Value is None else value.Value.Value
        self._catch_up()
        if isinstance(written, int | float):
            if name == "offset_mm":
                self._lathe.write_offset(float(written))
            elif name == "heartbeat":
                self._lathe.write_heartbeat(int(written))
            elif name == "diameter_mm":
                self._lathe.write_diameter(float(written))
            elif name == "touch_asked" and written:
                self._lathe.ask_touch()
        self._look()
        self._held[name].value = self._value(name)

    def _tell_once(self) -> None:
        """Set what writable nodes hold: the server compares the type of what is written to it."""
        self._catch_up()
        for name, signal in SIGNALS.items():
            if signal.writable:
                self._held[name].value = self._value(name)

    async def _tell(self) -> None:
        """Tell subscribers, and nobody else."""
        self._tell_once()
        space = self._server.iserver.aspace
        self._telling = True
        try:
            for name, held in self._held.items():
                if held.datachange_callbacks:
                    value = self._value(name)
                    await space.write_attribute_value(self._ids[name], AttributeIds.Value, value)
        finally:
            self._telling = False

    # ---- nodes ----

    async def _build(self) -> None:
        server, settings = self._server, self._settings
        if settings.certificate is not None and settings.private_key is not None:
            await _load(server, settings.certificate, settings.private_key)
        await server.init()
        await server.set_application_uri(APPLICATION)
        server.set_server_name("thermaxis virtual lathe")
        if settings.certificate is not None:
            server.set_security_policy([ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt])
        else:
            server.set_security_policy([ua.SecurityPolicyType.NoSecurity])
        if settings.user:
            server.set_identity_tokens([ua.UserNameIdentityToken])
        else:
            server.set_identity_tokens([ua.AnonymousIdentityToken])
        index = await server.register_namespace(NAMESPACE)
        lathe = await server.nodes.objects.add_object(ua.NodeId("Lathe", index), "Lathe")
        self._readings = self._lathe.readings()
        for name, signal in SIGNALS.items():
            await self._add(lathe, name, index, signal.unit, signal.text)
            if signal.writable:
                await server.get_node(self._ids[name]).set_writable()

    async def _add(self, parent: "Node", name: str, index: int, unit: str, text: str) -> None:
        kind = _TYPES.get(unit, ua.VariantType.Double)
        node_id = ua.NodeId(name, index)
        start: object = {ua.VariantType.Boolean: False, ua.VariantType.UInt32: 0}.get(kind, 0.0)
        node = await parent.add_variable(node_id, f"{index}:{name}", start, kind)
        self._ids[name], self._types[name] = node_id, kind
        await node.write_attribute(
            AttributeIds.Description, ua.DataValue(ua.Variant(ua.LocalizedText(text)))
        )
        units = unit_of(unit)
        if units is not None:
            property_id = ua.NodeId(f"{name}.EngineeringUnits", index)
            await node.add_property(property_id, "0:EngineeringUnits", units)
        space = self._server.iserver.aspace
        value = AttributeIds.Value
        self._held[name] = space[node_id].attributes[value]
        if SIGNALS[name].writable:
            self._held[name].value = self._value(name)
        else:
            space.set_attribute_value_callback(node_id, value, self._on_read)
        space.set_attribute_value_setter(node_id, value, self._on_write)


async def _load(server: Server, certificate: Path, private_key: Path) -> None:
    try:
        await server.load_certificate(certificate)
        await server.load_private_key(private_key)
    except (OSError, ValueError) as error:
        raise ConfigurationError(
            "certificate_unreadable", cause=type(error).__name__, key="--certificate, --private-key"
        ) from None
