"""The status server's nodes and methods, made of asyncua's parts."""

# asyncua declares the fields of its structures as number types of its own, which plain numbers
# are not, and leaves many members without a type:
# pyright: reportArgumentType=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

import asyncio
from collections.abc import Awaitable, Callable, Iterator, Sequence
from contextlib import suppress
from datetime import datetime
from typing import TYPE_CHECKING, Any, Final, cast, final

from asyncua import ua
from asyncua.common.node import Node
from asyncua.ua.attribute_ids import AttributeIds
from asyncua.ua.object_ids import ObjectIds
from asyncua.ua.status_codes import StatusCodes

from thermaxis.runtime.status._fields import Kind, Leaf
from thermaxis.runtime.status._requests import Argument
from thermaxis.runtime.status._sessions import GuardedServer

if TYPE_CHECKING:
    from asyncua.server.address_space import AttributeValue

ROOT = "Thermaxis"
"""Object under Objects below which everything stands."""
_TYPES = {
    Kind.NUMBER: ua.VariantType.Double,
    Kind.COUNT: ua.VariantType.UInt32,
    Kind.FLAG: ua.VariantType.Boolean,
    Kind.TEXT: ua.VariantType.String,
    Kind.TIME: ua.VariantType.DateTime,
    Kind.TEXTS: ua.VariantType.String,
    Kind.NUMBERS: ua.VariantType.Double,
}
_LISTS = frozenset({Kind.TEXTS, Kind.NUMBERS})
_COUNT_MODULUS = 2**32
_NULL = ua.Variant(None, ua.VariantType.Null)
_codes: dict[str, ua.StatusCode] = {}

Called = Callable[[Sequence[ua.Variant]], Awaitable[Sequence[ua.Variant] | ua.StatusCode]]
"""What answers a method: its results, or the status code that refuses the call."""


def status_code(name: str) -> ua.StatusCode:
    """Return a status code by its name, such as ``BadOutOfRange``."""
    code = _codes.get(name)
    if code is None:
        code = _codes[name] = ua.StatusCode(getattr(StatusCodes, name))
    return code


def data_value(
    kind: Kind, value: object, quality: str, source: datetime | None, server: datetime
) -> ua.DataValue:
    """Return a value with its quality and both time stamps."""
    held = list(cast("tuple[object, ...]", value)) if isinstance(value, tuple) else value
    if kind is Kind.COUNT and isinstance(value, int):
        held = value % _COUNT_MODULUS
    return ua.DataValue(
        Value=_NULL if held is None else ua.Variant(held, _TYPES[kind]),
        StatusCode=status_code(quality),
        SourceTimestamp=source,
        ServerTimestamp=server,
    )


def variant_of(value: str | bool) -> ua.Variant:  # noqa: FBT001 - what a method gives back
    """Return a text or a truth value as a method gives it back."""
    return ua.Variant(
        value, ua.VariantType.Boolean if isinstance(value, bool) else ua.VariantType.String
    )


_LONGEST_TEXT: Final = 1000  # five times what the loop takes: it refuses what is cut here


def values_of(
    wanted: Sequence[Argument], given: Sequence[ua.Variant]
) -> tuple[list[float | str], str]:
    """Return the arguments of a call as plain values."""
    if len(given) < len(wanted):
        return [], "BadArgumentsMissing"
    if len(given) > len(wanted):
        return [], "BadTooManyArguments"
    values: list[float | str] = []
    for argument, variant in zip(wanted, given, strict=True):
        value: object = variant.Value
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if argument.kind is Kind.NUMBER and number:
            values.append(float(value))
        elif argument.kind is Kind.TEXT and variant.VariantType is ua.VariantType.String:
            values.append(str(value or "")[:_LONGEST_TEXT])
        else:
            return [], "BadInvalidArgument"
    return values, ""


