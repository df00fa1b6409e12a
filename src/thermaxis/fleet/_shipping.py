"""Ship the finished parts of a history to a lake: each once, confirmed, nothing deleted.

Which parts are confirmed is noted beside the days: the history then keeps what is not.
"""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from typing import final

import polars as pl

from thermaxis.codes import Message, Place, remark
from thermaxis.errors import DataError
from thermaxis.fleet._lake import Lake
from thermaxis.runtime.history import Part, note_shipped, printable_cause

Report = Callable[[str, int, int], None]


@final
@dataclass(frozen=True, slots=True)
class Shipment:
    """What was shipped."""

    parts: int
    """Files of hours and days in the history. [1]"""
    sent: int
    """Of them sent now, and confirmed. [1]"""
    sent_bytes: int
    """What that was. [byte]"""
    remarks: tuple[Message, ...]
    """Parts that are kept apart, as the lake has others in their place; were sent again, as the
    lake's were cut; or are damaged themselves or of days to come, and were not sent. Their place
    says which."""


def ship(
    parts: Sequence[Part],
    lake: Lake,
    *,
    report: Report = lambda _step, _done, _total: None,
) -> Shipment:
    """Send the parts of a history that a lake does not have.

    A part that stands in contradiction to what is there goes to ``apart/`` beside the machines: of
    the same ids with other content, or of ids that overlap as no joined day's do. So it is when a
    history was begun anew, or two machines have one name. Ended at any time and called again it
    goes on; two at once do the same work twice, with the same result.

    Parameters
    ----------
    parts : sequence of Part
        `HistoryReader.parts`.
    lake : Lake
        Where to.
    report : callable
        Called with step, parts done and their number.

    Returns
    -------
    Shipment
        What was sent, and what is wrong.

    Raises
    ------
    DataError
        If the lake cannot be read or written, such as with a full disk.
    """
    sent, sent_bytes = 0, 0
    remarks: list[Message] = []
    confirmed: list[Part] = []
    try:
        for number, part in enumerate(parts):
            report("shipping", number, len(parts))
            try:
                found = _looked_at(part)
                folder, code = ("", found) if found else _place_of(part, lake)
                if folder:
                    lake.put(part, folder)
                    sent += 1
                    sent_bytes += part.minutes.stat().st_size + part.cycles.stat().st_size
            except FileNotFoundError:
                if part.cycles.exists():
                    raise
                continue  # joined meanwhile: it goes with its day the next time
            if code:
                remarks.append(Message(f"remark-{code}", place=Place(str(part.cycles))))
            if not found:
                confirmed.append(part)
    finally:
        remarks += _noted(confirmed)
    return Shipment(len(parts), sent, sent_bytes, tuple(remarks))


def _noted(confirmed: Sequence[Part]) -> list[Message]:
    """Tell the history what may be deleted; say where it cannot be told."""
    if not confirmed:
        return []
    try:
        note_shipped(confirmed)
    except OSError as error:
        said = remark("shipped_unnoted", cause=printable_cause(error))
        return [replace(said, place=Place(str(confirmed[0].folder.parent)))]
    return []


def _looked_at(part: Part) -> str:
    """Return what is wrong with a part itself: a cut file has no end that says what it holds."""
    if part.folder.name > f"day={datetime.now(UTC).date()}":  # of a rehearsal in virtual time
        return "part_of_future"
    try:
        pl.read_parquet_schema(part.minutes)
        rows = int(pl.scan_parquet(part.cycles).select(pl.len()).collect().item())
    except pl.exceptions.PolarsError:
        return "part_unreadable"
    return "" if rows == part.last - part.first + 1 else "part_unreadable"


def _place_of(part: Part, lake: Lake) -> tuple[str, str]:
    """Return the folder to which a part is to be sent, empty for none, and what is remarkable."""
    folder = f"{part.folder.parent.name}/{part.folder.name}"
    own = hashlib.sha256(part.minutes.read_bytes()).hexdigest()
    sums = lake.sums(folder, part)
    if sums.get(part.minutes.name) == own:
        return ("", "") if _is_whole(part, folder, lake) else (folder, "part_sent_again")
    if not sums and not any(_contradicts(part, o, folder, lake) for o in lake.parts(folder)):
        return folder, ""
    apart = f"apart/{folder}/{own[:16]}"
    there = bool(lake.sums(apart, part)) and _is_whole(part, apart, lake)
    return "" if there else apart, "part_kept_apart"


def _is_whole(part: Part, folder: str, lake: Lake) -> bool:
    """Return whether both files are as long as those of the history."""
    paths = (part.minutes, part.cycles)
    return all(lake.size(f"{folder}/{path.name}") == path.stat().st_size for path in paths)


def _contradicts(part: Part, other: Part, folder: str, lake: Lake) -> bool:
    """Return whether ids overlap, but for an hour all of whose minutes the day has, too."""
    if part.last < other.first or other.last < part.first:
        return False
    if not part.first <= other.first <= other.last <= part.last:
        return True
    try:
        earlier = lake.frame(folder, other)
    except DataError:
        return False  # a damaged hour is made good by its day
    joined = pl.read_parquet(part.minutes)
    if not set(earlier.columns) <= set(joined.columns):
        return True
    return bool(earlier.join(joined, on=earlier.columns, how="anti", nulls_equal=True).height)
