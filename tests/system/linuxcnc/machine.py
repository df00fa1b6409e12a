"""Start LinuxCNC without display as an ordinary user, run one program, leave nothing behind.

LinuxCNC keeps its state in shared memory with fixed keys: there is one instance per machine.
`run_program` takes a lock, refuses to start beside an instance that is not its own, and ends only
what it started.
"""

import fcntl
import json
import os
import pwd
import re
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

FOLDER = Path(__file__).parent
OWN_PYTHON = "/usr/bin/python3"
"""The distribution's Python, which its modules `hal` and `linuxcnc` are compiled for."""
LOCK_NAME = "thermaxis-linuxcnc.lock"
RUNNING = Path("/tmp/linuxcnc.lock")  # noqa: S108 - LinuxCNC's own, fixed in its start script
NML = Path("/usr/share/linuxcnc/linuxcnc.nml")
"""LinuxCNC's message buffers. It offers them on port 5005 of every network interface, to anybody;
these tests take the ports out."""
IPC_KEYS = (0x48414C32, 0x90280A48, 0x48484C34, *range(1001, 1006))
"""Keys of its shared memory (HAL, RTAPI, number of the instance) and of its message buffers."""
IPC_KINDS = ("shm", "sem")
PERIOD_S = 0.001
START_AND_STOP_S = 40.0
"""Time allowed for everything but the program; one start and one stop take about 2 s together."""
AXES = "XYZUVW"
"""Axes of the machine; joint 0 is X, behind which the virtual axis stands."""
COLUMNS = ("number", "position", "velocity", "motor", "ramped", "clocks")
"""First columns of ``trace.bin``; the correction of each joint, joint 2 and the axis follow."""
PROGRAMS = (Path("/usr/bin/linuxcnc"), Path("/usr/bin/rtapi_app"), Path(OWN_PYTHON))


def missing(programs: Sequence[Path] = PROGRAMS) -> str:
    """Return why no LinuxCNC can be started here; empty if nothing is missing."""
    absent = [str(program) for program in programs if not program.is_file()]
    if not absent:
        return ""
    return (
        f"LinuxCNC is not installed ({', '.join(absent)} not found), and these tests need a real"
        " one. On Debian 12 or later: apt-get install --no-install-recommends linuxcnc-uspace"
    )


@dataclass(frozen=True, slots=True)
class Physics:
    """A virtual axis; the formulas stand in ``virtual_axis.py`` and once more in the tests."""

    low_mm: float = -80.0
    high_mm: float = 80.0
    pitch_mm: float = 20.0
    bow_um: float = 0.0
    periodic_um: float = 0.0
    reversal_um: float = 0.0
    drift_um: float = 0.0
    drift_time_constant_s: float = 20.0
    expansion_um: float = 0.0
    expansion_time_constant_s: float = 35.0
    thermal_time_s: float = 0.0
    """How long the machine has warmed up at the first motion."""
    warms_up: bool = True
    """Whether it goes on warming up, or keeps its thermal state."""


@dataclass(frozen=True, slots=True)
class Table:
    """Compensation table of the joint."""

    text: str
    """Content of the file."""
    kind: int
    """COMP_FILE_TYPE."""


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """Every servo period from the start of LinuxCNC to its end."""

    time_s: np.ndarray
    """Time of the control since the first motion, (N,); negative before. [s]"""
    clock_s: np.ndarray
    """True time of each period, (N,). A kernel without real time may hold the servo thread up for
    tens of milliseconds; it then makes up for them at once, and a dwell, which the interpreter
    times, spans fewer periods than its seconds. [s]"""
    position: np.ndarray
    """Commanded position of the joint, (N,). [mm]"""
    velocity: np.ndarray
    """Commanded velocity, (N,). [mm/s]"""
    motor: np.ndarray
    """Position of the motor, (N,). [mm]"""
    ramped: np.ndarray
    """Correction as it is added to the motor, (N,). [mm]"""
    corrections: np.ndarray
    """Correction by the table of each joint, (N, 6). [mm]"""
    axis: np.ndarray
    """True position of the axis, (N,). [mm]"""
    bystander: np.ndarray
    """Commanded position of joint 2, which no program of a plan may move, (N,). [mm]"""
    said: tuple[str, ...]
    """Messages for the operator."""
    user: int
    """Number of the user who ran LinuxCNC. [1]"""
    outputs: tuple[float, ...]
    """The first analog outputs at the end. [1]"""
    log: str
    """What LinuxCNC printed."""


