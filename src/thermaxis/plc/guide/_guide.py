"""The commissioning guide beside an exported program: from the file to the first correction.

Its words are templates in this folder: one for every target, which extends that for all.
"""

from functools import partial
from typing import NamedTuple, final

from thermaxis.codes import Message
from thermaxis.compensation import LONGEST_REST
from thermaxis.plc._block import Block
from thermaxis.plc._line import LineSettings, um_per_mm
from thermaxis.plc._names import remark_text
from thermaxis.plc._numbers import figure, number_text, outward_text
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc._template import rendered
from thermaxis.plc._warnings import setting_warnings
from thermaxis.plc.guide._report import NOT_CHECKED_BY_SIEMENS, TEMPCOMP, Target
from thermaxis.plc.vectors import MOST_CALLS, SelfTest

MOST_FIGURES = 40
"""Figures of the identification that are listed. [1]"""


@final
class GuideFacts(NamedTuple):
    """What the guide says besides the settings."""

    target: Target
    files: tuple[str, ...]
    """Names of the program's files."""
    vectors: str
    """Name of the file of test vectors."""
    conditions: tuple[str, ...] = ()
    """Interlocks of the machine, which are one input here."""
    line: LineSettings | None = None
    """The line; None where there is none."""
    away: tuple[bool, ...] = ()
    """By output, whether a positive motion of its axis moves the tool point away from the
    workpiece, where every output is an offset of a SINUMERIK; else empty."""
    warnings: tuple[Message, ...] = ()
    """What else is to be warned of."""
    self_test: SelfTest | None = None
    """The self-test among the files; None where there is none."""


def guide_text(settings: PlcSettings, block: Block, facts: GuideFacts) -> str:
    """Return the guide.

    Not protected: a guide does not see the machine. Whoever follows it must be allowed to set up
    this machine, and stands by its emergency stop.

    Returns
    -------
    str
        Markdown; text from people in letters, digits, space, ``-``, ``_`` and ``.`` only. The
        same for the same input, whatever the day.
    """
    compensation, line = settings.compensation, facts.line
    siemens = facts.target.dialect in {"scl", TEMPCOMP}
    outputs = [
        {
            "output": output,
            "stem": stem,
            "text": remark_text(output.name),
            "bounds": bounds,
            "step_um": step_um,
            "fade_s": bounds.total_um / bounds.largest_rate_um_per_s,
            "away": away,
            "acts": rules is not None and rules.acts,
            "um_per_mm": um_per_mm(away=away),
        }
        for output, stem, bounds, step_um, away, rules in zip(
            compensation.model.outputs,
            settings.names.outputs,
            compensation.bounds,
            settings.steps_um,
            facts.away or (False,) * len(settings.steps_um),
            compensation.probed,
            strict=True,
        )
    ]
    values = {
        **block.said,
        "facts": facts,
        "kind": "LREAL (binary64)" if settings.double else "REAL (binary32)",
        "cycle_s": figure(settings.cycle_s),
        "provenance": compensation.model.provenance,
        "figures": list(compensation.model.provenance.figures.items())[:MOST_FIGURES],
        "warnings": (*setting_warnings(settings), *facts.warnings),
        "not_checked_by_siemens": NOT_CHECKED_BY_SIEMENS if siemens else "",
        "bounds": compensation.bounds,
        "trim_um": figure(min(bounds.largest_trim_um for bounds in compensation.bounds)),
        "outputs": outputs,
        "control": line is not None or facts.away,
        "host": {"fmu": "master", "c": "program"}.get(facts.target.dialect, "PLC"),
        "literal": partial(number_text, double=settings.double),
        "fb_of_instance": '"tx_nc_offset".' if facts.target.variant == "s7-300" else "",
        "longest_rest": LONGEST_REST,
        "most_calls": MOST_CALLS,
    }
    if line is not None:
        values["k0_step"], values["slope_step"] = map(outward_text, line.reach(settings.steps_um))
    return rendered(f"{facts.target.variant or 'c'}.md.j2", values)
