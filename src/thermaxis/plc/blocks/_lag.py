"""The small blocks of the model: a section, a delay, and a gain by diameter."""

from itertools import pairwise

from thermaxis.compensation import Part
from thermaxis.plc.blocks._draft import Draft
from thermaxis.plc.tree import Block, Kind

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
    draft.input("u_k", "input since the last call [K]")
    draft.input("alpha", "1 - exp(-cycle / time constant) [1]")
    draft.input("start", "whether to start anew", Kind.BOOL)
    draft.input("start_k", "state at a new start [K]")
    draft.output("x_k", "state [K]")
    draft.state("state_k", "state [K]")
    draft.temporary("step_k", "increment [K]")
    if double:
        return draft.block(
            """
            if start:
                state_k = start_k
            else:
                step_k = u_k - state_k
                step_k = alpha * step_k
                state_k += step_k
            x_k = state_k
            """
        )
    draft.state("lost_k", "what the sum has added too much [K]")
    draft.temporary("sum_k", "sum after rounding [K]")
    draft.constant("zero", "nothing", 0.0)
    return draft.block(
        """
        if start:
            state_k = start_k
            lost_k = zero
        else:
            step_k = u_k - state_k
            step_k = alpha * step_k
            step_k -= lost_k
            sum_k = state_k + step_k
            # The next two lines are no nonsense: they find what rounding took.
            lost_k = sum_k - state_k
            lost_k -= step_k
            state_k = sum_k
        x_k = state_k
        """
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
    draft.input("u_k", "input [K]")
    draft.input("start", "whether to start anew", Kind.BOOL)
    draft.output("y_k", "delayed input [K]")
    draft.state("ring", "past inputs [K]", length=cycles)
    draft.state("place", "where the oldest stands [1]", Kind.INT)
    draft.state("full", "whether all were written since the start", Kind.BOOL)
    draft.state("held_k", "delayed input [K]")
    return draft.block(
        f"""
        if start:
            place = 0
            full = False
            held_k = u_k
        elif full:
            held_k = ring[place]
        ring[place] = u_k
        place += 1
        if place >= {cycles}:
            place = 0
            full = True
        y_k = held_k
        """
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
    draft.input("diameter_mm", "clamping diameter [mm]")
    draft.input("known", "whether it is stated, else the tool centre point", Kind.BOOL)
    draft.output("gain", "factor of the part [1]", start=1.0)
    draft.output("held", "whether the diameter lies outside the points", Kind.BOOL)
    draft.constant("tool_gain", "gain at the tool centre point [1]", part.tool_gain)
    points = part.gain_by_diameter
    for k, p in enumerate(points, 1):
        draft.constant(f"d{k}_mm", f"diameter of point {k} [mm]", p.diameter_mm)
    for k, p in enumerate(points, 1):
        draft.constant(f"g{k}", f"gain of point {k} [1]", p.gain)
    if len(points) > 1:
        draft.temporary("share", "place between two points [1]")
    lines = ""
    for k, (low, high) in enumerate(pairwise(points), 1):
        width_mm, rise = high.diameter_mm - low.diameter_mm, high.gain - low.gain
        draft.constant(f"width{k}_mm", f"from point {k} to the next [mm]", width_mm)
        draft.constant(f"rise{k}", f"gain from point {k} to the next [1]", rise)
        lines += f"""
        elif diameter_mm <= d{k + 1}_mm:
            share = diameter_mm - d{k}_mm
            share = share / width{k}_mm
            share = share * rise{k}
            gain = g{k} + share"""
    return draft.block(
        f"""
        held = not d1_mm <= diameter_mm <= d{len(points)}_mm
        if not known:
            gain = tool_gain
            held = False
        elif diameter_mm <= d1_mm:
            gain = g1{lines}
        else:
            gain = g{len(points)}
        """
    )
