"""Where the loop left the offsets, and where it finds them when it looks again.

A loop that stood still, or lost its connection, goes on from what it finds: the machine's watchdog
may have taken the offset back meanwhile. That is right, and the tool point has moved all the same,
so that somebody has to be told.
"""

from collections.abc import Mapping
from typing import Final, NamedTuple, final

from thermaxis.runtime._ports import Applied

TOLD_S: Final = 3600.0
"""An offset that was found elsewhere is told for so long, unless somebody acknowledges it before.
Default: an hour, in which somebody passes by. [s]"""


class FoundElsewhere(NamedTuple):
    """An offset that was not where the loop had left it."""

    output: str
    """Name of the output."""
    found_um: float
    """Where it was found. [µm]"""
    left_um: float
    """Where it was left. [µm]"""
    number: int
    """Number of the cycle that found it. [1]"""
    at_s: float
    """When, monotonic. [s]"""


class _Left(NamedTuple):
    """Where an offset was left."""

    written_um: float
    lowest_um: float
    highest_um: float


@final
class LeftOffsets:
    """Remembers where offsets were left, and which were found elsewhere.

    An offset may be anywhere between what was written and what the machine last said of it: it may
    follow slowly, and a write without an answer may have arrived.

    Not protected: only what is found at a connection or after a silence is compared. Somebody who
    writes the offset and puts it back before the loop looks is not noticed, and neither is a
    movement smaller than the tolerance of the read-back.
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
        """Remember where the offsets are after a write.

        Parameters
        ----------
        written_um : mapping
            What was written, by output. [µm]
        applied : mapping
            What the machine says of it, by output.
        refused : bool
            Whether the write has failed, so that the offset may be where it was before. Default:
            not.
        """
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
        now_s: float,
    ) -> None:
        """Compare what is found with what was left.

        Parameters
        ----------
        found_um : mapping
            What stands in the machine, by output; None where it is not known. [µm]
        tolerance_um : float
            Tolerance of the read-back. [µm]
        number : int
            Number of the cycle. [1]
        now_s : float
            Time, monotonic. [s]
        """
        for name, value_um in found_um.items():
            left = self._left.get(name)
            if left is None or value_um is None:
                continue
            beyond_um = max(left.lowest_um - value_um, value_um - left.highest_um)
            if beyond_um > tolerance_um:
                self._elsewhere[name] = FoundElsewhere(
                    name, value_um, left.written_um, number, now_s
                )
            # what is found is told once, and is where it stands from now on
            self._left[name] = _Left(value_um, value_um, value_um)

    def acknowledge(self) -> None:
        """Tell no more of what was found so far."""
        self._elsewhere.clear()

    def elsewhere(self, now_s: float) -> tuple[FoundElsewhere, ...]:
        """Return what was found elsewhere and is still to be told.

        Parameters
        ----------
        now_s : float
            Time, monotonic. [s]

        Returns
        -------
        tuple of FoundElsewhere
            The last one of every output that is younger than `TOLD_S`.
        """
        return tuple(one for one in self._elsewhere.values() if now_s - one.at_s < TOLD_S)
