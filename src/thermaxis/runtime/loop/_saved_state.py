"""The state of the loop in a file, so that a restart goes on where the last run was.

A new file takes the place of the old one in one step, once the disk has all of it, and has a
checksum: whatever moment the power fails, a whole one is there.
"""

import asyncio
import hashlib
import json
import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Final, NamedTuple, final

from thermaxis.codes import Message, printable
from thermaxis.compensation import (
    Compensation,
    CycleState,
    Memory,
    OffsetState,
    Reason,
    SensorState,
    SupervisorState,
    ThermalState,
    TouchOutcome,
    Trim,
    cycle_state,
    initial_state,
    shifted,
    with_compensation,
)
from thermaxis.runtime._offsets import OffsetMismatch
from thermaxis.runtime._ports import Clock
from thermaxis.runtime.loop._requests import LONGEST_TEXT
from thermaxis.runtime.loop._settings import LoopSettings

STATE_FORMAT = "thermaxis-loop-state"
STATE_VERSION = 2
LARGEST_STATE_BYTES = 64 * 1024 * 1024
SAVED_EVERY_S: Final = 1.0
"""The state is saved so often: what a kill may cost. [s]"""
CLOCK_STEP_S: Final = 10.0
"""A saved state may be newer than now by so much: a clock that was set. [s]"""
LAST_SAVE_S: Final = 2.0
"""Time that the last save is waited for. [s]"""
_DAMAGE = (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError)


NO_FILE: Final = "why-no_file"
"""Nothing was saved."""
DAMAGED: Final = "why-damaged"
"""What was saved cannot be read."""
OTHER_VERSION: Final = "why-other_version"
"""What was saved is of another version of the program."""


class _OtherVersionError(Exception):
    """A whole state of another version."""


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
    held_by: str = ""
    """Who held it last."""
    mismatches: tuple[OffsetMismatch, ...] = ()
    """What nobody has acknowledged yet."""


@final
class StateFile:
    """The file of the state.

    Parameters
    ----------
    path : Path
        Where it lies.
    every_s : float
        So often the loop saves, and at its end. Default: what a kill may cost. [s]

    Notes
    -----
    Not protected: a state belongs to one machine. Whoever copies the file to another machine
    gives it the first one's temperatures.
    """

    def __init__(self, path: Path, every_s: float = SAVED_EVERY_S) -> None:
        self.path, self.every_s = path, every_s
        self.failure: Message | None = None
        """Why the last save failed; None if it did not."""

    def save(self, saved: SavedState, compensation: Compensation) -> bool:
        """Save the state; a full disk is said in `failure` and stops nothing."""
        body = json.dumps(_to_json(saved, compensation), separators=(",", ":"))
        digest = hashlib.sha256(body.encode()).hexdigest()
        draft = self.path.with_name(f"{self.path.name}.new")
        try:
            with draft.open("w", encoding="utf-8") as file:
                file.write(f"{digest}\n{body}\n")
                file.flush()
                os.fsync(file.fileno())  # else the new name may reach the disk before its content
            os.replace(draft, self.path)  # noqa: PTH105 - the one atomic step
        except OSError as error:
            detail = error.strerror or type(error).__name__
            values = {"file": self.path.name, "detail": detail}
            self.failure = Message("event-state_unsaved", values)
            return False
        self.failure = None
        return True

    def load(self, compensation: Compensation) -> tuple[SavedState | None, Message | None]:
        """Return the state that was saved last, in the shape of a compensation.

        Where there is none the message says why: `NO_FILE`, `DAMAGED`, or `OTHER_VERSION`, which
        is not guessed at.
        """
        name = self.path.name
        try:
            return _read(self.path, compensation), None
        except FileNotFoundError:
            return None, Message(NO_FILE)
        except _OtherVersionError as error:
            return None, Message(OTHER_VERSION, {"file": name, "version": str(error)})
        except (OSError, *_DAMAGE) as error:
            return None, Message(DAMAGED, {"file": name, "detail": type(error).__name__})


def _to_json(saved: SavedState, compensation: Compensation) -> dict[str, Any]:
    kept = {**saved.state._asdict(), "thermal": saved.state.thermal._asdict()}
    for name in ("offsets", "expected"):
        del kept[name]  # what touches have taught starts anew with the machine
    names = [output.name for output in compensation.model.outputs]
    offsets = zip(names, saved.state.offsets, strict=False)
    return {
        "format": STATE_FORMAT,
        "version": STATE_VERSION,
        "utc": saved.utc.isoformat(),
        "monotonic_s": saved.monotonic_s,
        "model_sha256": saved.model_sha256,
        "model_file": saved.model_file,
        "enabled": saved.enabled,
        "held_by": saved.held_by,
        "mismatches": [(*one[:-1], one.utc and one.utc.isoformat()) for one in saved.mismatches],
        "channels": compensation.model.channels,
        "judged": compensation.judged,
        "outputs": names,
        "touches_void": {name: one.off for name, one in offsets if one.off},
        "state": kept,
    }


