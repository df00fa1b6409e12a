"""Offsets of a machine that is an OPC UA server."""

import asyncio
import math
import secrets
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, final

from asyncua import ua

from thermaxis.codes import Message
from thermaxis.runtime._machine_values import WHOLE_RANGES
from thermaxis.runtime._ports import Applied, Sink
from thermaxis.runtime._sign import offset_factor
from thermaxis.runtime.opcua import OpcUaSession, next_beat, parse_node, plain_number

HEARTBEAT, TOKEN = "heartbeat", "token"
"""What the nodes of heartbeat and token are called among the refused ones."""
TOKEN_S: Final = 5.0
"""A token that is not renewed for so long is one of a program that has ended. [s]"""
_LARGEST_TOKEN = 2**24  # whole in a Float, too
_NOT_FOUND: Final = Message("error-offsets_not_read_yet")
_NOT_ANSWERED: Final = Message("error-machine_silent")
_ANOTHERS: Final = Message("error-another_program_writes")
_NOT_OLD_YET: Final = Message("error-token_not_old_yet")
_UNREAD: Final = Message("error-token_unread")


@final
@dataclass(frozen=True, slots=True, kw_only=True)
class OpcUaOutput:
    """Where one offset goes."""

    node: str
    """The node that is written."""
    unit: str
    """Unit of the machine's offset, a key of `OFFSET_UNITS`."""
    sign: str
    """What a positive offset means, one of the two sentences of `SIGNS`."""
    read_back_node: str = ""
    """The node that tells what was accepted; empty: the one that is written."""
    effective_node: str = ""
    """The node that tells what acts now; empty: none tells."""

    def __post_init__(self) -> None:
        """Check nodes, unit and sign."""
        for node in (self.node, self.read_back_node, self.effective_node):
            if node:
                parse_node(node)
        offset_factor(self.unit, self.sign)


@final
class Token:
    """A random number in the machine, renewed with every write by the program that writes.

    Notes
    -----
    Not protected: of two programs that begin within one cycle both may write once.
    """

    def __init__(self, node: str, cycle_s: float, read_back_s: float) -> None:
        parse_node(node)
        self.node, self._renewed_s = node, max(TOKEN_S, 3.0 * cycle_s)
        self.hindrance: Message | None = _NOT_OLD_YET
        """Why nothing may be written; None if no other program's token is renewed there."""
        self._own: deque[int] = deque(maxlen=10 + math.ceil(read_back_s / cycle_s))
        self._seen: float | None = None
        self._seen_s = self._read_s = -math.inf

    def look(self, number: float | None) -> None:
        """Take what stands there now; None, unread, changes nothing for a while."""
        now_s = asyncio.get_running_loop().time()
        if number is None:
            if now_s - self._read_s > self._renewed_s:
                self.hindrance = _UNREAD
            return
        self._read_s = now_s
        if number != self._seen:
            another = self._seen is not None and number != 0.0  # zero is a machine's that started
            self.hindrance = _ANOTHERS if another else _NOT_OLD_YET
            self._seen, self._seen_s = number, now_s
        if number in self._own or now_s - self._seen_s > self._renewed_s:
            self.hindrance = None

    def renewed(self) -> int:
        """Return the next number of this program."""
        self._own.append(1 + secrets.randbelow(_LARGEST_TOKEN))
        return self._own[-1]


