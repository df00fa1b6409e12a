"""Small interpreters of the controls' touch programs, which share nothing with the writers."""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field


class AlarmError(Exception):
    """The control stops the program and says why."""


@dataclass
class Machine:
    """An axis with a probe in front of an artefact whose surface moves."""

    surfaces: list[float | None]
    """Machine position at which each search meets something."""
    axis: str = "Z"
    at: float = 90.0
    shift: float = 0.0
    """Work offset in force."""
    deflected: bool = False
    """Whether the probe answers all the time."""
    counter: float = 0.0
    """What the counter holds before."""
    places: list[float] = field(default_factory=list)
    feeds: set[float] = field(default_factory=set)
    dwell_s: list[float] = field(default_factory=list)
    results: list[tuple[float, float, float]] = field(default_factory=list)
    """Value, counter and reading, whenever the counter moved."""
    modes: set[str] = field(default_factory=set)
    says: bool = True
    """Whether a touch cycle that meets nothing says so, or leaves its results alone."""
    alarm: str = ""
    spindle: bool = True
    moving: bool = False
    """Whether the control may still move while it reads ahead."""
    skip: float = math.nan
    met: bool = False

    def move(self, to: float, feed: float) -> None:
        assert not self.spindle
        self.at, self.moving = to, True
        self.places.append(to)
        self.feeds.add(feed)

    def search(self, to: float, feed: float) -> None:
        surface = self.at if self.deflected else self.surfaces.pop(0)
        low, high = sorted((self.at, to))
        self.met = surface is not None and low <= surface <= high
        self.skip = surface if self.met else to
        self.move(self.skip + math.copysign(0.02, to - self.at) * self.met, feed)

    def stood(self) -> None:
        """Assert that the axis has come to rest before the program computes with what it did."""
        assert not self.moving


def worth(expression: str, values: Mapping[str, float] | Callable[[str], float]) -> float:
    """Return what an expression of numbers and variables comes to."""
    look = values if callable(values) else values.__getitem__
    text = re.sub(r"#\d+|#<\w+>|[QR]\d+|\$\w+\[\w+\]", lambda m: repr(look(m[0])), expression)
    text = text.replace("[", "(").replace("]", ")")
    assert re.fullmatch(r"(ABS|EXISTS|nan|[0-9.e()+*<> -])*", text), text
    names = {"ABS": abs, "nan": math.nan, "EXISTS": lambda value: not math.isnan(value)}
    return eval(text, {**names, "__builtins__": {}})  # noqa: S307 - numbers and signs only, see the line above


# ---- LinuxCNC -----------------------------------------------------------------------------------


