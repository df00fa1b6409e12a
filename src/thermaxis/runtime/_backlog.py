"""What waits to be stored: taken at once, kept up to a bound, every loss counted."""

import threading
from collections import deque
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import Final, Generic, NamedTuple, Protocol, TypeVar, final

_OBJECT_BYTES = 300  # an item with its tuples and numbers, measured with sys.getsizeof
_ROOM = 0.95  # of the bound is left after room was made, so that events are seldom passed by


_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
_MICROSECOND = timedelta(microseconds=1)


def to_us(moment: datetime) -> int:
    """Return an aware time as microseconds since 1970."""
    return (moment - _EPOCH) // _MICROSECOND


def from_us(time_us: int) -> datetime:
    """Return microseconds since 1970 as an aware time in UTC."""
    return _EPOCH + timedelta(microseconds=time_us)


class Entry(Protocol):
    """A row, or an event between rows."""

    @property
    def utc_us(self) -> int:
        """Time. [µs since 1970]"""
        ...

    @property
    def size(self) -> int:
        """Memory that its content takes. [byte]"""
        ...

    @property
    def is_row(self) -> bool:
        """Whether it is a row."""
        ...


_Entry = TypeVar("_Entry", bound=Entry)


class Loss(NamedTuple):
    """What was lost."""

    rows: int = 0
    """Rows. [1]"""
    events: int = 0
    """Events. [1]"""
    first_us: int = 0
    """Earliest time among them. [µs]"""
    last_us: int = 0
    """Latest time among them. [µs]"""

    def __or__(self, other: "Loss") -> "Loss":
        """Return both together."""
        if not (self.number and other.number):
            return self if self.number else other
        first_us, last_us = min(self.first_us, other.first_us), max(self.last_us, other.last_us)
        return Loss(self.rows + other.rows, self.events + other.events, first_us, last_us)

    @property
    def number(self) -> int:
        """Rows and events together. [1]"""
        return self.rows + self.events


@final
class Backlog(Generic[_Entry]):
    """Rows and events that wait, for one thread that adds and one that stores.

    Too much is never kept: the oldest rows go first, events only where they alone take a quarter
    of the memory. What is being stored at the moment is never dropped.
    """

    def __init__(self, largest_bytes: int) -> None:
        self._largest = largest_bytes
        self._lock = threading.Lock()
        self._items: deque[_Entry] = deque()
        self._flying: list[_Entry] = []
        self._bytes = {True: 0, False: 0}
        self._closed = False
        self.lost = Loss()
        """What was lost since the start."""
        self.unstated = Loss()
        """The loss that no event tells of yet."""
        self.arrived = threading.Event()
        """Set when something has come."""

    @property
    def waiting(self) -> int:
        """What waits or is being stored. [1]"""
        return len(self._items) + len(self._flying)

    def add(self, item: _Entry) -> None:
        """Take a row or an event."""
        with self._lock:
            self._weigh(item, 1)
            self._items.append(item)
            if self._closed:
                self._lose(self._items.pop())
            self._make_room()
        self.arrived.set()

    def add_loss(self, loss: Loss) -> None:
        """Count something as lost that was never taken."""
        with self._lock:
            self._count(loss)
        self.arrived.set()

    def take(self, most: int) -> Sequence[_Entry]:
        """Return the oldest items; they stay here until `stored`, `put_back` or `drop_taken`."""
        with self._lock:
            while self._items and len(self._flying) < most:
                self._flying.append(self._items.popleft())
            return tuple(self._flying)

    def stored(self, stated: Loss = Loss()) -> None:  # noqa: B008 - it cannot change
        """Forget what was taken: it is stored, with an event that tells of a loss."""
        with self._lock:
            for item in self._flying:
                self._weigh(item, -1)
            self._flying = []
            rows, events = (a - b for a, b in zip(self.unstated[:2], stated[:2], strict=True))
            self.unstated = self.unstated._replace(rows=rows, events=events)

    def put_back(self) -> None:
        """Let what was taken wait again."""
        with self._lock:
            self._items.extendleft(reversed(self._flying))
            self._flying = []
            self._make_room()

    def drop_taken(self) -> None:
        """Count what was taken as lost: the database refuses it for what it is."""
        with self._lock:
            for item in self._flying:
                self._lose(item)
            self._flying = []

    def give_up(self) -> None:
        """Count everything that waits as lost, and take nothing any more."""
        self.put_back()
        with self._lock:
            self._closed = True
            while self._items:
                self._lose(self._items.popleft())

    # ---- with the lock held ---------------------------------------------------------------------

    def _weigh(self, item: _Entry, sign: int) -> None:
        self._bytes[item.is_row] += sign * (_OBJECT_BYTES + item.size)

    def _count(self, loss: Loss) -> None:
        self.lost |= loss
        self.unstated |= loss

    def _lose(self, item: _Entry) -> None:
        self._weigh(item, -1)
        self._count(Loss(int(item.is_row), int(not item.is_row), item.utc_us, item.utc_us))

    def _make_room(self) -> None:
        if sum(self._bytes.values()) <= self._largest:
            return
        kept: list[_Entry] = []
        while self._items and sum(self._bytes.values()) > _ROOM * self._largest:
            item = self._items.popleft()
            if item.is_row == (self._bytes[False] <= self._largest // 4):
                self._lose(item)
            else:
                kept.append(item)
        self._items.extendleft(reversed(kept))
