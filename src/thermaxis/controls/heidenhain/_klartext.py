"""NC programs of plan and touch in HEIDENHAIN Klartext, the same for both generations."""

import re
from collections.abc import Iterator, Mapping

from thermaxis.controls._control import (
    HeatingWords,
    ProgramRequest,
    TouchRequest,
    axis_letter,
    options_of,
    plain_number,
    whole_option,
)
from thermaxis.controls._program import (
    MoveWords,
    block_lines,
    check_dwell,
    check_motion,
    feed_word,
    head_lines,
    stop_time_s,
)
from thermaxis.controls._touch import touch_head
from thermaxis.errors import ConfigurationError
from thermaxis.quantities import AxisKind

AXES = "XYZABCUVW"
"""Names of axes that a straight-line block takes."""
DECIMALS = 4
"""Decimals of a position. [1]"""
LARGEST_POSITION = 99_999.9999
"""Largest position of a word; from memory. [mm or deg]"""
LARGEST_FEED = 99_999.999
"""Largest feed of a word; from memory. [mm/min or deg/min]"""
LONGEST_DWELL_S = 3600.0
"""Longest dwell of cycle 9; from memory. [s]"""
MOST_LABELS = 999
"""Largest number of a label on the iTNC 530; from memory. [1]"""

PROGRAM_OPTIONS = options_of("heidenhain")
"""Options of the NC program."""

KLARTEXT_HEATING = HeatingWords(
    first=("BEGIN PGM {program_name} MM",),
    comment="; {}",
    begin=(),
    end=("M30", "END PGM {program_name} MM"),
    spindle=("TOOL CALL S{speed}", "M3"),
    spindle_stop=("M5",),
    spindles=1,
    move="L {axis}{mm:+.3f} R0 F{feed} M91",
    loop=(("LBL {number}",), ("CALL LBL {number} REP {more}",)),
    dwell=("CYCL DEF 9.0 DWELL TIME", "CYCL DEF 9.1 DWELL {s}"),
    longest_dwell_s=LONGEST_DWELL_S,
    numbered=True,
)
"""Words of a thermal test. ``TOOL CALL S`` changes the speed alone [M]."""

_FEED_DECIMALS = 3
_NO_TOUCH = 100  # error of FN 14; from memory that 0 to 299 are free
_UNTOUCHED = "+99999"  # no position: shows whether the cycle has written one
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,15}")


def klartext_program(request: ProgramRequest, title: str) -> str:
    """Return the Klartext program of a plan.

    A block of moves that is driven several times is a program section repeat: ``LBL n`` before it
    and ``CALL LBL n REP r`` after it, which drives it once more r times [S, post-processors]. A
    stop is cycle 9, ``CYCL DEF 9.1 DWELL`` in seconds [S], which acts where it stands and lets the
    axis come to rest. ``M91`` holds for its own block, so every move bears it [M].

    Not protected: it moves one axis at the plan's feed from wherever it stands and knows nothing
    of what is in its way.
    """
    check_motion(request, largest=LARGEST_POSITION)
    check_dwell(request.plan, LONGEST_DWELL_S, "cycle 9")
    axis = klartext_axis(request.axis)
    return _numbered(request.options, [*_head(request, title), *_blocks(request, axis), "M30"])