def run_program(
    program: str,
    *,
    physics: Physics | None = None,
    tables: Sequence[Table] = (),
    limit_s: float,
    heeds_messages: bool = True,
    surface_mm: tuple[float, float] | None = None,
) -> Trace:
    """Run one NC program on a LinuxCNC of its own.

    Parameters
    ----------
    program : str
        The program.
    physics : Physics, optional
        The axis behind joint 0. Default: one without any error.
    tables : sequence of Table
        Compensation tables of the first joints. Default: none.
    limit_s : float
        Longest time of the program. [s]
    heeds_messages : bool
        Whether an error that the control reports ends the run. Default: it does.
    surface_mm : (float, float), optional
        Where a probe on the first joint answers, at this position and below, and by how much that
        moves with each unit of the second analog output. Default: there is no probe. [mm]

    Returns
    -------
    Trace
        What the joint did.

    Raises
    ------
    RuntimeError
        If LinuxCNC refuses the program, takes too long, or leaves anything behind.
    """
    with one_at_a_time():
        refuse_beside_another()
        kept, logs = own_objects(), own_logs()
        folder = Path(tempfile.mkdtemp(prefix="thermaxis-"))
        try:
            job = {
                "physics": asdict(physics or Physics()),
                "period_s": PERIOD_S,
                "limit_s": limit_s,
                "heeds_messages": heeds_messages,
            }
            prepare(folder, program, job, tables, hal(surface_mm))
            start_and_wait(folder, limit_s, kept, logs)
            trace = read_trace(folder)
        finally:
            shutil.rmtree(folder)
        refuse_beside_another()
        if own_objects() - kept:
            raise RuntimeError("LinuxCNC left shared memory or semaphores behind")
    return trace


@contextmanager
def one_at_a_time() -> Iterator[None]:
    """Hold the lock of this machine, whoever made its file."""
    path = Path(tempfile.gettempdir()) / LOCK_NAME
    try:
        lock = os.open(path, os.O_RDONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o644)
    except FileExistsError:
        lock = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield
    finally:
        os.close(lock)


def refuse_beside_another() -> None:
    """Raise if a LinuxCNC is running or left something: its start would end the other one."""
    signed = {key - (1 << 32) if key >= 1 << 31 else key for key in IPC_KEYS}
    left = sorted(signed & {row["key"] for kind in IPC_KINDS for row in objects(kind)})
    if left or RUNNING.exists():
        raise RuntimeError(
            f"a LinuxCNC runs on this machine or was not ended cleanly ({RUNNING}:"
            f" {'there' if RUNNING.exists() else 'not there'}; keys of shared memory and"
            f" semaphores: {left}). End it; after a crash: halrun -U, remove the file, and ipcrm"
            " what is left"
        )


def objects(kind: str) -> list[dict[str, int]]:
    """Return what this machine has of shared memory (shm) or semaphores (sem)."""
    rows = Path(f"/proc/sysvipc/{kind}").read_text(encoding="ascii").splitlines()
    names = rows[0].split()
    return [dict(zip(names, map(int, row.split()), strict=True)) for row in rows[1:]]


def own_objects() -> set[tuple[str, int]]:
    """Return those that belong to the user of LinuxCNC, by kind and number."""
    return {
        (kind, row[f"{kind}id"])
        for kind in IPC_KINDS
        for row in objects(kind)
        if row["uid"] == user()[0]
    }


def own_logs() -> set[Path]:
    """Return the logs of the start script of that user; it removes them at a clean end."""
    return {p for p in RUNNING.parent.glob("linuxcnc.*.*") if p.stat().st_uid == user()[0]}


# ---- the folder of one run ----------------------------------------------------------------------


def prepare(
    folder: Path, program: str, job: dict[str, object], tables: Sequence[Table], connections: str
) -> None:
    """Write everything that LinuxCNC reads, for the user who will run it."""
    for name in ("virtual_axis.py", "display.py", "panel.py"):
        shutil.copy(FOLDER / name, folder / name)
    (folder / "display.py").chmod(0o755)
    written = {
        "job.json": json.dumps(job),
        "program.ngc": program,
        "machine.ini": ini(folder, tables),
        "machine.hal": connections,
        "machine.nml": re.sub(r"TCP=\d+", "", NML.read_text(encoding="ascii")),
        "tool.tbl": "",
    }
    written |= {f"joint{joint}.comp": table.text for joint, table in enumerate(tables)}
    for name, text in written.items():
        (folder / name).write_bytes(text.encode("ascii"))
    uid, gid = user()
    for path in (folder, *folder.iterdir()):
        os.chown(path, uid, gid)


