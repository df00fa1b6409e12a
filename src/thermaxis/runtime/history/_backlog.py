"""What waits to be stored: taken at once, kept up to a bound, every loss counted."""

import threading
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple, final

from thermaxis.runtime.history._columns import Row


class PackedEvent(NamedTuple):
    """An event as it is stored."""

    utc_us: int
    """Time of day. [µs]"""
    kind: str
    """Its kind."""
    who: str
    """Who caused it."""
    code: str
    """Key of its sentence; empty where it has none."""
    text: str
    """What happened."""
    details: str
    """JSON."""


class Loss(NamedTuple):
    """What was lost."""

    cycles: int = 0
    """Cycles. [1]"""
    events: int = 0
    """Events. [1]"""
    first_us: int = 0
    """Earliest time of day among them. [µs]"""
    last_us: int = 0
    """Latest time of day among them. [µs]"""

    def __bool__(self) -> bool:
        """Whether anything was lost."""
        return self.cycles > 0 or self.events > 0

    def __or__(self, other: "Loss") -> "Loss":
        """Return both together."""
        if not (self and other):
            return self or other
        return Loss(
            self.cycles + other.cycles,
            self.events + other.events,
            min(self.first_us, other.first_us),
            max(self.last_us, other.last_us),
        )


NO_LOSS = Loss()
"""Nothing was lost."""


class Item(NamedTuple):
    """Something that waits."""

    seq: int
    """Its number in this run: items are stored in this order. [1]"""
    content: Row | PackedEvent
    """A cycle or an event."""
    size: int
    """Memory that it is counted with. [byte]"""
    states: Loss | None = None
    """The loss that an event of the historian itself tells of; None for everything else."""

    @property
    def as_loss(self) -> Loss:
        """What is lost with it."""
        time_us = self.content.utc_us
        cycles = int(isinstance(self.content, Row))
        return Loss(cycles, 1 - cycles, time_us, time_us)


_OBJECT_BYTES = 300  # an item with its tuples and numbers, measured with sys.getsizeof


@final
class Backlog:
    """Cycles and events that wait, for one thread that adds and one that stores.

    Too much is never kept: the oldest cycles go first, events only when they alone take a quarter
    of the memory. What is being stored at the moment is never dropped.
    """

    def __init__(self, largest_bytes: int) -> None:
        self._largest = largest_bytes
        self._lock = threading.Lock()
        self._cycles: deque[Item] = deque()
        self._events: deque[Item] = deque()
        self._flying: list[Item] = []
        self._bytes = 0
        self._event_bytes = 0
        self._seq = 0
        self._unstated = NO_LOSS
        self._lost = 0
        self._closed = False
        self.arrived = threading.Event()
        """Set while something waits."""
        self.empty = threading.Event()
        """Set while nothing waits."""
        self.empty.set()

    @property
    def waiting(self) -> int:
        """What waits or is being stored. [1]"""
        return len(self._cycles) + len(self._events) + len(self._flying)

    @property
    def lost(self) -> int:
        """What was lost since the start. [1]"""
        return self._lost

    def add_cycle(self, packed: Row) -> None:
        """Take a cycle."""
        size = _OBJECT_BYTES + packed.size
        with self._lock:
            self.empty.clear()
            if self._closed:
                self._count(Loss(1, 0, packed.utc_us, packed.utc_us))
                return
            self._cycles.append(Item(self._next(), packed, size))
            self._bytes += size
            self._keep_bound()
        self.arrived.set()

    def add_event(self, packed: PackedEvent, states: Loss | None = None) -> None:
        """Take an event; with the loss that it tells of, it is one of the historian itself."""
        size = 2 * _OBJECT_BYTES + len(packed.who) + len(packed.text) + len(packed.details)
        with self._lock:
            self.empty.clear()
            item = Item(self._next(), packed, size, states)
            if self._closed:
                self._lose(item)
                return
            self._events.append(item)
            self._bytes += size
            self._event_bytes += size
            self._keep_bound()
        self.arrived.set()

    def add_loss(self, loss: Loss) -> None:
        """Count something as lost that was never taken."""
        with self._lock:
            self._count(loss)

    def take(self, most: int) -> Sequence[Item]:
        """Return the oldest items in their order; they stay here until `stored` or `put_back`."""
        with self._lock:
            if not self._flying:
                queues = (self._cycles, self._events)
                while len(self._flying) < most and any(queues):
                    queue = min((q for q in queues if q), key=lambda q: q[0].seq)
                    self._flying.append(queue.popleft())
                self._rest()
            return tuple(self._flying)

    def stored(self) -> None:
        """Forget what was taken: it is stored."""
        with self._lock:
            self._forget(self._flying)
            self._flying = []
            self._rest()

    def put_back(self, stored_seq: int = -1) -> None:
        """Let what was taken wait again, but for what is stored all the same up to a number.

        The database says so after a connection was lost whose last answer never came.
        """
        with self._lock:
            self._forget([item for item in self._flying if item.seq <= stored_seq])
            for item in reversed(self._flying):
                if item.seq > stored_seq:
                    queue = self._cycles if isinstance(item.content, Row) else self._events
                    queue.appendleft(item)
            self._flying = []
            self._keep_bound()
            self._rest()

    def drop_taken(self) -> None:
        """Count what was taken as lost: the database refuses it for what it is."""
        with self._lock:
            for item in self._flying:
                self._lose(item)
            self._forget(self._flying)
            self._flying = []
            self._rest()

    def take_loss(self) -> Loss:
        """Return the loss that no event tells of yet; it is then taken as told."""
        with self._lock:
            loss, self._unstated = self._unstated, NO_LOSS
            return loss

    def give_up(self) -> None:
        """Count everything that waits as lost, and take nothing any more."""
        with self._lock:
            self._closed = True
            for queue in (self._flying, self._cycles, self._events):
                for item in queue:
                    self._lose(item)
            self._cycles.clear()
            self._events.clear()
            self._flying = []
            self._bytes = self._event_bytes = 0

    # ---- with the lock held ---------------------------------------------------------------------

    def _next(self) -> int:
        self._seq += 1
        return self._seq

    def _count(self, loss: Loss) -> None:
        self._lost += loss.cycles + loss.events
        self._unstated |= loss

    def _lose(self, item: Item) -> None:
        if item.states is None:
            self._count(item.as_loss)
        else:  # what it tells of was counted before; another event must tell of it
            self._unstated |= item.states

    def _forget(self, items: Sequence[Item]) -> None:
        for item in items:
            self._bytes -= item.size
            if isinstance(item.content, PackedEvent):
                self._event_bytes -= item.size

    def _keep_bound(self) -> None:
        while self._events and self._event_bytes > self._largest // 4:
            self._drop(self._events)
        while self._cycles and self._bytes > self._largest:
            self._drop(self._cycles)

    def _drop(self, queue: deque[Item]) -> None:
        item = queue.popleft()
        self._forget([item])
        self._lose(item)

    def _rest(self) -> None:
        if not (self._cycles or self._events or self._flying):
            self.arrived.clear()
            self.empty.set()
