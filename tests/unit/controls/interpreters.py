"""Small interpreters of the controls' programs, which share nothing with the writers."""

import re
from collections.abc import Callable
from dataclasses import dataclass, field


@dataclass
class Driven:
    """What an axis did."""

    start: float
    places: list[float] = field(default_factory=list)
    stops: list[tuple[float, float]] = field(default_factory=list)
    """Position and direction of the last move of each stop."""
    dwell_s: list[float] = field(default_factory=list)
    feeds: set[float] = field(default_factory=set)
    machine: set[bool] = field(default_factory=set)
    """Whether the moves are in machine coordinates."""
    alarms: list[int] = field(default_factory=list)
    modes: set[str] = field(default_factory=set)

    def move(self, place: str, *, feed: str = "", machine: bool = False) -> None:
        self.places.append(float(place))
        self.feeds |= {float(feed)} if feed else set()
        self.machine.add(machine)

    def dwell(self, seconds: float) -> None:
        before, at = [self.start, *self.places][-2:]
        self.stops.append((at, 1.0 if at > before else -1.0))
        self.dwell_s.append(seconds)

    @property
    def way(self) -> float:
        """Length of all moves but the first."""
        pairs = zip(self.places, self.places[1:], strict=False)
        return sum(abs(to - place) for place, to in pairs)


def drive_linuxcnc(program: str, axis: str = "X", start: float = 1000.0) -> Driven:
    lines = [re.sub(r"\([^()]*\)", "", line).strip() for line in program.splitlines()]
    assert all("(" not in line and ")" not in line for line in lines)
    done = Driven(start)
    loops: dict[str, tuple[int, int]] = {}
    ended = False
    k = 0
    while k < len(lines):
        line = lines[k]
        assert not ended or not line
        if found := re.fullmatch(r"(o\d+) repeat \[(\d+)\]", line):
            loops[found[1]] = (k, int(found[2]))
        elif found := re.fullmatch(r"(o\d+) endrepeat", line):
            at, left = loops[found[1]]
            loops[found[1]] = (at, left - 1)
            k = at if left > 1 else k
        elif found := re.fullmatch(rf"(G53 )?G1 {axis}(-?\d+\.\d+)", line):
            done.move(found[2], machine=found[1] is not None)
        elif found := re.fullmatch(r"G4 P(\d+\.\d+)", line):
            done.dwell(float(found[1]))
        elif found := re.fullmatch(r"F(\d+(?:\.\d+)?)", line):
            done.feeds.add(float(found[1]))
        elif line == "M2":
            ended = True
        else:
            assert line in {"", "G21 G90 G94 G40 G49 G80", "G61.1"}, line
            done.modes |= set(line.split())
        k += 1
    assert ended
    return done


def drive_sinumerik(
    program: str,
    axis: str = "X",
    start: float = 1000.0,
    software_limits: tuple[float, float] = (-1e6, 1e6),
    machine_axis: str | None = None,
) -> Driven:
    assert program.endswith("\r\n")
    lines = [line.partition(";")[0].strip() for line in program.split("\r\n")]
    limit = dict(zip(("MINUS", "PLUS"), software_limits, strict=True))
    name = machine_axis or axis
    compared = rf"IF \((\S+?)([<>])\$MA_POS_LIMIT_(MINUS|PLUS)\[{name}\]\) GOTOF (\w+)"
    modes = {"G710 G90 G94 G40 D0", "TRAFOOF", "DIAMOF", "G60 G601", "DEF INT THX_CYCLE"}
    done = Driven(start)
    k = left = loop = 0
    while lines[k] != "M30":
        line = lines[k]
        if found := re.fullmatch(r"FOR THX_CYCLE=1 TO (\d+)", line):
            assert "DEF INT THX_CYCLE" in lines[:k]
            loop, left = k, int(found[1])
        elif line == "ENDFOR":
            left -= 1
            k = loop if left else k
        elif found := re.fullmatch(rf"(SUPA )?G1 {axis}=(-?\d+\.\d+)", line):
            done.move(found[2], machine=found[1] is not None)
        elif found := re.fullmatch(r"G4 F(\d+\.\d+)", line):
            done.dwell(float(found[1]))
        elif found := re.fullmatch(compared, line):
            a, b = float(found[1]), limit[found[3]]
            if a < b if found[2] == "<" else a > b:
                k = lines.index(found[4] + ":")
        elif found := re.fullmatch(r"SETAL\((\d+)\)", line):
            done.alarms.append(int(found[1]))
        elif found := re.fullmatch(r"F(\d+(?:\.\d+)?)", line):
            done.feeds.add(float(found[1]))
        else:
            assert line in {"", *modes}, line
            done.modes |= set(line.split())
        k += 1
    return done