def user() -> tuple[int, int]:
    """Return who runs LinuxCNC: whoever runs the tests, but never root, which it refuses."""
    if os.geteuid() != 0:
        return os.geteuid(), os.getegid()
    nobody = pwd.getpwnam("nobody")
    return nobody.pw_uid, nobody.pw_gid


def ini(folder: Path, tables: Sequence[Table]) -> str:
    """Return the configuration: linear joints, millimetres, no switches to home to."""
    text = INI.format(
        folder=folder,
        period_ns=round(PERIOD_S * 1e9),
        axes=AXES,
        joints=len(AXES),
    )
    for joint, axis in enumerate(AXES):
        text += JOINT.format(axis=axis, joint=joint)
        if joint < len(tables):
            text += f"COMP_FILE = joint{joint}.comp\nCOMP_FILE_TYPE = {tables[joint].kind}\n"
    return text


def hal(surface_mm: tuple[float, float] | None) -> str:
    """Return the connections: every motor follows at once, the sampler sees every period."""
    lines = [HAL]
    if surface_mm is not None:
        lines.append(PROBE.format(*surface_mm))
    for joint in range(len(AXES)):
        sampled = " sampler.0.pin.2" if joint == 0 else ""
        command, feedback = f"joint.{joint}.motor-pos-cmd", f"joint.{joint}.motor-pos-fb"
        lines.append(f"net motor-{joint} {command} => {feedback}{sampled}\n")
        pin = f"sampler.0.pin.{joint + 5}"
        lines.append(f"net correction-{joint} joint.{joint}.backlash-corr => {pin}\n")
    lines.append(f"loadusr -Wn virtual-axis {OWN_PYTHON} virtual_axis.py\n")
    return "".join(lines)


INI = """\
[EMC]
VERSION = 1.1
MACHINE = virtual axis
DEBUG = 0
NML_FILE = {folder}/machine.nml
[DISPLAY]
DISPLAY = {folder}/display.py
[TASK]
TASK = milltask
CYCLE_TIME = 0.005
[RS274NGC]
PARAMETER_FILE = sim.var
[EMCMOT]
EMCMOT = motmod
COMM_TIMEOUT = 1.0
SERVO_PERIOD = {period_ns}
[EMCIO]
EMCIO = io
CYCLE_TIME = 0.100
TOOL_TABLE = tool.tbl
[HAL]
HALFILE = machine.hal
[TRAJ]
COORDINATES = {axes}
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
DEFAULT_LINEAR_VELOCITY = 50
MAX_LINEAR_VELOCITY = 500
[KINS]
JOINTS = {joints}
KINEMATICS = trivkins coordinates={axes}
"""
JOINT = """\
[AXIS_{axis}]
MIN_LIMIT = -100
MAX_LIMIT = 100
MAX_VELOCITY = 500
MAX_ACCELERATION = 5000
[JOINT_{joint}]
TYPE = LINEAR
MIN_LIMIT = -100
MAX_LIMIT = 100
MAX_VELOCITY = 500
MAX_ACCELERATION = 5000
FERROR = 1
MIN_FERROR = 1
HOME = 0
HOME_SEQUENCE = 0
"""
HAL = """\
loadrt [KINS]KINEMATICS
loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS
loadrt sampler depth=16000 cfg=ffffufffffff
addf motion-command-handler servo-thread
addf motion-controller servo-thread
addf sampler.0 servo-thread
net position joint.0.pos-cmd => sampler.0.pin.0
net velocity joint.0.vel-cmd => sampler.0.pin.1
net ramped joint.0.backlash-filt => sampler.0.pin.3
net bystander joint.2.pos-cmd => sampler.0.pin.11
net clocks motion.servo.last-period => sampler.0.pin.4
net enable iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in
net prepared iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
net changed iocontrol.0.tool-change => iocontrol.0.tool-changed
"""
PROBE = """\
loadrt sum2
loadrt comp
addf sum2.0 servo-thread
addf comp.0 servo-thread
net touches motion.analog-out-01 => sum2.0.in0
setp sum2.0.gain0 {1}
setp sum2.0.offset {0}
net surface sum2.0.out => comp.0.in1
net position => comp.0.in0
net touched comp.0.out => motion.probe-input
"""


# ---- the life of LinuxCNC -----------------------------------------------------------------------


def surroundings(folder: Path) -> dict[str, Any]:
    """Return environment and user of LinuxCNC and its programs, for `subprocess`."""
    uid, gid = user()
    other = {} if os.geteuid() != 0 else {"user": uid, "group": gid, "extra_groups": []}
    path = "/usr/sbin:/usr/bin:/sbin:/bin"
    return {"env": {"PATH": path, "HOME": str(folder), "LANG": "C"}, **other}


