"""The part of OPC UA's standard address space that the status server shows.

asyncua makes all of its seven thousand nodes, which takes 40 MB and most of a second [run]; a
status server needs the Server object, the types of what it shows, and the reference types. The
rest is left out as it is read: two passes over the standard, the first to see what hangs where,
the second to keep what is wanted.
"""

# asyncua leaves the members of its requests and the makers of its nodes without types:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

from collections.abc import Iterable, Iterator
from functools import cache
from typing import NamedTuple, final

from asyncua import ua
from asyncua.server.address_space import NodeManagementService
from asyncua.server.standard_address_space import standard_address_space

_FOLDERS = (84, 85, 86, 87, 88, 89, 90, 91)
"""Root, Objects, Types, Views and the folders of the types."""
_SERVER = 2253
_DEEPEST = 10
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
    """Identifier of its parent; 0 where none is stated."""
    kind: int
    """Identifier of its type; 0 where it has none."""
    node_class: ua.NodeClass
    """Its class."""
    name: str
    """Its name."""


@final
class _Survey:
    """First pass: remembers where every node hangs and makes none."""

    def __init__(self) -> None:
        self.places: dict[int, _Place] = {}
        self.subtypes: dict[int, int] = {}

    def try_add_nodes(
        self, items: Iterable[ua.AddNodesItem], *, check: bool = True
    ) -> Iterator[ua.AddNodesItem]:
        """Remember nodes; nothing is left over."""
        del check
        for item in items:
            self.places[_number(item.RequestedNewNodeId)] = _Place(
                _number(item.ParentNodeId),
                _number(item.TypeDefinition),
                item.NodeClass,
                item.BrowseName.Name or "",
            )
        return iter(())

    def try_add_references(
        self, items: Iterable[ua.AddReferencesItem]
    ) -> Iterator[ua.AddReferencesItem]:
        """Leave references out; nothing is left over."""
        del items
        return iter(())

    def wanted(self) -> frozenset[int]:
        """Return the nodes to make: the chosen ones and everything above them."""
        chosen = {*_FOLDERS, *_TYPES, *_DATA_TYPES}
        for number, place in self.places.items():
            if place.node_class is ua.NodeClass.ReferenceType or self._serves(number):
                chosen |= {number, place.kind}
        todo = list(chosen)
        while todo:
            place = self.places.get(todo.pop())
            if place is not None and place.parent and place.parent not in chosen:
                chosen.add(place.parent)
                todo.append(place.parent)
        return frozenset(chosen & self.places.keys())

    def _serves(self, number: int) -> bool:
        """Whether a node is the Server object or hangs under it, and is not left out."""
        seen = 0
        while number != _SERVER:
            place = self.places.get(number)
            seen += 1
            if place is None or place.name in _LEFT_OUT or seen > _DEEPEST:
                return False
            number = place.parent
        return True


@final
class _Some:
    """Second pass: keeps the wanted nodes and the references between them."""

    def __init__(self, wanted: frozenset[int]) -> None:
        self._wanted = wanted
        self.nodes: list[ua.AddNodesItem] = []
        self.references: list[ua.AddReferencesItem] = []

    def try_add_nodes(
        self, items: Iterable[ua.AddNodesItem], *, check: bool = True
    ) -> Iterator[ua.AddNodesItem]:
        """Keep the wanted ones; nothing is left over."""
        del check
        self.nodes += [i for i in items if _number(i.RequestedNewNodeId) in self._wanted]
        return iter(())

    def try_add_references(
        self, items: Iterable[ua.AddReferencesItem]
    ) -> Iterator[ua.AddReferencesItem]:
        """Keep those between wanted nodes; nothing is left over."""
        self.references += [
            item
            for item in items
            if _number(item.SourceNodeId) in self._wanted
            and _number(item.TargetNodeId) in self._wanted
        ]
        return iter(())


def _number(node: ua.NodeId) -> int:
    return node.Identifier if isinstance(node.Identifier, int) else 0


@cache
def _wanted() -> _Some:
    """Return what to make, found once in a program."""
    survey = _Survey()
    standard_address_space.fill_address_space(survey)
    some = _Some(survey.wanted())
    standard_address_space.fill_address_space(some)
    return some


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