def drive_fanuc(text: str, axis: str = "X", start: float = 1000.0) -> Driven:
    lines = text.split("\n")
    assert lines[0] == "%"
    assert lines[-2:] == ["%", ""]
    programs: dict[int, list[str]] = {}
    current: list[str] = []
    for line in lines[1:-2]:
        assert re.fullmatch(r"[^()]*(\([A-Z0-9 ._-]*\))?", line), line
        code = line.split("(")[0].strip()
        if code.startswith("O"):
            current = programs.setdefault(int(code[1:]), [])
        elif code:
            current.append(code)
    done = Driven(start)
    _run(programs, min(programs), done, axis)
    return done


def _run(programs: dict[int, list[str]], number: int, done: Driven, axis: str) -> None:
    for code in programs[number]:
        if found := re.fullmatch(rf"G1 {axis}(-?\d+\.\d{{3}}) F(\d+(?:\.\d+)?)", code):
            done.move(found[1], feed=found[2])
        elif found := re.fullmatch(r"G04 P(\d+)", code):
            done.dwell(int(found[1]) / 1000.0)
        elif found := re.fullmatch(r"M98 P(\d{1,4})(\d{4})", code):
            for _ in range(int(found[1])):
                _run(programs, int(found[2]), done, axis)
        elif found := re.fullmatch(r"M98 P(\d{4}) L(\d+)", code):
            for _ in range(int(found[2])):
                _run(programs, int(found[1]), done, axis)
        elif code in {"M99", "M30"}:
            assert code == programs[number][-1]
        else:
            done.modes |= set(code.split())


def drive_klartext(text: str, axis: str = "X", start: float = 1000.0) -> Driven:
    assert text.endswith("\r\n")
    words: list[str] = []
    for number, line in enumerate(text.split("\r\n")[:-1]):
        head, _, rest = line.partition(" ")
        assert int(head) == number
        words.append(rest.split(";")[0].strip())
    name = words[0].split()[2]
    assert (words[0], words[-1]) == (f"BEGIN PGM {name} MM", f"END PGM {name} MM")
    labels = {w.split()[1]: i for i, w in enumerate(words) if w.startswith("LBL ")}
    left: dict[int, int] = {}
    done = Driven(start)
    i = 1
    while words[i] != "M30":
        word = words[i]
        if found := re.fullmatch(rf"L {axis}([+-]\d+\.\d+) R0 F(\d+(?:\.\d+)?)( M91)?", word):
            done.move(found[1], feed=found[2], machine=found[3] is not None)
        elif found := re.fullmatch(r"CYCL DEF 9.1 DWELL (\S+)", word):
            assert words[i - 1] == "CYCL DEF 9.0 DWELL TIME"
            done.dwell(float(found[1]))
        elif found := re.fullmatch(r"CALL LBL (\d+) REP (\d+)", word):
            left.setdefault(i, int(found[2]))
            if left[i] > 0:
                left[i] -= 1
                i = labels[found[1]]
                continue
            del left[i]
        else:
            assert word == "" or word.startswith(("LBL ", "CYCL DEF 9.0")), word
        i += 1
    assert len(words) == i + 2
    return done


DRIVES: dict[str, Callable[..., Driven]] = {
    "fanuc": drive_fanuc,
    "heidenhain-itnc530": drive_klartext,
    "heidenhain-tnc640": drive_klartext,
    "linuxcnc": drive_linuxcnc,
    "sinumerik": drive_sinumerik,
}
"""What drives the program of a control, by its name."""