def run_linuxcnc(program: str, machine: Machine) -> None:  # noqa: C901, PLR0915 - a branch for each word
    text = [re.sub(r"\((?!ABORT)[^()]*\)", "", line).strip() for line in program.splitlines()]
    lines = [line for line in text if line]
    named: dict[str, float] = {f"#<_touch_{machine.axis.lower()}_counter>": machine.counter}
    pins: dict[str, float] = {}
    number = "XYZABCUVW".index(machine.axis)
    of_machine = {
        f"#{5420 + number}": lambda: machine.at - machine.shift,
        f"#{5061 + number}": lambda: machine.skip - machine.shift,
        "#5070": lambda: float(machine.met),
        "#5220": lambda: 2.0,
    }
    if not machine.counter:
        named.clear()

    def look(name: str) -> float:
        return of_machine[name]() if name in of_machine else named.get(name, math.nan)

    subs: dict[str, tuple[int, int]] = {}
    modes: set[str] = set()

    def run(k: int, end: int) -> None:  # noqa: C901, PLR0912 - a branch for each word
        while k < end:
            line = lines[k]
            if found := re.fullmatch(r"(o<\w+>) sub", line):
                close = lines.index(f"{found[1]} endsub")
                subs[found[1]] = (k + 1, close)
                k = close
            elif found := re.fullmatch(r"(o<\w+>) call", line):
                run(*subs[found[1]])
            elif found := re.fullmatch(r"(o\d+) repeat \[(\d+)\]", line):
                close = lines.index(f"{found[1]} endrepeat")
                for _ in range(int(found[2])):
                    run(k + 1, close)
                k = close
            elif found := re.fullmatch(r"(o\d+) if \[(.*) (EQ|NE|LT) (\S+)\]", line):
                a = 0.0 if "5210" in found[2] else worth(found[2], look)  # nothing is turned
                b = float(found[4])
                if not {"EQ": a == b, "NE": a != b, "LT": a < b}[found[3]]:
                    k = lines.index(f"{found[1]} endif")
            elif found := re.fullmatch(r"\(ABORT, (.*)\)", line):
                machine.stood()
                raise AlarmError(found[1])
            elif found := re.fullmatch(rf"G53 G1 {machine.axis}(\S+)", line):
                assert "G91" not in modes
                machine.move(float(found[1]), look("F"))
            elif found := re.fullmatch(rf"G91 G38.3 {machine.axis}(\S+)", line):
                modes.add("G91")
                machine.search(machine.at + float(found[1]), look("F"))
            elif found := re.fullmatch(r"(#<\w+>) = (.*)", line):
                named[found[1]] = worth(found[2], look)
            elif found := re.fullmatch(r"M68 (E\d+) Q(.*)", line):
                machine.stood()
                pins[found[1]] = worth(found[2], look)
                if found[1] == "E1":
                    reading = named[f"#<_touch_{machine.axis.lower()}_reading>"]
                    machine.results.append((pins["E0"], pins["E1"], reading))
            elif found := re.fullmatch(r"G4 P(\S+)", line):
                machine.dwell_s.append(float(found[1]))
            elif found := re.fullmatch(r"F(\S+)", line):
                named["F"] = float(found[1])
            elif line == "M66 E0 L0":
                machine.moving = False
            elif line == "M5 $-1":
                machine.spindle = False
            elif line == "G90":
                modes.discard("G91")
            else:
                assert line in {"M73", "M2", "G21 G90 G94 G40 G80 G61.1"} or "end" in line, line
                machine.modes |= set(line.split())
            k += 1

    run(0, len(lines))
    assert lines[-1] == "M2"


# ---- SINUMERIK ----------------------------------------------------------------------------------


def run_sinumerik(  # noqa: C901, PLR0912 - a branch for each word
    program: str, machine: Machine, limits: tuple[float, float] = (-1e6, 1e6)
) -> None:
    lines = [line.partition(";")[0].strip() for line in program.split("\r\n")]
    words = {"R101": machine.counter, "THX_CYCLE": math.nan, "F": math.nan}
    of_machine = {
        f"$MA_POS_LIMIT_MINUS[{machine.axis}]": lambda: limits[0],
        f"$MA_POS_LIMIT_PLUS[{machine.axis}]": lambda: limits[1],
        "$A_PROBE[1]": lambda: float(machine.deflected),
        "$AC_MEA[1]": lambda: float(machine.met),
        f"$AA_MM[{machine.axis}]": lambda: machine.skip,
    }

    def look(name: str) -> float:
        if name not in of_machine:
            return words[name]
        machine.stood()
        return of_machine[name]()

    k = 0
    while (line := lines[k]) != "M30":
        k += 1
        if found := re.fullmatch(r"IF \((.*?)(<>|==|<|>)(.*)\) GOTO([FB]) (\w+)", line):
            a, b = (
                worth(part.replace("THX_CYCLE", f"{words['THX_CYCLE']}"), look)
                for part in found.group(1, 3)
            )
            if {"<>": a != b, "==": a == b, "<": a < b, ">": a > b}[found[2]]:
                to = lines.index(f"{found[5]}:")
                assert (to > k) == (found[4] == "F")
                k = to
        elif found := re.fullmatch(r"GOTOF (\w+)", line):
            k = lines.index(f"{found[1]}:", k)
        elif found := re.fullmatch(r"SETAL\((\d+)\)", line):
            assert lines[k : k + 2] == ["M0", "M30"]
            raise AlarmError(found[1])
        elif found := re.fullmatch(rf"(MEAS=1 )?SUPA G1 {machine.axis}=(\S+)", line):
            (machine.search if found[1] else machine.move)(float(found[2]), words["F"])
        elif found := re.fullmatch(r"(?:DEF INT )?(R\d+|THX_CYCLE)=(.*)", line):
            machine.stood()
            words[found[1]] = worth(found[2].replace("THX_CYCLE", f"{words['THX_CYCLE']}"), look)
            if found[1] == "R101":
                machine.results.append((words["R100"], words["R101"], words["R102"]))
        elif found := re.fullmatch(r"G4 F(\S+)", line):
            machine.dwell_s.append(float(found[1]))
        elif found := re.fullmatch(r"F(\S+)", line):
            words["F"] = float(found[1])
        elif line == "STOPRE":
            machine.moving = False
        elif line == "M5":
            machine.spindle = False
        else:
            modes = {"", "G710 G90 G94 G40 D0", "TRAFOOF", "DIAMOF", "G60 G601"}
            assert line in modes or line.endswith(":"), line
            machine.modes |= set(line.split())


