"""The small blocks of the model: a section, a delay, and a gain by diameter."""

from itertools import pairwise

from thermaxis.compensation import Part
from thermaxis.plc.blocks._draft import (
    NO,
    YES,
    Draft,
    at_least,
    at_most,
    choose,
    less,
    let,
    no,
    note,
    over,
    plus,
    times,
    when,
    within,
)
from thermaxis.plc.tree import Block, Count, Element, Expression, Kind, Name, Statement

LAG = "tx_lag"
"""Name of the block of a section."""


def lag_block(*, double: bool) -> Block:
    """Return the block of a section in increment form.

    In REAL what the sum loses is kept in a second state and given back (Kahan): without it a slow
    section at a fast cycle comes to rest too early.
    """
    draft = Draft(
        LAG,
        "First-order lag in increment form: the state moves by alpha times its distance to the",
        "input."
        if double
        else "input. What the sum loses by rounding is kept and given back (Kahan).",
        double=double,
    )
    u = draft.input("u_k", "input since the last call [K]")
    alpha = draft.input("alpha", "1 - exp(-cycle / time constant) [1]")
    start = draft.input("start", "whether to start anew", Kind.BOOL)
    start_k = draft.input("start_k", "state at a new start [K]")
    out = draft.output("x_k", "state [K]")
    x = draft.state("state_k", "state [K]")
    d = draft.temporary("step_k", "increment [K]")
    advance: tuple[Statement, ...] = (let(d, less(u, x)), let(d, times(alpha, d)))
    if double:
        return draft.block(
            choose((start, (let(x, start_k),)), otherwise=(*advance, let(x, plus(x, d)))),
            let(out, x),
        )
    c = draft.state("lost_k", "what the sum has added too much [K]")
    t = draft.temporary("sum_k", "sum after rounding [K]")
    zero = draft.constant("zero", "nothing", 0.0)
    return draft.block(
        choose(
            (start, (let(x, start_k), let(c, zero))),
            otherwise=(
                *advance,
                let(d, less(d, c)),
                let(t, plus(x, d)),
                note("The next two lines are no nonsense: they find what rounding took."),
                let(c, less(t, x)),
                let(c, less(c, d)),
                let(x, t),
            ),
        ),
        let(out, x),
    )


def delay_name(cycles: int) -> str:
    """Return the name of the block of a delay."""
    return f"tx_delay_{cycles}"


def delay_block(cycles: int, *, double: bool) -> Block:
    """Return the block of a delay: a ring of as many numbers as it has cycles."""
    draft = Draft(
        delay_name(cycles),
        f"Delay of {cycles} cycles. Until so many have passed since the start the first value",
        "stands for those before it.",
        double=double,
    )
    u = draft.input("u_k", "input [K]")
    start = draft.input("start", "whether to start anew", Kind.BOOL)
    out = draft.output("y_k", "delayed input [K]")
    ring = draft.state("ring", "past inputs [K]", length=cycles)
    place = draft.state("place", "where the oldest stands [1]", Kind.INT)
    full = draft.state("full", "whether all were written since the start", Kind.BOOL)
    first = draft.state("held_k", "delayed input [K]")
    here = Element(ring.name, place.name)
    return draft.block(
        choose(
            (start, (let(place, Count(0)), let(full, NO), let(first, u))),
            (full, (let(first, here),)),
        ),
        let(here, u),
        let(place, plus(place, Count(1))),
        when(at_least(place, Count(cycles)), let(place, Count(0)), let(full, YES)),
        let(out, first),
    )


def gain_block(name: str, part: Part, *, double: bool) -> Block:
    """Return the block of a gain by diameter.

    References
    ----------
    Mareš and Horejš 2021, equation (6).
    """
    draft = Draft(
        name,
        "Gain by clamping diameter of the workpiece, linear between the points, end values held.",
        "Source: Mares and Horejs 2021, equation (6).",
        double=double,
    )
    diameter = draft.input("diameter_mm", "clamping diameter [mm]")
    known = draft.input("known", "whether it is stated, else the tool centre point", Kind.BOOL)
    gain = draft.output("gain", "factor of the part [1]", start=1.0)
    held = draft.output("held", "whether the diameter lies outside the points", Kind.BOOL)
    tool = draft.constant("tool_gain", "gain at the tool centre point [1]", part.tool_gain)
    points = part.gain_by_diameter
    d = [
        draft.constant(f"d{k}_mm", f"diameter of point {k} [mm]", p.diameter_mm)
        for k, p in enumerate(points, 1)
    ]
    g = [draft.constant(f"g{k}", f"gain of point {k} [1]", p.gain) for k, p in enumerate(points, 1)]
    branches: list[tuple[Expression, tuple[Statement, ...]]] = [
        (no(known), (let(gain, tool), let(held, NO))),
        (at_most(diameter, d[0]), (let(gain, g[0]),)),
    ]
    share = Name("share")
    if len(points) > 1:
        draft.temporary(share.name, "place between two points [1]")
    for k, (low, high) in enumerate(pairwise(points), 1):
        width = draft.constant(
            f"width{k}_mm", f"from point {k} to the next [mm]", high.diameter_mm - low.diameter_mm
        )
        rise = draft.constant(
            f"rise{k}", f"gain from point {k} to the next [1]", high.gain - low.gain
        )
        line: tuple[Statement, ...] = (
            let(share, less(diameter, d[k - 1])),
            let(share, over(share, width)),
            let(share, times(share, rise)),
            let(gain, plus(g[k - 1], share)),
        )
        branches.append((at_most(diameter, d[k]), line))
    return draft.block(
        let(held, no(within(diameter, d[0], d[-1]))),
        choose(*branches, otherwise=(let(gain, g[-1]),)),
    )
