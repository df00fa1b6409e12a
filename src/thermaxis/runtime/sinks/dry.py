"""A sink that moves nothing: what would have been written stands in the historian and on screen."""

import math
from collections.abc import Mapping, Sequence
from typing import final

from thermaxis.runtime._ports import Applied, Sink


@final
class DrySink(Sink):
    """A machine that accepts everything and does nothing.

    Notes
    -----
    Not protected: that a dry run went well says nothing about sign and unit of the real axis.
    """

    def __init__(self, outputs: Sequence[str]) -> None:
        self._correction_um = dict.fromkeys(outputs, 0.0)
        self._told = False

    async def open(self) -> None:
        """Begin at zero."""

    @property
    def connected(self) -> bool:
        """A dry machine is always there."""
        return True

    async def found(self, deadline_s: float) -> Mapping[str, float | None] | None:  # noqa: ARG002 - the port's
        """Return zero for every output, once."""
        if self._told:
            return None
        self._told = True
        return dict.fromkeys(self._correction_um, 0.0)

    async def write(self, correction_um: Mapping[str, float], deadline_s: float) -> bool:  # noqa: ARG002 - the port's
        """Remember the corrections; nothing before `found`, and no number that is not finite."""
        if not self._told or not all(map(math.isfinite, correction_um.values())):
            return False
        self._correction_um.update(correction_um)
        return True

    async def read_back(self, deadline_s: float) -> Mapping[str, Applied]:  # noqa: ARG002 - the port's
        """Return what was remembered; nothing of it is effective."""
        return {name: Applied(c, c, None) for name, c in self._correction_um.items()}

    async def close(self) -> None:
        """End."""