# ---- Fanuc --------------------------------------------------------------------------------------


def run_fanuc(program: str, machine: Machine) -> None:
    lines = program.split("\n")
    assert (lines[0], lines[-2:]) == ("%", ["%", ""])
    programs: dict[int, list[str]] = {}
    current: list[str] = []
    for line in lines[1:-2]:
        assert re.fullmatch(r"[^()]*(\([A-Z0-9 ._-]*\))?", line), line
        code = line if "#3000" in line else line.partition("(")[0].strip()
        if code.startswith("O"):
            current = programs.setdefault(int(code[1:]), [])
        elif code:
            current.append(code)
    common, machine.moving = {"#501": machine.counter}, True  # a part program's last move
    _run_fanuc(programs, min(programs), machine, common)


def _run_fanuc(  # noqa: C901, PLR0912 - a branch for each word
    programs: dict[int, list[str]], number: int, machine: Machine, common: dict[str, float]
) -> None:
    lines, k = programs[number], 0
    local: dict[str, float] = {}
    axis = "XYZ".index(machine.axis) + 1
    of_machine = {
        f"#{5020 + axis}": lambda: machine.at,
        f"#{5040 + axis}": lambda: machine.at - machine.shift,
        f"#{5060 + axis}": lambda: machine.skip - machine.shift,
    }

    def look(name: str) -> float:
        if name in of_machine:
            machine.stood()
            return of_machine[name]()
        if re.fullmatch(r"#50[2-6]\d", name):
            return 0.0  # where another axis stands
        return (common if int(name[1:]) >= 100 else local)[name]

    while (line := lines[k]) not in {"M30", "M99"}:
        k += 1
        if found := re.fullmatch(r"IF\[(.*)(LT|GT)(.*)\]GOTO(\d+)", line):
            a, b = worth(found[1], look), float(found[3])
            if a < b if found[2] == "LT" else a > b:
                k = next(i for i, other in enumerate(lines) if other.startswith(f"N{found[4]} "))
        elif found := re.fullmatch(r"WHILE\[(.*)LT(\d+)\]DO1", line):
            if not worth(found[1], look) < int(found[2]):
                k = lines.index("END1") + 1
        elif line == "END1":
            k = next(i for i, other in enumerate(lines) if other.startswith("WHILE"))
        elif found := re.fullmatch(r"G65 P(\d{4})", line):
            _run_fanuc(programs, int(found[1]), machine, common)
        elif found := re.fullmatch(r"N\d+ #3000=(\d+)\(.*\)", line):
            raise AlarmError(found[1])
        elif found := re.fullmatch(r"(#\d+)=(.*)", line):
            machine.stood()
            (common if int(found[1][1:]) >= 100 else local)[found[1]] = worth(found[2], look)
            if found[1] == "#501":
                machine.results.append((common["#500"], common["#501"], common["#502"]))
        elif found := re.fullmatch(rf"G1 {machine.axis}(\[.*\]) F(\S+)", line):
            machine.move(machine.at + worth(found[1], look), float(found[2]))
        elif found := re.fullmatch(rf"G31 {machine.axis}(\S+) F(\S+)", line):
            machine.search(machine.at + float(found[1]), float(found[2]))
        elif found := re.fullmatch(r"G04 P(\d+)", line):
            machine.dwell_s.append(int(found[1]) / 1000.0)
        elif line == "G53":
            machine.moving = False
        elif line == "M05":
            machine.spindle = False
        else:
            assert line in {"G21", "G91 G94 G40 G80", "G61", "G90 G64"}, line
            machine.modes |= set(line.split())