def klartext_touch(request: TouchRequest, title: str) -> str:
    """Return the Klartext program of a touch by cycle 4, measuring in 3-D [M].

    The cycle states way and feed itself and gives the position from the machine datum; its fourth
    result is -1 without a touch [M]. There is no ``M30``, so that a part program may call it [M].
    """
    axis, feed = axis_letter(request.axis, "XYZ"), f"F{request.feed_mm_per_min:g}"
    q = whole_option(request.options, "result", lowest=0, highest=1993)
    result = f"Q{q} value Q{q + 1} counter Q{q + 2} reading"
    head = touch_head(request, title, result, LONGEST_DWELL_S)
    side = "+0", "-1" if request.end_mm < request.start_mm else "+1"
    way = " ".join(f"I{letter}{side[letter == axis]}" for letter in "XYZ")
    to_start = f"L {axis}{request.start_mm:+.3f} R0 {feed} M91"
    of_axis, status = f"Q{q + 3 + 'XYZ'.index(axis)}", f"Q{q + 6}"
    loop = again = list[str]()
    if request.touches > 1:
        dwell = ("CYCL DEF 9.0 DWELL TIME", f"CYCL DEF 9.1 DWELL {request.pause_s:.3f}")
        loop = ["FN 9: IF +0 EQU +0 GOTO LBL 2", "LBL 1", *dwell, "LBL 2"]
        again = [f"CALL LBL 1 REP {request.touches - 1}"]
    lines = [
        *(*(f"; {line}" for line in head), "M5", *loop),
        *(f"FN 0: {of_axis} = {_UNTOUCHED}", f"FN 0: {status} = +0", to_start),
        *("TCH PROBE 4.0 MEASURING IN 3-D", f"TCH PROBE 4.1 Q{q + 3}", f"TCH PROBE 4.2 {way}"),
        f"TCH PROBE 4.3 DIST {request.search_mm:+.3f} {feed} MB+0 REFERENCE SYSTEM:1",
        to_start,
        f"FN 9: IF +{status} EQU -1 GOTO LBL 3",
        f"FN 9: IF +{of_axis} EQU {_UNTOUCHED} GOTO LBL 3",
        f"FN 0: Q{q + 2} = +{of_axis}",
        f"Q{q} = 1000 * ( {request.surface_mm:+.3f} - Q{q + 2} )",
        *(f"FN 1: Q{q + 1} = +Q{q + 1} + +1", *again, "FN 9: IF +0 EQU +0 GOTO LBL 4"),
        *("LBL 3", f"FN 14: ERROR = {_NO_TOUCH}", "LBL 4"),
    ]
    return _numbered(request.options, lines)


def _numbered(options: Mapping[str, str], lines: list[str]) -> str:
    name = options["program_name"]
    if _NAME.fullmatch(name) is None:
        raise ConfigurationError("program_name_unfit", name=name, key="--set program_name")
    lines = [f"BEGIN PGM {name} MM", *lines, f"END PGM {name} MM"]
    return "".join(f"{number} {line}\r\n" for number, line in enumerate(lines))


def klartext_axis(name: str) -> str:
    """Return the letter of an axis."""
    return axis_letter(name, AXES)


def _head(request: ProgramRequest, title: str) -> Iterator[str]:
    yield from (f"; {line}" for line in head_lines(request, title))
    yield "; the axis moves at the feed from where it stands. clear its way first"
    if request.plan.kind is AxisKind.ROTARY:
        yield "; M126 shortest way must not be active. it would turn the approach around"
    if stop_time_s(request.plan) <= 0:
        yield "; WARNING the plan has no dwell. the control may not stop exactly at a target"


def _blocks(request: ProgramRequest, axis: str) -> Iterator[str]:
    words = _move_words(request, axis)
    label = 0
    for block in request.blocks:
        label += block.repetitions > 1
        if label > MOST_LABELS:
            raise ConfigurationError("too_many_labels", most=MOST_LABELS, key="targets")
        loop = (f"LBL {label}", f"CALL LBL {label} REP {block.repetitions - 1}")
        yield from block_lines(block, words, loop, indent="")


def _move_words(request: ProgramRequest, axis: str) -> MoveWords:
    seconds = stop_time_s(request.plan)
    feed = feed_word(request.plan, decimals=_FEED_DECIMALS, largest=LARGEST_FEED)
    machine = " M91" if request.options["coordinates"] == "machine" else ""
    dwell = ("CYCL DEF 9.0 DWELL TIME", f"CYCL DEF 9.1 DWELL {plain_number(seconds, 3)}")
    return MoveWords(
        start=f"L {axis}",
        end=f" R0 F{feed}{machine}",
        comment="; {}",
        dwell=dwell if seconds > 0 else (),
        decimals=DECIMALS,
        position=_signed,
    )


def _signed(position: float) -> str:
    return ("" if position < 0 else "+") + plain_number(position, DECIMALS)
