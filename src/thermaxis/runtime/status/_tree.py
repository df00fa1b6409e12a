"""The status server's nodes and methods, made of asyncua's parts."""

# asyncua declares the fields of its structures as number types of its own, which plain numbers
# are not, and leaves many members without a type:
# pyright: reportArgumentType=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false

import asyncio
from collections.abc import Awaitable, Callable, Iterator, Sequence
from copy import copy
from datetime import datetime
from functools import partial
from typing import TYPE_CHECKING, Any, cast, final

from asyncua import ua
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
_NUMBERS = frozenset(
    {
        ua.VariantType.Double,
        ua.VariantType.Float,
        ua.VariantType.SByte,
        ua.VariantType.Byte,
        ua.VariantType.Int16,
        ua.VariantType.UInt16,
        ua.VariantType.Int32,
        ua.VariantType.UInt32,
        ua.VariantType.Int64,
        ua.VariantType.UInt64,
    }
)
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


def text_variant(text: str) -> ua.Variant:
    """Return a text as a method gives it back."""
    return ua.Variant(text, ua.VariantType.String)


def flag_variant(*, flag: bool) -> ua.Variant:
    """Return a truth value as a method gives it back."""
    return ua.Variant(flag, ua.VariantType.Boolean)


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
        number = argument.kind is Kind.NUMBER and variant.VariantType in _NUMBERS
        text = argument.kind is Kind.TEXT and variant.VariantType is ua.VariantType.String
        if number and isinstance(value, int | float):
            values.append(float(value))
        elif text and isinstance(value, str):
            values.append(value)
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
        self._times: list[tuple[AttributeValue, Callable[[], ua.DataValue]]] = []

    def __contains__(self, path: str) -> bool:
        return path in self._held

    def _node_id(self, path: str) -> ua.NodeId:
        return ua.NodeId(path, self._namespace)

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
        parent, _, name = leaf.path.rpartition("/")
        attributes = ua.VariableAttributes(
            DisplayName=ua.LocalizedText(name),
            Description=ua.LocalizedText(leaf.field.text),
            Value=_NULL,
            DataType=ua.NodeId(_TYPES[leaf.field.kind].value),
            ValueRank=1 if leaf.field.kind in _LISTS else -1,
            ArrayDimensions=[0] if leaf.field.kind in _LISTS else None,
            AccessLevel=1,
            UserAccessLevel=1,
        )
        variable = ua.NodeClass.Variable
        held_by = await self._folder(parent)
        node_id = await self._add(
            leaf.path, (variable, ObjectIds.BaseDataVariableType), held_by, attributes
        )
        self._server.iserver.set_attribute_value_callback(node_id, cast("Any", self._on_read))
        self._held[leaf.path] = self._server.iserver.aspace[node_id].attributes[AttributeIds.Value]

    async def _folder(self, path: str) -> ua.NodeId:
        """Return the folder of a path, made with everything above it where it is not there."""
        node_id = self._node_id(path)
        if node_id in self._server.iserver.aspace:
            return node_id
        above = ua.NodeId(ObjectIds.ObjectsFolder)
        if path != ROOT:
            above = await self._folder(path.rpartition("/")[0] or ROOT)
        attributes = ua.ObjectAttributes(DisplayName=ua.LocalizedText(path.rpartition("/")[2]))
        return await self._add(path, (ua.NodeClass.Object, ObjectIds.FolderType), above, attributes)

    async def _add(
        self,
        path: str,
        kind: tuple[ua.NodeClass, int | None],
        above: ua.NodeId,
        attributes: object,
    ) -> ua.NodeId:
        node_class, node_type = kind
        item = ua.AddNodesItem()
        item.RequestedNewNodeId = self._node_id(path)
        name = path.rpartition("/")[2]
        item.BrowseName = ua.QualifiedName(name, self._namespace)
        item.ParentNodeId = above
        reference = ObjectIds.HasComponent
        if node_class is ua.NodeClass.Object:
            reference = ObjectIds.Organizes
        elif node_type == ObjectIds.PropertyType:
            reference = ObjectIds.HasProperty
            item.BrowseName = ua.QualifiedName(name, 0)
        item.ReferenceTypeId = ua.NodeId(reference)
        item.NodeClass = node_class
        if node_type is not None:
            item.TypeDefinition = ua.NodeId(node_type)
        item.NodeAttributes = attributes
        result = (await self._server.iserver.isession.add_nodes([item]))[0]
        result.StatusCode.check()
        return cast("ua.NodeId", result.AddedNodeId)

    async def add_method(
        self,
        name: str,
        text: str,
        arguments: tuple[Sequence[Argument], Sequence[Argument]],
        called: Called,
    ) -> None:
        """Make a method under ``Requests``."""
        path = f"Requests/{name}"
        attributes = ua.MethodAttributes(
            DisplayName=ua.LocalizedText(name),
            Description=ua.LocalizedText(text),
            Executable=True,
            UserExecutable=True,
        )
        folder = await self._folder("Requests")
        node_id = await self._add(path, (ua.NodeClass.Method, None), folder, attributes)
        for label, listed in zip(("InputArguments", "OutputArguments"), arguments, strict=True):
            if listed:
                await self._add_arguments(f"{path}/{label}", node_id, listed)

        async def answer(parent: ua.NodeId, *given: ua.Variant) -> object:
            del parent
            return await called(given)

        self._server.iserver.isession.add_method_callback(node_id, answer)

    async def _add_arguments(
        self, path: str, method: ua.NodeId, arguments: Sequence[Argument]
    ) -> None:
        described = [
            ua.Argument(
                Name=argument.name,
                DataType=ua.NodeId(_TYPES[argument.kind].value),
                ValueRank=-1,
                ArrayDimensions=[],
                Description=ua.LocalizedText(argument.text),
            )
            for argument in arguments
        ]
        attributes = ua.VariableAttributes(
            DisplayName=ua.LocalizedText(path.rpartition("/")[2]),
            Value=ua.Variant(described, ua.VariantType.ExtensionObject),
            DataType=ua.NodeId(ObjectIds.Argument),
            ValueRank=1,
            ArrayDimensions=[len(described)],
            AccessLevel=1,
            UserAccessLevel=1,
        )
        await self._add(path, (ua.NodeClass.Variable, ObjectIds.PropertyType), method, attributes)

    def watched(self) -> Iterator[str]:
        """Return the paths that somebody has subscribed to."""
        return iter([path for path, held in self._held.items() if held.datachange_callbacks])

    async def tell(self, path: str, value: ua.DataValue) -> None:
        """Tell the subscribers of a path its value."""
        await _tell_all(self._held[path], value)

    def show_time(self, now: Callable[[], datetime]) -> None:
        """Show the server's time, computed when it is read."""
        inner = self._server.iserver
        whole = ua.NodeId(ObjectIds.Server_ServerStatus)
        current = ua.NodeId(ObjectIds.Server_ServerStatus_CurrentTime)
        started: Any = inner.read_attribute_value(whole).Value

        def status() -> ua.DataValue:
            present = copy(started.Value)
            present.CurrentTime = now()
            return ua.DataValue(
                ua.Variant(present, ua.VariantType.ExtensionObject), SourceTimestamp=now()
            )

        def time() -> ua.DataValue:
            return ua.DataValue(ua.Variant(now(), ua.VariantType.DateTime), SourceTimestamp=now())

        for node_id, value in ((whole, status), (current, time)):
            inner.set_attribute_value_callback(node_id, partial(_read_time, value))
            held = inner.aspace[node_id].attributes[AttributeIds.Value]
            self._times.append((held, value))

    async def tell_time(self) -> None:
        """Tell the subscribers of the server's time what time it is."""
        for held, value in self._times:
            if held.datachange_callbacks:
                await _tell_all(held, value())


def _read_time(
    value: Callable[[], ua.DataValue], node_id: ua.NodeId, attribute: AttributeIds
) -> ua.DataValue:
    del node_id, attribute
    return value()


async def _tell_all(held: "AttributeValue", value: ua.DataValue) -> None:
    for number, callback in tuple(held.datachange_callbacks.items()):
        try:
            await callback(number, value)
        except (TypeError, ValueError, AttributeError, KeyError, ua.UaError):
            continue  # a subscriber's own filter that does not fit the value