# ---- HEIDENHAIN ---------------------------------------------------------------------------------


def run_klartext(program: str, machine: Machine) -> None:  # noqa: C901, PLR0912, PLR0915 - a branch for each word
    numbered = [line.partition(" ") for line in program.split("\r\n")[:-1]]
    assert [int(number) for number, _, _ in numbered] == list(range(len(numbered)))
    lines = [rest.partition(";")[0].strip() for _, _, rest in numbered]
    assert lines[-1] == lines[0].replace("BEGIN", "END")
    q = {"Q1601": machine.counter}
    left: dict[int, int] = {}
    target = lines.index
    way = first = ""
    k = 1
    while k < len(lines) - 1:
        line = lines[k]
        k += 1
        if found := re.fullmatch(r"FN 9: IF \+(\S+) EQU (\S+) GOTO (LBL \d+)", line):
            if worth(found[1], q) == float(found[2]):
                k = target(found[3])
        elif found := re.fullmatch(r"CALL (LBL \d+) REP (\d+)", line):
            left.setdefault(k, int(found[2]))
            if left[k] > 0:
                left[k] -= 1
                k = target(found[1])
        elif found := re.fullmatch(r"FN 14: ERROR = (\d+)", line):
            raise AlarmError(found[1])
        elif found := re.fullmatch(r"(?:FN [01]: )?(Q\d+) = (.*)", line):
            q[found[1]] = worth(found[2], q)
            if found[1] == "Q1601":
                machine.results.append((q["Q1600"], q["Q1601"], q["Q1602"]))
        elif found := re.fullmatch(rf"L {machine.axis}([+-]\S+) R0 F(\S+) M91", line):
            machine.move(float(found[1]), float(found[2]))
        elif found := re.fullmatch(r"TCH PROBE 4.1 (Q\d+)", line):
            first = found[1]
        elif found := re.fullmatch(r"TCH PROBE 4.2 (.*)", line):
            way = found[1]
        elif found := re.fullmatch(
            r"TCH PROBE 4.3 DIST \+(\S+) F(\S+) MB\+0 REFERENCE SYSTEM:1", line
        ):
            if machine.deflected:
                raise AlarmError("deflected")
            sides = dict(re.findall(r"I([XYZ])([+-]\d)", way))
            assert [letter for letter, side in sides.items() if float(side)] == [machine.axis]
            machine.search(
                machine.at + float(sides[machine.axis]) * float(found[1]), float(found[2])
            )
            start = int(first[1:])
            if machine.met:
                q |= {
                    f"Q{start + i}": machine.skip for i, c in enumerate("XYZ") if c == machine.axis
                }
            elif machine.says:
                q |= {f"Q{start + i}": machine.at for i in range(3)} | {f"Q{start + 3}": -1.0}
        elif found := re.fullmatch(r"CYCL DEF 9.1 DWELL (\S+)", line):
            machine.dwell_s.append(float(found[1]))
        elif line == "M5":
            machine.spindle = False
        else:
            others = ("LBL ", "TCH PROBE 4.0 MEASURING IN 3-D", "CYCL DEF 9.0")
            assert not line or line.startswith(others), line
            machine.modes.add(line)


RUNS: dict[str, Callable[[str, Machine], None]] = {
    "fanuc": run_fanuc,
    "heidenhain-itnc530": run_klartext,
    "heidenhain-tnc640": run_klartext,
    "linuxcnc": run_linuxcnc,
    "sinumerik": run_sinumerik,
}
"""What runs the touch program of a control, by its name."""


def run(name: str, program: str, machine: Machine) -> Machine:
    """Run a touch program to its end or its alarm."""
    try:
        RUNS[name](program, machine)
    except AlarmError as said:
        machine.alarm = str(said)
    return machine
