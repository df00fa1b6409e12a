"""The state of the loop in a file, so that a restart goes on where the last run was.

Two files take turns, each with a checksum: whatever moment the power fails, one of them is whole.
"""

import hashlib
import json
import math
import os
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, final

from thermaxis.codes import Message
from thermaxis.compensation import (
    Compensation,
    CycleState,
    Memory,
    Reason,
    SensorState,
    SupervisorState,
    ThermalState,
    Trim,
    cycle_state,
    initial_state,
)

STATE_FORMAT = "thermaxis-loop-state"
STATE_VERSION = 2
LARGEST_STATE_BYTES = 64 * 1024 * 1024
_DAMAGE = (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError)


NO_FILE: Final = "why-no_file"
"""Nothing was saved."""
DAMAGED: Final = "why-damaged"
"""What was saved cannot be read."""
OTHER_VERSION: Final = "why-other_version"
"""What was saved is of another version of the program."""


class _OtherVersionError(Exception):
    """A whole state of another version."""

    def __init__(self, version: str) -> None:
        self.version = version
        super().__init__(version)


@final
@dataclass(frozen=True, slots=True)
class SavedState:
    """State of the loop at one time."""

    utc: datetime
    """Time of day, aware, in UTC."""
    monotonic_s: float
    """Monotonic time. [s]"""
    model_sha256: str
    """Hash of the model in force."""
    model_file: str
    """Its file name."""
    enabled: bool
    """Whether the compensation was enabled."""
    state: CycleState
    """State of the cycle."""


@final
class StateFile:
    """Two files that hold the state by turns: a path, and the same with ``.other`` added.

    Notes
    -----
    Not protected: a state belongs to one machine. Whoever copies the file to another machine
    gives it the first one's temperatures.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._places = (path, path.with_name(f"{path.name}.other"))
        self._turn = 0
        self._saves = 0
        self.failure: Message | None = None
        """Why the last save failed; None if it did not."""

    def save(self, saved: SavedState, compensation: Compensation) -> bool:
        """Save the state; a full disk is said in `failure` and stops nothing."""
        place = self._places[self._turn]
        fields = {**_to_json(saved, compensation), "saves": self._saves + 1}
        body = json.dumps(fields, separators=(",", ":"))
        digest = hashlib.sha256(body.encode()).hexdigest()
        draft = place.with_name(f"{place.name}.new")
        try:
            with draft.open("w", encoding="utf-8") as file:
                file.write(f"{digest}\n{body}\n")
                file.flush()
                os.fsync(file.fileno())  # else the new name may reach the disk before its content
            os.replace(draft, place)  # noqa: PTH105 - the one atomic step
        except OSError as error:
            detail = error.strerror or type(error).__name__
            self.failure = Message("event-state_unsaved", {"file": place.name, "detail": detail})
            return False
        self.failure = None
        self._turn = 1 - self._turn
        self._saves += 1
        return True

    def load(self, compensation: Compensation) -> tuple[SavedState | None, Message | None]:
        """Return the whole state that was saved last, in the shape of a compensation.

        Where there is none the message says why: `NO_FILE`, `DAMAGED`, or `OTHER_VERSION`, which
        is not guessed at.
        """
        found: list[tuple[int, datetime, int, SavedState]] = []
        why = Message(NO_FILE)
        for turn, place in enumerate(self._places):
            if not place.exists():
                continue
            try:
                saves, saved = _read(place, compensation)
            except _OtherVersionError as error:
                why = Message(OTHER_VERSION, {"file": place.name, "version": error.version})
            except (OSError, *_DAMAGE) as error:
                if why.code != OTHER_VERSION:
                    values = {"file": place.name, "detail": type(error).__name__}
                    why = Message(DAMAGED, values)
            else:
                found.append((saves, saved.utc, turn, saved))
        if not found:
            return None, why
        self._saves, _, turn, saved = max(found, key=lambda one: one[:2])
        self._turn = 1 - turn
        return saved, None


def _to_json(saved: SavedState, compensation: Compensation) -> dict[str, Any]:
    state = saved.state
    return {
        "format": STATE_FORMAT,
        "version": STATE_VERSION,
        "utc": saved.utc.isoformat(),
        "monotonic_s": saved.monotonic_s,
        "model_sha256": saved.model_sha256,
        "model_file": saved.model_file,
        "enabled": saved.enabled,
        "channels": compensation.model.channels,
        "outputs": [output.name for output in compensation.model.outputs],
        "state": {**state._asdict(), "thermal": state.thermal._asdict()},
    }


def _read(place: Path, compensation: Compensation) -> tuple[int, SavedState]:
    """Return how often a state had been saved before, which no clock can confuse, and the state."""
    if place.stat().st_size > LARGEST_STATE_BYTES:
        raise ValueError(place.name)
    digest, _, body = place.read_text(encoding="utf-8").partition("\n")
    body = body.rstrip("\n")
    if hashlib.sha256(body.encode()).hexdigest() != digest:
        raise ValueError(place.name)
    saved = json.loads(body)
    if saved["format"] != STATE_FORMAT:
        raise ValueError(place.name)
    if saved["version"] != STATE_VERSION:
        raise _OtherVersionError(str(saved["version"]))
    utc = datetime.fromisoformat(saved["utc"]).astimezone(UTC)
    return int(saved.get("saves", 0)), SavedState(
        utc,
        float(saved["monotonic_s"]),
        str(saved["model_sha256"]),
        str(saved["model_file"]),
        bool(saved["enabled"]),
        _fitted(saved, compensation),
    )


def _fitted(saved: dict[str, Any], compensation: Compensation) -> CycleState:
    """Return the state in the order of the compensation's channels and outputs."""
    raw, blank = saved["state"], cycle_state(compensation)
    model, thermal = compensation.model, raw["thermal"]
    names = [output.name for output in model.outputs]
    corrections = dict(zip(saved["outputs"], raw["correction_um"], strict=True))
    goals = dict(zip(saved["outputs"], raw["goal_um"], strict=True))
    trims = dict(zip(saved["outputs"], raw["trims"], strict=True))
    if saved["channels"] == list(model.channels) and saved["outputs"] == names:
        restored = ThermalState(**{name: _tuples(value) for name, value in thermal.items()})
    else:
        references = dict(zip(saved["channels"], thermal["reference"], strict=True))
        known = {c: r for c, r in references.items() if not math.isnan(r)}
        restored = initial_state(model, known)._replace(warm=True)
    memory = raw["memory"]
    state, fault = SupervisorState(memory[0]), memory[4]
    return blank._replace(
        thermal=restored,
        sensors=_sensors(saved["channels"], raw["sensors"], compensation),
        redundant=_sensors(saved["channels"], raw["redundant"], compensation),
        memory=Memory(*memory)._replace(
            state=state, fault=None if fault is None else Reason(fault)
        ),
        time_s=float(raw["time_s"]),
        correction_um=tuple(float(corrections.get(name, 0.0)) for name in names),
        goal_um=tuple(float(goals.get(name, 0.0)) for name in names),
        trims=tuple(Trim(*trims[name]) if name in trims else Trim() for name in names),
        diameter_mm=raw["diameter_mm"],
    )


def _sensors(
    channels: list[str], states: list[list[float]], compensation: Compensation
) -> tuple[SensorState, ...]:
    known = dict(zip(channels, states, strict=True))
    return tuple(SensorState(*known.get(c, ())) for c in compensation.model.channels)


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value  # pyright: ignore[reportUnknownArgumentType, reportUnknownVariableType]