def _read(place: Path, compensation: Compensation) -> SavedState:
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
        raise _OtherVersionError(printable(str(saved["version"])))
    utc = datetime.fromisoformat(saved["utc"]).astimezone(UTC)
    return SavedState(
        utc,
        float(saved["monotonic_s"]),
        str(saved["model_sha256"]),
        str(saved["model_file"]),
        bool(saved["enabled"]),
        _fitted(saved, compensation),
        _named(saved.get("held_by")),
        tuple(_mismatch(*one) for one in saved.get("mismatches", ())),
    )


def _fitted(saved: dict[str, Any], compensation: Compensation) -> CycleState:
    """Return the state in the order of the compensation's channels and outputs."""
    raw, blank = saved["state"], cycle_state(compensation)
    model, thermal = compensation.model, raw["thermal"]
    names = [output.name for output in model.outputs]
    corrections = dict(zip(saved["outputs"], raw["correction_um"], strict=True))
    goals = dict(zip(saved["outputs"], raw["goal_um"], strict=True))
    trims = dict(zip(saved["outputs"], raw["trims"], strict=True))
    why: Any = saved.get("touches_void", ())  # at first names alone, for one cause
    why = dict.fromkeys(why, TouchOutcome.NO_EFFECT) | (why if type(why) is dict else {})  # pyright: ignore[reportUnknownVariableType] - JSON
    void = {name: TouchOutcome(why[name]) for name in compensation.touches.keys() & why}
    if saved["channels"] == list(model.channels) and saved["outputs"] == names:
        restored = ThermalState(**{name: _tuples(value) for name, value in thermal.items()})
    else:
        references = dict(zip(saved["channels"], thermal["reference"], strict=True))
        known = {c: r for c, r in references.items() if not math.isnan(r)}
        restored = initial_state(model, known)._replace(warm=True)
    judged, memory = saved.get("judged", saved["channels"]), raw["memory"]
    state, fault = SupervisorState(memory[0]), memory[4]
    return blank._replace(
        thermal=restored,
        sensors=_sensors(judged, raw["sensors"], compensation),
        redundant=_sensors(judged, raw["redundant"], compensation),
        memory=Memory(*memory)._replace(
            state=state, fault=None if fault is None else Reason(fault)
        ),
        time_s=float(raw["time_s"]),
        correction_um=tuple(float(corrections.get(name, 0.0)) for name in names),
        goal_um=tuple(float(goals.get(name, 0.0)) for name in names),
        trims=tuple(_trim(*trims.get(name, ())) for name in names),
        diameter_mm=raw["diameter_mm"],
        offsets=tuple(OffsetState(off=void.get(name)) for name in names) if void else (),
    )


def _sensors(
    channels: list[str], states: list[list[Any]], compensation: Compensation
) -> tuple[SensorState, ...]:
    known = dict(zip(channels, states, strict=True))
    return tuple(SensorState(*known.get(c, ())) for c in compensation.judged)


def _trim(value_um: float = 0.0, who: object = "", left_s: float = 0.0) -> Trim:
    return Trim(value_um, _named(who), left_s)


def _named(who: object) -> str:
    return printable(who, LONGEST_TEXT) if isinstance(who, str) else ""


def _mismatch(
    output: str, found_um: float, left_um: float, number: int, another: object, utc: str
) -> OffsetMismatch:
    found = float(found_um), float(left_um), int(number), bool(another)
    return OffsetMismatch(_named(output), *found, datetime.fromisoformat(utc).astimezone(UTC))


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value  # pyright: ignore[reportUnknownArgumentType, reportUnknownVariableType] - JSON


# ---- taken up again ------------------------------------------------------------------------------


class TakenUp(NamedTuple):
    """What a loop begins with."""

    state: CycleState | None
    """State of the cycle; None for a cold start."""
    event: Message
    """What was taken up, or why nothing was."""
    other_version: Message | None = None
    """Why a saved state of another version was not used."""
    held_by: str = ""
    """Who held it last."""
    mismatches: tuple[OffsetMismatch, ...] = ()
    """Offsets found elsewhere that nobody has acknowledged."""


