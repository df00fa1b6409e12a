"""The blocks of one output: its trim, what is read back, what is wanted, and its limits."""

from thermaxis.compensation import LARGEST_RULE
from thermaxis.plc.blocks._draft import (
    NO,
    YES,
    Draft,
    above,
    at_least,
    below,
    both,
    choose,
    either,
    equals,
    less,
    let,
    minus,
    no,
    note,
    plus,
    times,
    when,
    within,
)
from thermaxis.plc.tree import Block, Kind

TRIM = "tx_trim"
"""Name of the block of a trim."""
READ_BACK = "tx_read_back"
"""Name of the block of what is read back."""
WANTED = "tx_wanted"
"""Name of the block of what is wanted."""
LIMIT = "tx_limit"
"""Name of the block of the limits."""
LARGEST_READ_UM = LARGEST_RULE
"""A larger magnitude that is read back is no offset. [um]"""


def trim_block(*, double: bool) -> Block:
    """Return the block of a person's addition to one output."""
    draft = Draft(
        TRIM,
        "A person adds a bounded amount to one output: every new value of the input is a request,",
        "that of the first call is none. It expires. What is refused leaves the trim as it is.",
        "Zero takes it back, in every state.",
        double=double,
    )
    asked = draft.input("trim_um", "what is asked for [um]")
    first = draft.input("first", "whether this is the first call, which asks nothing", Kind.BOOL)
    in_fault = draft.input("in_fault", "whether it is in the state Fault", Kind.BOOL)
    passed = draft.input("passed", "whether a cycle has passed", Kind.BOOL)
    cycle_s = draft.input("cycle_s", "time of a cycle [s]")
    largest = draft.input("largest_um", "largest trim [um]")
    longest = draft.input("longest_s", "time after which a trim expires [s]")
    added = draft.output("added_um", "trim in force [um]")
    refused = draft.output("refused", "whether a new trim was refused", Kind.BOOL)
    force = draft.state("in_force_um", "trim in force [um]")
    left = draft.state("left_s", "time until it expires [s]")
    before = draft.state("before_um", "last value that was asked for [um]")
    odd = draft.state("odd", "whether what was asked last was no number", Kind.BOOL)
    number = draft.temporary("is_number", "whether a number is asked for", Kind.BOOL)
    zero = draft.constant("zero", "nothing", 0.0)
    return draft.block(
        let(refused, NO),
        when(
            passed,
            choose(
                (above(left, cycle_s), (let(left, less(left, cycle_s)),)),
                otherwise=(let(force, zero), let(left, zero)),
            ),
        ),
        let(number, either(at_least(asked, zero), below(asked, zero))),
        when(
            both(no(first), either(no(number), odd, no(equals(asked, before)))),
            choose(
                (within(asked, zero, zero), (let(force, zero), let(left, zero))),
                (in_fault, (let(refused, YES),)),
                (no(within(asked, minus(largest), largest)), (let(refused, YES),)),
                (above(longest, zero), (let(force, asked), let(left, longest))),
                otherwise=(let(refused, YES),),
            ),
        ),
        let(odd, no(number)),
        when(number, let(before, asked)),
        let(added, force),
    )


def read_back_block(*, double: bool) -> Block:
    """Return the block that compares what the machine reports with what was written."""
    draft = Draft(
        READ_BACK,
        "Compares what the machine reports with what was written. In a fault the correction goes",
        "to zero no further than the machine is seen to follow, and never outward: an offset that",
        "the machine keeps would jump on the day on which it is written again.",
        double=double,
    )
    read = draft.input("read_um", "what the machine reports [um]")
    read_ok = draft.input("read_ok", "whether it was read", Kind.BOOL)
    force = draft.input("in_force_um", "correction in force [um]")
    tolerance = draft.input("tolerance_um", "difference that is believed [um]")
    agrees = draft.output("agrees", "whether they agree", Kind.BOOL)
    followed = draft.output("followed_um", "where a fault lets it go [um]")
    difference = draft.temporary("difference_um", "what the machine reports too much [um]")
    zero = draft.constant("zero", "nothing", 0.0)
    largest = draft.constant("largest_read_um", "more is no offset [um]", LARGEST_READ_UM)
    return draft.block(
        let(agrees, NO),
        let(followed, zero),
        when(
            both(read_ok, within(read, minus(largest), largest)),
            let(difference, less(read, force)),
            let(agrees, within(difference, minus(tolerance), tolerance)),
            when(no(agrees), let(followed, read)),
            choose(
                (
                    above(force, zero),
                    (
                        when(below(followed, zero), let(followed, zero)),
                        when(above(followed, force), let(followed, force)),
                    ),
                ),
                otherwise=(
                    when(above(followed, zero), let(followed, zero)),
                    when(below(followed, force), let(followed, force)),
                ),
            ),
        ),
    )


