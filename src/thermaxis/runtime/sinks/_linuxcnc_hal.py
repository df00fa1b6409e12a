"""The arrangement in LinuxCNC's HAL that applies an offset below the motion controller.

    joint.N.motor-pos-cmd -> offset.in      offset.out   -> drive
    joint.N.motor-pos-fb  <- offset.fb-out  offset.fb-in <- drive
    request -> limit3.in                    limit3.out   -> offset.offset
    heartbeat, arm -> watchdog              watchdog.ok-out -> limit3.enable

One table of nets is the source of both: of the text for the machine's HAL file, and of what the
running machine is compared with before anything is written to it.

References
----------
.. [1] LinuxCNC manual pages limit3(9), offset(9), watchdog(9), threadtest(9).
"""

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from thermaxis.codes import Message, Value
from thermaxis.runtime._halcmd import HalRefusedError, number_of
from thermaxis.runtime.sinks._linuxcnc_settings import LinuxCncOutput, LinuxCncSettings

HEARTBEAT = "thermaxis-heartbeat"
"""Signal that the writer moves with every write."""
ARM = "thermaxis-arm"
"""Signal whose rising edge starts the watchdog."""
OK = "thermaxis-ok"
"""Signal that is true while the heartbeat is there."""
COUNT = "thermaxis-count.count"
"""Pin that counts the periods of the servo thread: as long as it moves, the thread runs."""
TIMEOUT = "watchdog.timeout-0"
"""Parameter: time without a heartbeat after which the watchdog trips. [s]"""
_TOLERANCE = 1e-6
_PIN = re.compile(
    r"\s*\d+\s+\w+\s+(?:IN|OUT|I/O)\s+(?P<value>\S+)\s+(?P<pin>\S+)(?:\s+(?:<==|==>|<=>)\s+(?P<signal>\S+))?\s*"
)
_FUNCTION = re.compile(r"\s*\d+\s+(?P<function>\S+)\s*")
_THREAD = re.compile(r"\s*\d+\s+(?:YES|NO)\s+(?P<thread>\S+)\s+\(.*")


class _Net(NamedTuple):
    """Pins that one signal joins."""

    signal: str
    source: str
    """Pin that drives it; empty for a signal that the writer sets."""
    targets: tuple[str, ...]


def _nets(outputs: Sequence[LinuxCncOutput]) -> list[_Net]:
    limits = tuple(f"{output.limit}.enable" for output in outputs)
    nets = [
        _Net(HEARTBEAT, "", ("watchdog.input-0",)),
        _Net(ARM, "", ("watchdog.enable-in",)),
        _Net(OK, "watchdog.ok-out", limits),
    ]
    for output in outputs:
        n, limit, shift = output.joint, output.limit, output.shift
        nets += [
            _Net(output.request, "", (f"{limit}.in",)),
            _Net(f"thermaxis-offset-{n}", f"{limit}.out", (f"{shift}.offset",)),
            _Net(f"thermaxis-commanded-{n}", f"joint.{n}.motor-pos-cmd", (f"{shift}.in",)),
            _Net(f"thermaxis-feedback-{n}", f"{shift}.fb-out", (f"joint.{n}.motor-pos-fb",)),
        ]
    return nets


def _functions(outputs: Sequence[LinuxCncOutput]) -> tuple[list[str], list[str]]:
    """Return the functions before the motion controller, and those behind it in their order."""
    before = [f"{output.shift}.update-feedback" for output in outputs]
    behind = [f"{COUNT.removesuffix('.count')}.increment"]
    behind += ["watchdog.set-timeouts", "watchdog.process"]
    for output in outputs:
        behind += [output.limit, f"{output.shift}.update-output"]
    return before, behind


_MOTION = ("motion-command-handler", "motion-controller")


# ---- the text for the machine -------------------------------------------------------------------

