"""What is known of a server as long as one connection to it lasts."""

import asyncio
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any, Final, NamedTuple, final

from asyncua import ua
from asyncua.client.client import Client
from asyncua.ua.attribute_ids import AttributeIds
from asyncua.ua.object_ids import ObjectIds

from thermaxis.runtime.opcua._nodes import node_id, parse_node

CLOCK_SLACK_S: Final = 2.0
"""A server's clock that seems to go back by more than this was set back. Above the second in
which some servers step the time that they tell. [s]"""
CLOCK_DRIFT: Final = 1e-3
"""How fast two clocks may part without being noticed. [s/s]"""
SERVER_TIME: Final = ua.NodeId(ua.Int32(ObjectIds.Server_ServerStatus_CurrentTime))
"""The node that tells the server's time."""

_NO_TIME = datetime(1602, 1, 1, tzinfo=UTC)


class ReadRequest(NamedTuple):
    """A read request that was made ready once for a connection."""

    parameters: ua.ReadParameters
    """What is sent; it asks for the server's time last."""
    known: tuple[int, ...]
    """Places of the nodes whose namespace the server has, among those that were asked for. [1]"""
    total: int
    """How many nodes were asked for. [1]"""


@final
class Link:
    """One connection, from its beginning to its loss."""

    def __init__(self, client: Client) -> None:
        self.client = client
        self.lost = asyncio.Event()
        self.error: BaseException | None = None
        self.namespaces: Sequence[str] = ()
        self.server_ahead_s: float | None = None
        self.seen_s = 0.0
        self.used_s = 0.0
        self.readings: dict[tuple[str, ...], ReadRequest] = {}
        self.types: dict[str, ua.VariantType | None] = {}
        self.ids: dict[str, ua.NodeId | None] = {}
        self.under_way: set[asyncio.Task[Any]] = set()
        self.writing: asyncio.Task[Any] | None = None

    def lose(self, error: BaseException) -> None:
        """Give the connection up."""
        if not self.lost.is_set():
            self.error = error
            self.lost.set()

    def id_of(self, node: str) -> ua.NodeId | None:
        """Return the id of a node on this server; None if it has no such namespace."""
        if node not in self.ids:
            self.ids[node] = node_id(parse_node(node), self.namespaces)
        return self.ids[node]

    def reading(self, nodes: Sequence[str]) -> ReadRequest:
        """Return the read request for nodes; the last one it asks for is the server's time."""
        key = tuple(nodes)
        found = self.readings.get(key)
        if found is None:
            ids = [self.id_of(node) for node in nodes]
            known = tuple(i for i, one in enumerate(ids) if one is not None)
            asked = [one for one in ids if one is not None]
            found = ReadRequest(value_request([*asked, SERVER_TIME]), known, len(ids))
            self.readings[key] = found
        return found

    def see_time(self, value: ua.DataValue, sent_s: float, now_s: float) -> None:
        """Learn from the time that the server tells how far its clock is ahead of the own one.

        Some servers step it once a second, so that the most it was ahead counts; the two clocks
        may part slowly, and a large step means that the clock was set.
        """
        variant = value.Value
        seen = None if variant is None else aware_time(variant.Value)
        if seen is None or now_s - sent_s > CLOCK_SLACK_S:
            return
        ahead_s = seen.timestamp() - now_s  # at least: it was told a moment ago
        before_s = self.server_ahead_s
        if before_s is not None and 0.0 <= before_s - ahead_s <= CLOCK_SLACK_S:
            ahead_s = max(ahead_s, before_s - CLOCK_DRIFT * (now_s - self.seen_s))
        self.server_ahead_s, self.seen_s = ahead_s, now_s


def value_request(nodes: Sequence[ua.NodeId]) -> ua.ReadParameters:
    """Return the request for the values of nodes."""
    return attribute_request([(node, AttributeIds.Value) for node in nodes])


def attribute_request(asked: Sequence[tuple[ua.NodeId, AttributeIds]]) -> ua.ReadParameters:
    """Return the request for attributes of nodes, with both time stamps."""
    return ua.ReadParameters(
        TimestampsToReturn=ua.TimestampsToReturn.Both,
        NodesToRead=[
            ua.ReadValueId(NodeId=node, AttributeId=attribute) for node, attribute in asked
        ],
    )


def aware_time(stamp: object) -> datetime | None:
    """Return a time stamp, aware; None for none, or for the zero that stands for none."""
    if not isinstance(stamp, datetime):
        return None
    aware = stamp if stamp.tzinfo is not None else stamp.replace(tzinfo=UTC)
    return aware if aware > _NO_TIME else None
