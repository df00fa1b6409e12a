"""What the board shows: who needs a look, and why, before the others."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from enum import StrEnum
from typing import Any, Final, cast, final

from thermaxis.codes import Message, value_of_json
from thermaxis.fleet import SENSOR_CAUSES, Judgement, NightOutcome, Standing, StoredNight

MOST_LINES: Final = 200
"""Machines of a list that are shown at once; more are found by kind and name. [1]"""


@final
class Need(StrEnum):
    """Why a machine needs a look, the gravest first."""

    SET_ASIDE = "set_aside"
    """Its night failed twice."""
    NAMED = "named"
    """It departs from its past and its sisters."""
    NO_NIGHT = "no_night"
    """It has no night of the day that was judged last: nobody watches it."""
    SENSORS = "sensors"
    """Sensors of its model are not to be believed."""
    PROPOSAL = "proposal"
    """A proposal waits for a decision."""


@final
@dataclass(frozen=True, slots=True)
class Line:
    """A machine on the board."""

    machine: str
    """Its name."""
    kind: str
    """Its kind."""
    day: date | None
    """Day of its newest night; None without any."""
    outcome: str
    """What became of that night."""
    needs: Mapping[Need, tuple[Message, ...]]
    """Why it needs a look, with what was found; empty where it needs none."""
    worst: Mapping[str, Any]
    """Figures of the output that the model leaves most of."""
    proposed_sha256: str | None
    """Hash of the proposal that waits for a decision."""
    judgement: Judgement | None = None
    """Why it is named; None where it is not."""
    model_sha256: str = ""
    """Hash of the model in force."""

    @property
    def sensors_first(self) -> bool:
        """Whether it is named for a sensor, so that no model may be accepted."""
        return self.judgement is not None and not SENSOR_CAUSES.isdisjoint(self.judgement.causes)


def lines_of(
    standings: Sequence[Standing], judged: Sequence[Judgement] = (), day: date | None = None
) -> list[Line]:
    """Return the machines as the board shows them: who needs a look, the gravest first.

    Parameters
    ----------
    standings : sequence of Standing
        How they stand, by name.
    judged : sequence of Judgement
        Who is named of the day that was judged last, the surest first.
    day : date, optional
        That day. Default: none was.
    """
    named = {one.machine: (place, one) for place, one in enumerate(judged)}
    order = list(Need)

    def place_of(line: Line) -> tuple[int, int]:
        gravest = min(map(order.index, line.needs), default=len(order))
        return gravest, named[line.machine][0] if line.judgement is not None else 0

    lines = [_line(one, named.get(one.machine, (0, None))[1], day) for one in standings]
    return sorted(lines, key=place_of)


def _line(standing: Standing, judgement: Judgement | None, day: date | None) -> Line:
    night = standing.night
    needs: dict[Need, tuple[Message, ...]] = {}
    if night is not None and night.result["outcome"] == NightOutcome.SET_ASIDE:
        needs[Need.SET_ASIDE] = messages_of(night, "remark_codes")
    if judgement is not None:
        needs[Need.NAMED] = judgement.evidence
    if day is not None and (night is None or night.day < day):
        needs[Need.NO_NIGHT] = ()
    if night is not None and night.result["sensor_codes"]:
        said = {one.place.channel for one in needs.get(Need.NAMED, ())}
        sensors = messages_of(night, "sensor_codes")
        if others := tuple(one for one in sensors if one.place.channel not in said):
            needs[Need.SENSORS] = others
    if standing.proposed_sha256:
        why = () if night is None else messages_of(night, "relearn_codes")
        needs[Need.PROPOSAL] = why
    return Line(
        machine=standing.machine,
        kind=standing.kind,
        day=None if night is None else night.day,
        outcome="none" if night is None else str(night.result["outcome"]),
        needs=needs,
        worst={} if night is None else worst_of(night),
        proposed_sha256=standing.proposed_sha256,
        judgement=judgement,
        model_sha256=standing.model_sha256,
    )


def messages_of(night: StoredNight, key: str) -> tuple[Message, ...]:
    """Return messages of a night."""
    found = value_of_json(night.result[key])
    return tuple(one for one in cast("tuple[object, ...]", found) if isinstance(one, Message))


def worst_of(night: StoredNight) -> Mapping[str, Any]:
    """Return the figures of the output that the model leaves most of; none without any."""
    outputs = cast("Mapping[str, Mapping[str, Any]]", night.result["outputs"])
    none: Mapping[str, Any] = {}
    return max(outputs.values(), key=lambda one: float(one["rmse_um"]), default=none)