def take_up(
    file: StateFile, compensation: Compensation, settings: LoopSettings, clock: Clock
) -> TakenUp:
    """Take up a saved state as far as its age allows, and say what was taken."""
    saved, why = file.load(compensation)
    if saved is None:
        other = why if why is not None and why.code == OTHER_VERSION else None
        return TakenUp(None, Message("event-no_saved_state", {"why": why}), other)
    age_s = (clock.utc() - saved.utc) / timedelta(seconds=1)
    if age_s < -CLOCK_STEP_S:
        old = saved.state.memory
        state = cycle_state(compensation)._replace(offsets=saved.state.offsets)  # void stays void
        if old.state is not SupervisorState.FAULT:
            return TakenUp(state, Message("event-saved_state_newer"))
        state = state._replace(memory=_latched(old))
        return TakenUp(state, Message("event-saved_state_newer_fault", {"reason": old.fault}))
    age_s = max(0.0, age_s)
    state, taken = resumed(saved, compensation, settings, now_s=clock.monotonic_s(), age_s=age_s)
    event = Message("event-saved_state", {"age_s": age_s, "resumed": taken})
    names = {output.name for output in compensation.model.outputs}
    unseen = tuple(one for one in saved.mismatches if one.output in names)
    return TakenUp(state, event, held_by=saved.held_by, mismatches=unseen)


def resumed(
    saved: SavedState,
    compensation: Compensation,
    settings: LoopSettings,
    *,
    now_s: float,
    age_s: float,
) -> tuple[CycleState, Message]:
    """Return the state with which a loop goes on after a restart, and what it is."""
    state = shifted(saved.state, now_s - age_s - saved.monotonic_s)
    old = state.memory
    kept = Message("kept-sections")
    if saved.model_sha256 != settings.model_sha256:
        state = with_compensation(compensation, compensation, state)
        kept = Message("kept-other_model", {"file": saved.model_file})
    elif age_s > compensation.model.longest_gap_s:
        kept = Message("kept-steady_state")
    same = saved.model_sha256 == settings.model_sha256
    soon = age_s <= settings.resume_within_s
    enabled = saved.enabled and settings.resume_enabled and soon and same
    memory = Memory(
        state=_begun(saved, enabled=enabled),
        enabled=enabled,
        held=old.held and enabled,
        held_s=old.held_s + age_s if old.held else 0.0,
        running_s=state.memory.running_s,
    )
    taken = Message("resumed-enabled" if enabled else "resumed-off", {"kept": kept})
    if old.state is SupervisorState.FAULT:
        memory = _latched(old)
        taken = Message("resumed-fault", {"kept": kept, "reason": old.fault})
    trims = tuple(
        t._replace(left_s=t.left_s - age_s) if t.left_s > age_s else Trim() for t in state.trims
    )
    return state._replace(memory=memory, trims=trims), taken


def _begun(saved: SavedState, *, enabled: bool) -> SupervisorState:
    """Return the state after a restart: a fade goes on, and one that a latch holds back begins."""
    if enabled:
        return SupervisorState.WARMING
    old = saved.state.memory
    latched = old.enabled and not saved.enabled and old.state is SupervisorState.HOLDING
    fades = latched or old.state is SupervisorState.FADING
    return SupervisorState.FADING if fades else SupervisorState.OFF


def _latched(memory: Memory) -> Memory:
    """Return the memory of a fault that no restart forgets."""
    return Memory(state=SupervisorState.FAULT, enabled=memory.enabled, fault=memory.fault)


# ---- saved beside the cycles --------------------------------------------------------------------


@final
class Saver:
    """Saves the state as often as its file says; the cycles wait for no disk."""

    def __init__(self, file: StateFile | None, tell: Callable[[Message], None]) -> None:
        self._file, self._tell = file, tell
        self._saved_s = float("-inf")
        self._decided: tuple[object, ...] = ()
        self._saving: asyncio.Future[bool] | None = None
        self._unsaved: Message | None = None

    def save(
        self,
        state: Callable[[], SavedState],
        compensation: Compensation,
        now_s: float,
        decided: tuple[object, ...],
    ) -> None:
        """Save what was not saved just now, and at once what was decided, unless one still saves.

        A kill costs some temperatures, but never that somebody switched off.
        """
        if self._file is None or (
            decided == self._decided and now_s - self._saved_s < self._file.every_s
        ):
            return
        if self._saving is not None:
            if not self._saving.done():
                return
            self._tell_failure(self._file.failure)
        self._saved_s, self._decided = now_s, decided
        self._saving = self._begin(self._file, state(), compensation)

    async def save_last(self, state: Callable[[], SavedState], compensation: Compensation) -> None:
        """Save how it ends, as far as the disk answers in time."""
        if self._saving is not None:
            await asyncio.wait({self._saving}, timeout=LAST_SAVE_S)
        if self._file is None or (self._saving is not None and not self._saving.done()):
            return
        self._saving = self._begin(self._file, state(), compensation)
        await asyncio.wait({self._saving}, timeout=LAST_SAVE_S)
        self._tell_failure(self._file.failure)

    @staticmethod
    def _begin(
        file: StateFile, state: SavedState, compensation: Compensation
    ) -> "asyncio.Future[bool]":
        return asyncio.ensure_future(asyncio.to_thread(file.save, state, compensation))

    def _tell_failure(self, failure: Message | None) -> None:
        if failure != self._unsaved:
            self._tell(failure or Message("event-state_saved_again"))
        self._unsaved = failure
