"""A LinuxCNC whose joints 0 and 2 take a thermal offset, for as long as a test needs it."""

import json
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.system.linuxcnc.machine import (
    AXES,
    FOLDER,
    OWN_PYTHON,
    START_AND_STOP_S,
    own_logs,
    own_objects,
    prepare,
    refuse_beside_another,
    started,
    tail,
    user,
)

SHIFTED = (0, 2)
"""Joints that take an offset."""
PINS = (
    "joint.2.motor-pos-cmd",
    "thermaxis-shift-2.out",
    "thermaxis-shift-2.offset",
    "thermaxis-limit-2.in",
    "watchdog.ok-out",
    "joint.2.motor-pos-fb",
    "joint.2.f-error",
    "thermaxis-shift-0.offset",
    "watchdog.enable-in",
    "watchdog.input-0",
    "joint.1.f-error",
)
KINDS = "ffffbfffbbf"
HEAD = """\
loadrt [KINS]KINEMATICS
loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS
loadrt sampler depth=16000 cfg={kinds}
addf motion-command-handler servo-thread
addf motion-controller servo-thread
source thermal.hal
addf sampler.0 servo-thread
net enable iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in
net prepared iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
net changed iocontrol.0.tool-change => iocontrol.0.tool-changed
"""


@dataclass(frozen=True, slots=True, eq=False)
class OffsetTrace:
    """Every servo period. Lengths in mm, times in s."""

    number: np.ndarray
    clock_s: np.ndarray
    """Monotonic time of the computer, late by up to a fetch."""
    commanded: np.ndarray
    drive: np.ndarray
    offset: np.ndarray
    request: np.ndarray
    ok: np.ndarray
    feedback: np.ndarray
    following_error: np.ndarray
    offset_0: np.ndarray
    armed: np.ndarray
    heartbeat: np.ndarray
    following_error_1: np.ndarray
    """That of joint 1, which takes no offset."""


class OffsetMachine:
    """A running LinuxCNC and the person at it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.orders = 0

    def order(self, verb: str, **words: str) -> dict[str, object]:
        """Have something done; return what the display shows then."""
        self.orders += 1
        name = f"order-{self.orders}"
        part = self.folder / f"{name}.part"
        part.write_text(json.dumps({"verb": verb, **words}), encoding="ascii")
        part.rename(self.folder / f"{name}.json")
        done = self.folder / f"done-{self.orders}.json"
        wait_for(done.exists, 40.0, f"{verb}:\n{tail(self.folder)}")
        result = json.loads(done.read_text(encoding="ascii"))
        if result["failure"]:
            raise RuntimeError(f"{verb}: {result['failure']}\n{tail(self.folder)}")
        return result

    def trace(self) -> OffsetTrace:
        """Return what was recorded so far."""
        raw = (self.folder / "trace.bin").read_bytes()
        width = 8 * (len(PINS) + 2)
        rows = np.frombuffer(raw[: len(raw) // width * width]).reshape(-1, len(PINS) + 2)
        if np.any(np.diff(rows[:, 0]) != 1.0):
            raise RuntimeError("servo periods are missing in the trace: the machine is overloaded")
        columns = list(rows.T)
        for i, kind in enumerate(KINDS, start=2):
            if kind == "b":
                columns[i] = columns[i] != 0.0
        return OffsetTrace(*columns)


def wait_for(reached: Callable[[], bool], limit_s: float, what: str) -> None:
    """Wait for a condition in real time."""
    deadline = time.monotonic() + limit_s
    while not reached():
        if time.monotonic() > deadline:
            raise RuntimeError(f"not reached within {limit_s:g} s: {what}")
        time.sleep(0.01)


def main_hal(*, shifted: Sequence[int] = SHIFTED, too_late: bool = False) -> str:
    """Return the machine's HAL file, with the part that thermaxis writes in its place.

    Two mistakes can be made: a joint's own pins stay in its lines, or the part comes too late.
    """
    head = HEAD.format(kinds=KINDS)
    if too_late:
        source, sampler = head.splitlines()[5:7]
        head = head.replace(f"{source}\n{sampler}\n", f"{sampler}\n{source}\n")
    lines = [head]
    for joint in range(len(AXES)):
        if joint in shifted:
            shift = f"thermaxis-shift-{joint}"
            lines.append(f"net motor-{joint} {shift}.out => {shift}.fb-in\n")
        else:
            pin = f"joint.{joint}.motor-pos"
            lines.append(f"net motor-{joint} {pin}-cmd => {pin}-fb\n")
    watched = [
        ("thermaxis-commanded-2", 0),
        ("motor-2", 1),
        ("thermaxis-offset-2", 2),
        ("thermaxis-request-2", 3),
        ("thermaxis-ok", 4),
        ("thermaxis-feedback-2", 5),
        ("thermaxis-offset-0", 7),
        ("thermaxis-arm", 8),
        ("thermaxis-heartbeat", 9),
    ]
    lines += [f"net {signal} => sampler.0.pin.{pin}\n" for signal, pin in watched]
    lines.append("net following-2 joint.2.f-error => sampler.0.pin.6\n")
    lines.append("net following-1 joint.1.f-error => sampler.0.pin.10\n")
    lines.append(f"loadusr -Wn offset-recorder {OWN_PYTHON} offset_recorder.py {KINDS}\n")
    return "".join(lines)


@contextmanager
def running(thermal_hal: str, *, machine_hal: str | None = None) -> Iterator[OffsetMachine]:
    """Start LinuxCNC, wait until its display stands, and end it cleanly.

    The lock of this machine must be held.
    """
    refuse_beside_another()
    kept, logs = own_objects(), own_logs()
    folder = Path(tempfile.mkdtemp(prefix="thermaxis-"))
    try:
        prepare(folder, "", {}, (), machine_hal or main_hal())
        shutil.copy(FOLDER / "offset_display.py", folder / "display.py")
        shutil.copy(FOLDER / "offset_recorder.py", folder)
        (folder / "thermal.hal").write_text(thermal_hal, encoding="ascii")
        uid, gid = user()
        for path in folder.iterdir():
            os.chown(path, uid, gid)
        (folder / "display.py").chmod(0o755)
        yield from _life(folder, kept, logs)
    finally:
        shutil.rmtree(folder)


def _life(folder: Path, kept: set[tuple[str, int]], logs: set[Path]) -> Iterator[OffsetMachine]:
    ready = folder / "ready"
    with started(folder, logs) as linuxcnc:
        wait_for(lambda: ready.exists() or linuxcnc.poll() is not None, START_AND_STOP_S, "start")
        if not ready.exists():
            raise RuntimeError(f"LinuxCNC did not start:\n{tail(folder)}")
        yield OffsetMachine(folder)
    wait_for(lambda: not own_objects() - kept, 5.0, "an end without shared memory left behind")