_HEAD = """\
# Thermal offsets below the motion controller, written by thermaxis.
#
# In the machine's HAL file:
# 1. Put this line directly behind "addf motion-controller {thread}":
#        source {file}
#    The functions that follow there (position loop, output to the drives) act on the shifted
#    position of the same period.
# 2. In the lines that lead to and from the drive put other pins in place of the joint's:
{pins}
#
# LinuxCNC refuses to start while one of these is missing: the joint's pins have a connection
# already. Where the machine loads one of these components already, load all of its names in one
# line. There is one watchdog in a machine.
#
# Not protected: limits of travel do not see the offset. Keep the soft limits inside the hard stops
# by the offset's bound.
"""


def hal_text(settings: LinuxCncSettings, file: str = "thermal.hal") -> str:
    """Return the part of the machine's HAL file that applies the offsets.

    Clamp, rate and acceleration are those of the configuration: what thermaxis never asks for, the
    machine never does.
    """
    outputs = sorted(settings.outputs.values(), key=lambda output: output.joint)
    thread = settings.thread
    pins = "\n".join(
        f"#        joint.{output.joint}.{pin:<14} -> {output.shift}.{other}"
        for output in outputs
        for pin, other in (("motor-pos-cmd", "out"), ("motor-pos-fb", "fb-in"))
    )
    lines = [_HEAD.format(thread=thread, file=_plain(file), pins=pins)]
    lines += [
        "loadrt watchdog num_inputs=1",
        f"loadrt threadtest names={COUNT.removesuffix('.count')}",
        f"loadrt limit3 names={','.join(output.limit for output in outputs)}",
        f"loadrt offset names={','.join(output.shift for output in outputs)}",
        "",
        "# Before the two functions of the motion controller, then behind them.",
    ]
    before, behind = _functions(outputs)
    lines += [f"addf {function} {thread} -{len(_MOTION) + 1}" for function in before]
    lines += [f"addf {function} {thread}" for function in behind]
    lines += [
        "",
        f"# Without a heartbeat for {settings.watchdog_s:g} s the offset returns to zero.",
    ]
    lines.append(f"setp {TIMEOUT} {settings.watchdog_s!r}")
    for name, output in sorted(settings.outputs.items(), key=lambda item: item[1].joint):
        limits = output.limits
        lines += [
            "",
            (
                f"# {_plain(name)}: {limits.total_um:g} um, {limits.largest_rate_um_per_s:g} um/s;"
                f" {_plain(output.sign)}."
            ),
            *(f"setp {pin} {value!r}" for pin, value in output.bounds.items()),
        ]
    lines.append("")
    for net in _nets(outputs):
        source = f"{net.source} " if net.source else ""
        lines.append(f"net {net.signal} {source}=> {' '.join(net.targets)}")
    return "\n".join(lines) + "\n"


def _plain(text: str) -> str:
    """Return text that cannot end a comment or a line."""
    return re.sub(r"[^A-Za-z0-9 _.-]", "_", text)[:80]


# ---- what runs on the machine -------------------------------------------------------------------


def arrangement_commands(settings: LinuxCncSettings) -> list[str]:
    """Return what is asked of a machine before anything is written to it."""
    values = [TIMEOUT, *_bound_pins(settings)]
    pins = [f"show pin {pin}" for pin in _all_pins(settings)]
    return ["show thread", *(f"getp {name}" for name in values), *pins]


def arrangement_faults(
    settings: LinuxCncSettings, answers: Sequence[Sequence[str]]
) -> tuple[Message, ...]:
    """Return what on the machine is not as the HAL file of these settings makes it.

    Wider bounds, a longer watchdog, a function that does not run or runs in the wrong order, and a
    missing connection are faults. Narrower bounds are not: they show as an offset that is not
    accepted.
    """
    bounds = _bound_pins(settings)
    threads, values = answers[0], answers[1 : 2 + len(bounds)]
    shown = answers[2 + len(bounds) :]
    return (
        *_order_faults(settings, threads),
        *_value_faults(settings, bounds, values),
        *_net_faults(settings, [line for answer in shown for line in answer]),
    )


def _bound_pins(settings: LinuxCncSettings) -> dict[str, float]:
    return {
        pin: value for output in settings.outputs.values() for pin, value in output.bounds.items()
    }