def wanted_block(*, double: bool) -> Block:
    """Return the block of what a correction should be, before rate and supervisor."""
    draft = Draft(
        WANTED,
        "Minus the weighted model within its magnitude, and the trim, within the total.",
        double=double,
    )
    model = draft.input("model_um", "displacement by the model [um]")
    weight = draft.input("weight", "weight of the model [1]")
    added = draft.input("added_um", "trim in force [um]")
    largest = draft.input("largest_um", "largest magnitude of the correction [um]")
    total = draft.input("total_um", "largest magnitude with the trim [um]")
    wanted = draft.output("wanted_um", "what the correction should be [um]")
    at_limit = draft.output("at_limit", "whether the model asks for more", Kind.BOOL)
    c = draft.temporary("sum_um", "what the correction should be [um]")
    return draft.block(
        let(c, times(weight, model)),
        let(c, minus(c)),
        let(at_limit, no(within(c, minus(largest), largest))),
        choose(
            (above(c, largest), (let(c, largest),)),
            (below(c, minus(largest)), (let(c, minus(largest)),)),
        ),
        let(c, plus(c, added)),
        choose(
            (above(c, total), (let(c, total),)),
            (below(c, minus(total)), (let(c, minus(total)),)),
        ),
        let(wanted, c),
    )


def limit_block(*, double: bool) -> Block:
    """Return the block of the limits of one output.

    Not protected: a correction that lies outside the total comes back at the rate, no faster.
    """
    draft = Draft(
        LIMIT,
        "The correction goes to its goal within the total, as fast as the rate allows and never",
        "faster. A goal stays until another is wanted that differs by more than the deadband.",
        "Zero and the correction in force are goals that no deadband keeps away.",
        double=double,
    )
    asked = draft.input("asked_um", "where it is to go [um]")
    keep = draft.input("keep", "whether it stays as it is instead", Kind.BOOL)
    force = draft.input("in_force_um", "correction in force [um]")
    before = draft.input("goal_before_um", "last goal [um]")
    passed = draft.input("passed", "whether a cycle has passed", Kind.BOOL)
    total = draft.input("total_um", "largest magnitude [um]")
    deadband = draft.input("deadband_um", "deadband, 0 for none [um]")
    rate_step = draft.input("rate_step_um", "largest change in a cycle [um]")
    goal = draft.output("goal_um", "goal [um]")
    correction = draft.output("correction_um", "correction that is allowed [um]")
    step = draft.temporary("step_um", "largest change in this cycle [um]")
    distance = draft.temporary("distance_um", "from the last goal [um]")
    highest = draft.temporary("highest_um", "highest correction that is allowed [um]")
    lowest = draft.temporary("lowest_um", "lowest correction that is allowed [um]")
    after = draft.temporary("after_um", "correction that is allowed [um]")
    zero = draft.constant("zero", "nothing", 0.0)
    stays = both(
        above(deadband, zero),
        within(distance, minus(deadband), deadband),
        no(within(asked, zero, zero)),
        no(within(asked, force, force)),
    )
    return draft.block(
        choose(
            (keep, (let(goal, force), let(correction, force))),
            otherwise=(
                let(step, zero),
                when(passed, let(step, rate_step)),
                note("Where to: a small change of the goal is none."),
                let(distance, less(asked, before)),
                choose((stays, (let(goal, before),)), otherwise=(let(goal, asked),)),
                note("How far: the total first, the rate last, so that nothing passes it."),
                let(after, goal),
                choose(
                    (above(after, total), (let(after, total),)),
                    (below(after, minus(total)), (let(after, minus(total)),)),
                ),
                let(highest, plus(force, step)),
                let(lowest, less(force, step)),
                choose(
                    (above(after, highest), (let(after, highest),)),
                    (below(after, lowest), (let(after, lowest),)),
                ),
                let(correction, after),
            ),
        ),
    )
