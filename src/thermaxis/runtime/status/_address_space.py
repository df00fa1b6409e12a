"""The part of OPC UA's standard address space that the status server shows.

asyncua makes all of its seven thousand nodes, which takes 40 MB [run]; a status server needs the
Server object, the types of what it shows, and the reference types.
"""

# asyncua leaves the members of its requests and the makers of its nodes without types:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

import ctypes
import sys
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import cache
from typing import NamedTuple, final

from asyncua import ua
from asyncua.server.address_space import NodeManagementService
from asyncua.server.standard_address_space import standard_address_space

_FOLDERS = (84, 85, 86, 87, 88, 89, 90, 91)
"""Root, Objects, Types, Views and the folders of the types."""
_SERVER = 2253
_LEFT_OUT = frozenset(
    {
        "AggregateFunctions",
        "ConformanceUnits",
        "DefaultHAConfiguration",
        "DefaultHEConfiguration",
        "Dictionaries",
        "EstimatedReturnTime",
        "GetMonitoredItems",
        "HistoryServerCapabilities",
        "LocalTime",
        "ModellingRules",
        "Namespaces",
        "PublishSubscribe",
        "Quantities",
        "RequestServerStateChange",
        "Resources",
        "ResendData",
        "RoleSet",
        "ServerConfiguration",
        "ServerDiagnostics",
        "ServerLog",
        "SetSubscriptionDurable",
        "UrisVersion",
        "VendorServerInfo",
    }
)
"""What hangs under the Server object and does not exist here."""
_DATA_TYPES = frozenset({*range(1, 31), 290, 294, 296, 338, 852, 862, 884, 887, 7594})
"""Built-in types, Duration, UtcTime, Argument, BuildInfo, ServerState and ServerStatus, Range,
EUInformation, EnumValueType."""
_TYPES = (58, 61, 62, 63, 68)
"""BaseObjectType, FolderType, BaseVariableType, BaseDataVariableType, PropertyType."""


class _Place(NamedTuple):
    """Where a node hangs, and what it is."""

    parent: int
    kind: int
    node_class: ua.NodeClass
    name: str


@final
class _Standard:
    """Takes the standard instead of a server: where every node hangs, and the wanted ones."""

    def __init__(self, wanted: frozenset[int] = frozenset()) -> None:
        self._wanted = wanted
        self._places: dict[int, _Place] = {}
        self.nodes: list[ua.AddNodesItem] = []
        self.references: list[ua.AddReferencesItem] = []
        standard_address_space.fill_address_space(self)

    def try_add_nodes(
        self, items: Iterable[ua.AddNodesItem], *, check: bool = True
    ) -> Iterator[ua.AddNodesItem]:
        """Take nodes; nothing is left over."""
        del check
        for item in items:
            number, name = _number(item.RequestedNewNodeId), item.BrowseName.Name or ""
            parent, kind = _number(item.ParentNodeId), _number(item.TypeDefinition)
            self._places[number] = _Place(parent, kind, item.NodeClass, name)
            if number in self._wanted:
                self.nodes.append(item)
        return iter(())

    def try_add_references(
        self, items: Iterable[ua.AddReferencesItem]
    ) -> Iterator[ua.AddReferencesItem]:
        """Take the references between wanted nodes; nothing is left over."""
        self.references += [
            one
            for one in items
            if {_number(one.SourceNodeId), _number(one.TargetNodeId)} <= self._wanted
        ]
        return iter(())

    def wanted(self) -> frozenset[int]:
        """Return the nodes to make: the chosen ones and everything above them."""
        chosen = {*_FOLDERS, *_TYPES, *_DATA_TYPES}
        for number, place in self._places.items():
            if place.node_class is ua.NodeClass.ReferenceType or self._serves(number):
                chosen |= {number, place.kind}
        return frozenset(above for number in chosen for above in self._way_up(number))

    def _way_up(self, number: int) -> Iterator[int]:
        """Yield a node and everything that it hangs under."""
        while number in self._places:
            yield number
            number = self._places[number].parent

    def _serves(self, number: int) -> bool:
        """Whether a node is the Server object or hangs under it, and is not left out."""
        for above in self._way_up(number):
            if above == _SERVER or self._places[above].name in _LEFT_OUT:
                return above == _SERVER
        return False


def _number(node: ua.NodeId) -> int:
    return node.Identifier if isinstance(node.Identifier, int) else 0


@cache
def _wanted() -> _Standard:
    """Return what to make, found once in a program: two passes take 8 MB less than one [run]."""
    return _Standard(_Standard().wanted())


def fill_address_space(service: NodeManagementService) -> int:
    """Make the nodes of the standard that a status server needs.

    References
    ----------
    OPC UA Part 5 (information model), as asyncua carries it.
    """
    some = _wanted()
    with standard_address_space.PostponeReferences(service) as later:
        later.add_nodes(some.nodes)
        later.add_references(some.references)
    return len(some.nodes)


def forget_standard() -> None:
    """Let go of what makes the standard's nodes once a server was made: 10 MB [run].

    Servers can still be opened here, asyncua's own cannot.
    """
    makers = f"{standard_address_space.__name__}_services"
    for name in [one for one in sys.modules if one.startswith(makers)]:
        vars(sys.modules.pop(name)).clear()
    with suppress(OSError, AttributeError):  # not GNU's C library, which else keeps what is free
        ctypes.CDLL(None).malloc_trim(0)