def _all_pins(settings: LinuxCncSettings) -> list[str]:
    outputs = list(settings.outputs.values())
    pins = [pin for net in _nets(outputs) for pin in (net.source, *net.targets) if pin]
    for output in outputs:
        pins += [f"{output.shift}.out", f"{output.shift}.fb-in", f"{output.limit}.load"]
    return pins


def _order_faults(settings: LinuxCncSettings, lines: Sequence[str]) -> list[Message]:
    functions: list[str] = []
    current = ""
    for line in lines:
        if thread := _THREAD.fullmatch(line):
            current = thread["thread"]
        elif current == settings.thread and (function := _FUNCTION.fullmatch(line)):
            functions.append(function["function"])
    before, behind = _functions(list(settings.outputs.values()))
    wanted = [*before, *_MOTION, *behind]
    lacking = [function for function in wanted if function not in functions]
    if lacking:
        return [_fault("hal_not_run", thread=settings.thread, functions=tuple(lacking))]
    place = {function: functions.index(function) for function in wanted}
    first, last = place[_MOTION[0]], place[_MOTION[1]]
    faults = [
        _fault("hal_too_late", function=function, motion=_MOTION[0])
        for function in before
        if place[function] > first
    ]
    faults += [
        _fault("hal_too_early", function=function, motion=_MOTION[1])
        for function in behind
        if place[function] < last
    ]
    for output in settings.outputs.values():
        chain = ["watchdog.process", output.limit, f"{output.shift}.update-output"]
        if [place[function] for function in chain] != sorted(place[f] for f in chain):
            faults.append(_fault("hal_order", thread=settings.thread, functions=tuple(chain)))
    return faults


def _value_faults(
    settings: LinuxCncSettings, bounds: Mapping[str, float], answers: Sequence[Sequence[str]]
) -> list[Message]:
    faults: list[Message] = []
    timeout_s = _read(answers[0], TIMEOUT)
    if timeout_s is None:
        faults.append(_fault("hal_unread", pin=TIMEOUT))
    elif timeout_s > settings.watchdog_s * (1.0 + _TOLERANCE):
        faults.append(_fault("hal_watchdog_long", found_s=timeout_s, most_s=settings.watchdog_s))
    elif timeout_s < 1.5 * settings.cycle_s:
        faults.append(_fault("hal_watchdog_short", found_s=timeout_s, cycle_s=settings.cycle_s))
    for (pin, bound), answer in zip(bounds.items(), answers[1:], strict=True):
        value = _read(answer, pin)
        if value is None:
            faults.append(_fault("hal_unread", pin=pin))
        elif value * bound <= 0.0 or abs(value) > abs(bound) * (1.0 + _TOLERANCE):
            faults.append(_fault("hal_bound", pin=pin, found=value, bound=bound))
    return faults


def _fault(code: str, **values: Value) -> Message:
    return Message(f"error-{code}", values)


def _read(answer: Sequence[str], pin: str) -> float | None:
    try:
        return number_of(answer, pin)
    except HalRefusedError:
        return None


def _net_faults(settings: LinuxCncSettings, lines: Sequence[str]) -> list[Message]:
    signal_of: dict[str, str] = {}
    true: set[str] = set()
    for line in lines:
        if match := _PIN.fullmatch(line):
            signal_of[match["pin"]] = match["signal"] or ""
            if match["value"] == "TRUE":
                true.add(match["pin"])
    outputs = list(settings.outputs.values())
    faults: list[Message] = []
    for net in _nets(outputs):
        pins = [pin for pin in (net.source, *net.targets) if pin]
        signals = {signal_of.get(pin, "") for pin in pins}
        wanted = signals if net.source else {net.signal}
        if len(signals) != 1 or "" in signals or signals != wanted:
            joined = pins if net.source else [f"signal {net.signal}", *pins]
            faults.append(_fault("hal_unconnected", pins=tuple(joined)))
    for output in outputs:
        ends = (f"{output.shift}.out", f"{output.shift}.fb-in")
        faults += [_fault("hal_leads_nowhere", pin=pin) for pin in ends if not signal_of.get(pin)]
        load = f"{output.limit}.load"
        if signal_of.get(load) or load in true:
            faults.append(_fault("hal_load_used", pin=load))
    return faults
