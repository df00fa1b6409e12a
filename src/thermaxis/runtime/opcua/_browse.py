"""What stands on a server: its variables with type, unit and value; nothing is written."""

from collections import deque
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from asyncua import ua
from asyncua.client.client import Client
from asyncua.common.node import Node
from asyncua.ua.attribute_ids import AttributeIds
from asyncua.ua.object_ids import ObjectIds

from thermaxis.codes import printable
from thermaxis.runtime._connection import ConnectionSettings
from thermaxis.runtime._ports import Clock
from thermaxis.runtime.opcua._failures import FAILURES, refuse
from thermaxis.runtime.opcua._link import Link, connect_once, take_leave
from thermaxis.runtime.opcua._values import plain_number

MOST_NODES: Final = 5000
"""More variables than this are not looked at. [1]"""
_AT_ONCE = 200
_SKIPPED: Final = ("EURange", "InstrumentRange", "InputArguments", "OutputArguments")
_UNIT = "EngineeringUnits"


class FoundNode(NamedTuple):
    """A variable that holds a number or a flag."""

    node: str
    """Its id, by the address of its namespace."""
    path: str
    """The names on the way to it."""
    data_type: str
    """Type of its value, such as ``Double``."""
    writable: bool
    """Whether this user may write it, as far as the server says."""
    value: float | bool
    unit: str
    """The unit that the server states; empty where it states none."""


async def browse_server(settings: ConnectionSettings, clock: Clock) -> tuple[FoundNode, ...]:
    """Return the variables of a server, those of the standard itself left out."""
    try:
        within_s = 4.0 * settings.timeout_s
        link = await connect_once(settings, clock, within_s)
        try:
            return await _described(link, await _variables(link.client))
        finally:
            await take_leave(link.client, settings.timeout_s)
    except FAILURES as error:
        raise refuse(error, settings) from None


async def _variables(client: Client) -> dict[str, Node]:
    """Return every variable by the names on the way to it."""
    waiting = deque([("", client.nodes.objects)])
    seen, found = set[ua.NodeId](), dict[str, Node]()
    while waiting and len(found) < MOST_NODES:
        path, node = waiting.popleft()
        below: list[Any] = await node.get_references(
            ObjectIds.HierarchicalReferences, ua.BrowseDirection.Forward
        )
        for one in below:
            node_id: ua.NodeId = one.NodeId
            if node_id in seen or node_id.NamespaceIndex == 0:
                continue  # the standard's own are not looked into
            seen.add(node_id)
            name = f"{path}.{one.BrowseName.Name}".lstrip(".")
            waiting.append((name, client.get_node(node_id)))
            if one.NodeClass == ua.NodeClass.Variable:
                found[name] = client.get_node(node_id)
    return found


async def _described(link: Link, variables: dict[str, Node]) -> tuple[FoundNode, ...]:
    ids = [node.nodeid for node in variables.values()]
    values = await _attributes(link.client, ids, AttributeIds.Value)
    levels = await _attributes(link.client, ids, AttributeIds.UserAccessLevel)
    contents: dict[str, Any] = {
        p: v.Value.Value for p, v in zip(variables, values, strict=True) if v.Value
    }
    found: list[FoundNode] = []
    for path, node_id, value, level in zip(variables, ids, values, levels, strict=True):
        number, variant = plain_number(value), value.Value
        if number is None or variant is None or path.rpartition(".")[2] in _SKIPPED:
            continue
        stated = contents.get(f"{path}.{_UNIT}")
        unit = str(stated.DisplayName.Text) if stated and hasattr(stated, "DisplayName") else ""
        access = plain_number(level) or 0
        writable = bool(int(access) & ua.AccessLevel.CurrentWrite.mask)
        kind = variant.VariantType.name
        node = _text_of(node_id, link.namespaces)
        found.append(FoundNode(node, printable(path), kind, writable, number, printable(unit)))
    return tuple(found)


async def _attributes(
    client: Client, ids: list[ua.NodeId], attribute: AttributeIds
) -> list[ua.DataValue]:
    found: list[ua.DataValue] = []
    for start in range(0, len(ids), _AT_ONCE):
        found += await client.uaclient.read_attributes(ids[start : start + _AT_ONCE], attribute)
    return found


def _text_of(node_id: ua.NodeId, namespaces: Sequence[str]) -> str:
    """Return a node id that stays right when the server numbers its namespaces otherwise."""
    uri = namespaces[node_id.NamespaceIndex].replace("%", "%25").replace(";", "%3B")
    return f"nsu={uri};{node_id.to_string().partition(';')[2]}"