@final
class Tree:
    """The nodes of the status server."""

    def __init__(
        self, server: GuardedServer, namespace: int, read: Callable[[str], ua.DataValue]
    ) -> None:
        self._server = server
        self._namespace = namespace
        self._read = read
        self._held: dict[str, AttributeValue] = {}

    def _names(self, path: str) -> tuple[ua.NodeId, ua.QualifiedName]:
        name = path.rpartition("/")[2]
        return ua.NodeId(path, self._namespace), ua.QualifiedName(name, self._namespace)

    def _on_read(self, node_id: ua.NodeId, attribute: AttributeIds) -> ua.DataValue:
        del attribute
        return self._read(str(node_id.Identifier))

    async def add_leaves(self, leaves: Sequence[Leaf]) -> None:
        """Make the nodes that are not there yet; between two of them the loop may run."""
        for leaf in leaves:
            if leaf.path not in self._held:
                await self._add_leaf(leaf)
                await asyncio.sleep(0)

    async def _add_leaf(self, leaf: Leaf) -> None:
        inner, kind = self._server.iserver, leaf.field.kind
        folder = await self._folder(leaf.path.rpartition("/")[0])
        data_type = ua.NodeId(_TYPES[kind].value)
        node = await folder.add_variable(*self._names(leaf.path), _NULL, datatype=data_type)
        await _describe(node, leaf.field.text)
        if kind in _LISTS:
            rank = ua.DataValue(ua.Variant(1, ua.VariantType.Int32))
            await node.write_attribute(AttributeIds.ValueRank, rank)
        inner.set_attribute_value_callback(node.nodeid, cast("Any", self._on_read))
        self._held[leaf.path] = inner.aspace[node.nodeid].attributes[AttributeIds.Value]

    async def _folder(self, path: str) -> Node:
        """Return the folder of a path, made with everything above it where it is not there."""
        node_id, name = self._names(path)
        if node_id in self._server.iserver.aspace:
            return self._server.get_node(node_id)
        above = self._server.nodes.objects
        if path != ROOT:
            above = await self._folder(path.rpartition("/")[0] or ROOT)
        return await above.add_folder(node_id, name)

    async def add_method(
        self,
        name: str,
        text: str,
        arguments: tuple[Sequence[Argument], Sequence[Argument]],
        called: Called,
    ) -> None:
        """Make a method under ``Requests``."""

        async def answer(parent: ua.NodeId, *given: ua.Variant) -> object:
            del parent
            return await called(given)

        path = f"Requests/{name}"
        folder = await self._folder("Requests")
        method = await folder.add_method(*self._names(path), answer)
        await _describe(method, text)
        for label, listed in zip(("InputArguments", "OutputArguments"), arguments, strict=True):
            if listed:
                await method.add_property(
                    self._names(f"{path}/{label}")[0],
                    ua.QualifiedName(label, 0),
                    [_described(argument) for argument in listed],
                    ua.VariantType.ExtensionObject,
                    ua.NodeId(ObjectIds.Argument),
                )

    def watched(self) -> Iterator[str]:
        """Return the paths that somebody has subscribed to."""
        return iter([path for path, held in self._held.items() if held.datachange_callbacks])

    async def tell(self, path: str, value: ua.DataValue) -> None:
        """Tell the subscribers of a path its value."""
        for number, callback in tuple(self._held[path].datachange_callbacks.items()):
            with suppress(TypeError, ValueError, AttributeError, KeyError, ua.UaError):
                await callback(number, value)  # a filter of its own may not fit the value


async def _describe(node: Node, text: str) -> None:
    described = ua.Variant(ua.LocalizedText(text), ua.VariantType.LocalizedText)
    await node.write_attribute(AttributeIds.Description, ua.DataValue(described))


def _described(argument: Argument) -> ua.Argument:
    return ua.Argument(
        Name=argument.name,
        DataType=ua.NodeId(_TYPES[argument.kind].value),
        ValueRank=-1,
        ArrayDimensions=[],
        Description=ua.LocalizedText(argument.text),
    )