@contextmanager
def started(folder: Path, logs: set[Path]) -> Iterator[subprocess.Popen[bytes]]:
    """Start LinuxCNC; what runs of it in the end is ended, and its new logs go."""
    with (folder / "linuxcnc.log").open("wb") as log:
        linuxcnc = subprocess.Popen(
            ["/usr/bin/linuxcnc", "-r", str(folder / "machine.ini")],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            **surroundings(folder),
        )
        try:
            yield linuxcnc
        finally:
            if linuxcnc.poll() is None:
                end(linuxcnc, folder)
            for log_file in own_logs() - logs:
                log_file.unlink()


def start_and_wait(
    folder: Path, limit_s: float, kept: set[tuple[str, int]], logs: set[Path]
) -> None:
    """Start LinuxCNC and wait for its end; end it if it takes too long or the test is ended."""
    with started(folder, logs) as linuxcnc:
        try:
            linuxcnc.wait(limit_s + START_AND_STOP_S)
        except subprocess.TimeoutExpired:
            raise RuntimeError(f"LinuxCNC did not end:\n{tail(folder)}") from None
        finally:
            if linuxcnc.poll() is None:
                end(linuxcnc, folder)
                for kind, number in own_objects() - kept:
                    option = {"shm": "-m", "sem": "-s"}[kind]
                    subprocess.run(["/usr/bin/ipcrm", option, str(number)], check=True)


def end(linuxcnc: subprocess.Popen[bytes], folder: Path) -> None:
    """End what `started` started: first its display, which LinuxCNC outlives cleanly."""
    for number in own_ids(linuxcnc.pid, folder):
        if "display.py" in command_line(number):
            os.kill(number, signal.SIGTERM)
    try:
        linuxcnc.wait(START_AND_STOP_S)
    except subprocess.TimeoutExpired:
        for number in own_ids(linuxcnc.pid, folder):
            os.kill(number, signal.SIGKILL)
        linuxcnc.wait(START_AND_STOP_S)
        stop = ["/usr/lib/linuxcnc/realtime", "stop"]
        subprocess.run(stop, timeout=START_AND_STOP_S, check=False, **surroundings(folder))
        RUNNING.unlink(missing_ok=True)  # ours: none was there when we started


def own_ids(session: int, folder: Path) -> list[int]:
    """Return the ids of the processes of our session, or started with our configuration."""
    found: list[int] = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            stat = (entry / "stat").read_text(encoding="utf-8", errors="replace")
        except OSError:  # it has ended meanwhile
            continue
        state, _, _, of_session, *_ = stat.rpartition(")")[2].split()
        ours = int(of_session) == session or f"{folder}/" in command_line(int(entry.name))
        if ours and state != "Z":
            found.append(int(entry.name))
    return found


def command_line(number: int) -> str:
    """Return the command line of a process, empty if it has ended."""
    try:
        path = Path("/proc") / str(number) / "cmdline"
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def tail(folder: Path) -> str:
    """Return the end of what LinuxCNC printed."""
    return (folder / "linuxcnc.log").read_text(encoding="utf-8", errors="replace")[-4000:]


def read_trace(folder: Path) -> Trace:
    """Return what was recorded; raise if the control refused or a servo period is missing."""
    path = folder / "result.json"
    if not path.exists():
        raise RuntimeError(f"LinuxCNC did not start:\n{tail(folder)}")
    result = json.loads(path.read_text(encoding="ascii"))
    if result["failure"]:
        raise RuntimeError(f"{result['failure']}\n{tail(folder)}")
    rows = np.fromfile(folder / "trace.bin").reshape(-1, len(COLUMNS) + len(AXES) + 2)
    value = dict(zip(COLUMNS, rows.T, strict=False))
    if np.any(np.diff(value["number"]) != 1.0):
        raise RuntimeError("servo periods are missing in the trace: the machine is overloaded")
    moving = np.flatnonzero(value["velocity"])
    number = value.pop("number")
    time_s = (number - number[moving[0] if moving.size else 0]) * PERIOD_S
    clocks = np.cumsum(value.pop("clocks"))  # the periods last a millisecond on average
    clock_s = clocks * (number[-1] - number[0]) * PERIOD_S / (clocks[-1] - clocks[0])
    return Trace(
        time_s=time_s,
        clock_s=clock_s,
        corrections=rows[:, len(COLUMNS) : -2],
        bystander=rows[:, -2],
        axis=rows[:, -1],
        said=tuple(result["said"]),
        user=result["user"],
        outputs=tuple(result["outputs"]),
        log=tail(folder),
        **value,
    )
