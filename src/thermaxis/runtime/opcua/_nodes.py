"""Node ids as they are written in a configuration, and as a server understands them."""

import base64
import binascii
import uuid
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple
from urllib.parse import unquote

from thermaxis.errors import ConfigurationError

if TYPE_CHECKING:
    from asyncua import ua

_LONGEST_NODE = 1000


class NodeText(NamedTuple):
    """A node id as it was written."""

    namespace: int
    """Index of the namespace; 0 where its address is given instead. [1]"""
    uri: str
    """Address of the namespace, whose index is looked up at each connection; empty: the index
    counts."""
    identifier: int | str | bytes | uuid.UUID
    """The identifier within the namespace."""


def parse_node(text: str) -> NodeText:
    """Read a node id.

    References
    ----------
    OPC 10000-6, 5.3.1.10 and 5.3.1.11.
    """
    if not text or len(text) > _LONGEST_NODE or not text.isprintable():
        raise _no_node(text)
    namespace, uri, rest = 0, "", text
    if text.startswith("nsu="):
        uri, found, rest = text[4:].partition(";")
        uri = unquote(uri)
        if not uri or not found:
            raise _no_node(text)
    elif text.startswith("ns="):
        digits, found, rest = text[3:].partition(";")
        if not digits.isascii() or not digits.isdigit() or int(digits) > 0xFFFF or not found:
            raise _no_node(text)
        namespace = int(digits)
    return NodeText(namespace, uri, _identifier(rest, text))


def _identifier(rest: str, text: str) -> int | str | bytes | uuid.UUID:
    kind, word = rest[:2], rest[2:]
    try:
        if kind == "s=" and word:
            return word
        if kind == "i=" and word.isascii() and word.isdigit() and int(word) <= 0xFFFFFFFF:
            return int(word)
        if kind == "g=":
            return uuid.UUID(word)
        if kind == "b=" and word:
            return base64.b64decode(word, validate=True)
    except (ValueError, binascii.Error):
        raise _no_node(text) from None
    raise _no_node(text)


def _no_node(text: str) -> ConfigurationError:
    return ConfigurationError("no_node_id", text=text, key="node")


def node_id(node: NodeText, namespaces: Sequence[str]) -> "ua.NodeId | None":
    """Return a node id for a server whose namespaces are known."""
    from asyncua import ua  # noqa: PLC0415 - the configuration parses nodes without it

    index = node.namespace
    if node.uri:
        if node.uri not in namespaces:
            return None
        index = namespaces.index(node.uri)
    return ua.NodeId(node.identifier, index)  # pyright: ignore[reportArgumentType] - plain types
