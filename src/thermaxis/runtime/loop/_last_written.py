"""Where the loop left the offsets, and where it finds them when it looks again.

A loop that stood still, or lost its connection, goes on from what it finds: the machine's watchdog
may have taken the offset back meanwhile. That is right, and the tool point has moved all the same,
so that somebody has to be told.
"""

from collections.abc import Collection, Mapping
from typing import NamedTuple, final

from thermaxis.runtime._ports import Applied
from thermaxis.runtime.status import FoundElsewhere


class _Left(NamedTuple):
    """Where an offset was left."""

    written_um: float
    lowest_um: float
    highest_um: float


@final
class LastWrittenOffsets:
    """Remembers where offsets were left, and which were found elsewhere.

    An offset may be anywhere between what was written and what the machine last said of it: it may
    follow slowly, and a write without an answer may have arrived.

    Not protected: only what is found at a connection or after a silence is compared. Somebody who
    writes the offset and puts it back before the loop looks is not noticed, and neither is a
    movement smaller than the tolerance of the read-back. What was found is not saved: a restart
    tells of it no more, and only the history has it.
    """

    def __init__(self) -> None:
        self._left: dict[str, _Left] = {}
        self._elsewhere: dict[str, FoundElsewhere] = {}

    def leave(
        self,
        written_um: Mapping[str, float],
        applied: Mapping[str, Applied],
        *,
        refused: bool = False,
    ) -> None:
        """Remember where the offsets are after a write."""
        for name, value_um in written_um.items():
            said = applied.get(name, Applied(None, None))
            places = [value_um, said.accepted_um, said.effective_um]
            before = self._left.get(name)
            if refused and before is not None:
                places += [before.lowest_um, before.highest_um]
                value_um = before.written_um  # noqa: PLW2901 - what counts as left is the one before
            known = [place for place in places if place is not None]
            self._left[name] = _Left(value_um, min(known), max(known))

    def forget(self) -> None:
        """Forget where they were left: nothing keeps them there any more."""
        self._left.clear()

    def compare(
        self,
        found_um: Mapping[str, float | None],
        tolerance_um: float,
        *,
        number: int,
    ) -> tuple[FoundElsewhere, ...]:
        """Compare what is found with what was left."""
        new: list[FoundElsewhere] = []
        for name, value_um in found_um.items():
            left = self._left.get(name)
            if left is None or value_um is None:
                continue
            beyond_um = max(left.lowest_um - value_um, value_um - left.highest_um)
            if beyond_um > tolerance_um:
                self._elsewhere[name] = FoundElsewhere(name, value_um, left.written_um, number)
                new.append(self._elsewhere[name])
            # what is found is told once, and is where it stands from now on
            self._left[name] = _Left(value_um, value_um, value_um)
        return tuple(new)

    def acknowledge(self, shown: Collection[str]) -> None:
        """Tell no more of what somebody has seen."""
        for name, one in tuple(self._elsewhere.items()):
            if one.key in shown:
                del self._elsewhere[name]

    def elsewhere(self) -> tuple[FoundElsewhere, ...]:
        """Return what was found elsewhere and is still to be told."""
        return tuple(self._elsewhere.values())