@final
class OpcUaSink(Sink):
    """Writes all offsets and the heartbeat with one request per cycle.

    Notes
    -----
    Not protected: one request is not atomic. Of several offsets one may be accepted and another
    refused; `refused` says which, and the machine should take offsets over only when the
    heartbeat moved. Without a heartbeat that the machine watches, the last offset stays when this
    program dies. A write that the machine answers too late may still take effect.
    """

    def __init__(
        self,
        session: OpcUaSession,
        outputs: Mapping[str, OpcUaOutput],
        heartbeat_node: str | None = None,
        token: Token | None = None,
    ) -> None:
        self.session = session
        self._token = token
        self._outputs = dict(outputs)
        self._factors = {
            name: offset_factor(output.unit, output.sign) for name, output in outputs.items()
        }
        self.tells_effective = frozenset(n for n, one in outputs.items() if one.effective_node)
        self._heartbeat_node = heartbeat_node or ""
        if self._heartbeat_node:
            parse_node(self._heartbeat_node)
        self._asked = (*_asked(self._outputs), *((token.node,) if token else ()))
        self._found_in = 0
        self._beat: float | None = None
        self._beat_type = ""
        self._hindrance: Message | None = None
        self._requested: dict[str, float] = {}
        self.refused: Mapping[str, str] = {}
        """Names of the status codes of what the last write could not set, by output."""

    async def open(self) -> None:
        """Begin to connect."""
        self._found_in = 0
        await self.session.open()

    @property
    def connected(self) -> bool:
        """Whether the server can be written to, and no other program does so."""
        return self.session.connected and not (self._token and self._token.hindrance)

    async def found(self, deadline_s: float) -> Mapping[str, float | None] | None:
        """Return the offsets that stand in the machine, once per connection.

        They are what acts now where a node tells, otherwise what was accepted. As long as one of
        them cannot be read there is no news, and nothing is written.
        """
        generation = self.session.generation
        if not self.session.connected:
            self.failure = self.session.failure
            return None
        if self._found_in == generation:
            return None
        if not await self._learn(deadline_s):
            return None
        found = await self._read_offsets(deadline_s)
        if found is None or self.session.generation != generation or not self.connected:
            return None
        offsets = {
            name: applied.effective_um
            if self._outputs[name].effective_node
            else applied.accepted_um
            for name, applied in found.items()
        }
        unknown = [name for name, offset in offsets.items() if offset is None]
        if unknown:
            self.failure = self._hindrance = _failure("offset_of_unreadable", unknown)
            return None
        self.failure = self._hindrance = None
        self._found_in = generation
        self._requested = {}
        return offsets

    async def write(self, correction_um: Mapping[str, float], deadline_s: float) -> bool:
        """Write offsets and a moved heartbeat; return whether all were accepted."""
        if not self.connected or self._found_in != self.session.generation:
            self.failure = self._hindrance or _NOT_FOUND
            return False
        unusable = [
            name
            for name, value in correction_um.items()
            if name not in self._outputs or not math.isfinite(value)
        ]
        if unusable or not correction_um:
            self.failure = _failure("no_finite_correction", unusable)
            return False
        values = [
            (self._outputs[name].node, value * self._factors[name])
            for name, value in correction_um.items()
        ]
        names = [*correction_um]
        if self._heartbeat_node:
            self._beat = float(next_beat(self._beat, self._beat_type))
            values.append((self._heartbeat_node, self._beat))
            names.append(HEARTBEAT)
        if self._token is not None:
            values.append((self._token.node, float(self._token.renewed())))
            names.append(TOKEN)
        codes = await self.session.write(values, deadline_s)
        if codes is None:
            self.failure = self.session.failure or _NOT_ANSWERED
            return False
        self.refused = {
            name: code for name, code in zip(names, codes, strict=True) if code != "Good"
        }
        self._requested.update(
            {name: um for name, um in correction_um.items() if name not in self.refused}
        )
        self.failure = _refusal(self.refused)
        return not self.refused

    async def read_back(self, deadline_s: float) -> Mapping[str, Applied]:
        """Return what the machine says about every output."""
        found = None
        if self.session.connected:
            found = await self._read_offsets(deadline_s)
        if found is None:
            return {name: Applied(self._requested.get(name), None) for name in self._outputs}
        return found

    async def close(self) -> None:
        """End the connection, unless a source still uses it."""
        self._found_in = 0
        await self.session.close()

    async def _learn(self, deadline_s: float) -> bool:
        """Learn where the heartbeat stands and of which type it is, and whether offsets fit."""
        nodes = [output.node for output in self._outputs.values()]
        if self._heartbeat_node:
            nodes.append(self._heartbeat_node)
        kinds = await self.session.types(nodes, deadline_s)
        if kinds is None:
            return False
        coarse = [
            name
            for name, output in self._outputs.items()
            if kinds[output.node] in WHOLE_RANGES and abs(self._factors[name]) < 1.0
        ]
        if coarse:
            self.failure = self._hindrance = _failure("unit_too_coarse", coarse)
            return False
        if self._heartbeat_node:
            self._beat_type = kinds[self._heartbeat_node]
            beats = await self.session.read((self._heartbeat_node,), deadline_s)
            if beats is None:
                return False
            self._beat = plain_number(beats[0])
        return True

    async def _read_offsets(self, deadline_s: float) -> dict[str, Applied] | None:
        found = await self.session.read(self._asked, deadline_s)
        if found is None:
            return None
        values = iter(found)
        result: dict[str, Applied] = {}
        for name, output in self._outputs.items():
            factor = self._factors[name]
            accepted_um = _good(next(values), factor)
            effective_um = _good(next(values), factor) if output.effective_node else None
            result[name] = Applied(self._requested.get(name), accepted_um, effective_um)
        if self._token is not None:
            self._token.look(_good(next(values)))
            if self._token.hindrance is not None:
                self._found_in = 0
                self.failure = self._hindrance = self._token.hindrance
        return result


def _asked(outputs: Mapping[str, OpcUaOutput]) -> Iterator[str]:
    for output in outputs.values():
        yield output.read_back_node or output.node
        if output.effective_node:
            yield output.effective_node


def _good(value: ua.DataValue, factor: float = 1.0) -> float | None:
    """Return a number of the machine over a factor; None where its status is not good."""
    if value.StatusCode is not None and not value.StatusCode.is_good():
        return None
    raw = plain_number(value)
    if raw is None or isinstance(raw, bool):
        return None
    try:
        number = float(raw) / factor
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


_REFUSALS: Final = {
    "BadUserAccessDenied": "error-write_right_missing",
    "BadNotWritable": "error-node_not_writable",
    "BadNodeIdUnknown": "error-no_such_node",
    "BadTypeMismatch": "error-node_no_number",
    "BadOutOfRange": "error-write_out_of_range",
}


def _failure(code: str, names: Sequence[str]) -> Message:
    return Message(f"error-{code}", {"names": tuple(names)})


def _refusal(refused: Mapping[str, str]) -> Message | None:
    """Return what was refused, by what the first was refused for."""
    if not refused:
        return None
    shown = tuple(f"{name} ({code})" for name, code in refused.items())
    code = next(iter(refused.values()))
    return Message(_REFUSALS.get(code, "error-write_refused"), {"refused": shown})
