"""The blocks of one output: its trim, what is read back, what is wanted, and its limits."""

from thermaxis.compensation import LARGEST_RULE
from thermaxis.plc.blocks._draft import Draft
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
    draft.input("trim_um", "what is asked for [um]")
    draft.input("first", "whether this is the first call, which asks nothing", Kind.BOOL)
    draft.input("in_fault", "whether it is in the state Fault", Kind.BOOL)
    draft.input("passed", "whether a cycle has passed", Kind.BOOL)
    draft.input("cycle_s", "time of a cycle [s]")
    draft.input("largest_um", "largest trim [um]")
    draft.input("longest_s", "time after which a trim expires [s]")
    draft.output("added_um", "trim in force [um]")
    draft.output("refused", "whether a new trim was refused", Kind.BOOL)
    draft.state("in_force_um", "trim in force [um]")
    draft.state("left_s", "time until it expires [s]")
    draft.state("before_um", "last value that was asked for [um]")
    draft.state("odd", "whether what was asked last was no number", Kind.BOOL)
    draft.temporary("is_number", "whether a number is asked for", Kind.BOOL)
    draft.constant("zero", "nothing", 0.0)
    return draft.block(
        """
        refused = False
        if passed:
            if left_s > cycle_s:
                left_s -= cycle_s
            else:
                in_force_um = zero
                left_s = zero
        is_number = trim_um >= zero or trim_um < zero
        if not first and (not is_number or odd or not trim_um == before_um):
            if zero <= trim_um <= zero:
                in_force_um = zero
                left_s = zero
            elif in_fault:
                refused = True
            elif not -largest_um <= trim_um <= largest_um:
                refused = True
            elif longest_s > zero:
                in_force_um = trim_um
                left_s = longest_s
            else:
                refused = True
        odd = not is_number
        if is_number:
            before_um = trim_um
        added_um = in_force_um
        """
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
    draft.input("read_um", "what the machine reports [um]")
    draft.input("read_ok", "whether it was read", Kind.BOOL)
    draft.input("in_force_um", "correction in force [um]")
    draft.input("tolerance_um", "difference that is believed [um]")
    draft.output("agrees", "whether they agree", Kind.BOOL)
    draft.output("followed_um", "where a fault lets it go [um]")
    draft.temporary("difference_um", "what the machine reports too much [um]")
    draft.constant("zero", "nothing", 0.0)
    draft.constant("largest_read_um", "more is no offset [um]", LARGEST_READ_UM)
    return draft.block(
        """
        agrees = False
        followed_um = zero
        if read_ok and -largest_read_um <= read_um <= largest_read_um:
            difference_um = read_um - in_force_um
            agrees = -tolerance_um <= difference_um <= tolerance_um
            if not agrees:
                followed_um = read_um
            if in_force_um > zero:
                if followed_um < zero:
                    followed_um = zero
                if followed_um > in_force_um:
                    followed_um = in_force_um
            else:
                if followed_um > zero:
                    followed_um = zero
                if followed_um < in_force_um:
                    followed_um = in_force_um
        """
    )


def wanted_block(*, double: bool) -> Block:
    """Return the block of what a correction should be, before rate and supervisor."""
    draft = Draft(
        WANTED,
        "Minus the weighted model within its magnitude, and the trim, within the total.",
        double=double,
    )
    draft.input("model_um", "displacement by the model [um]")
    draft.input("weight", "weight of the model [1]")
    draft.input("added_um", "trim in force [um]")
    draft.input("largest_um", "largest magnitude of the correction [um]")
    draft.input("total_um", "largest magnitude with the trim [um]")
    draft.output("wanted_um", "what the correction should be [um]")
    draft.output("at_limit", "whether the model asks for more", Kind.BOOL)
    draft.temporary("sum_um", "what the correction should be [um]")
    return draft.block(
        """
        sum_um = weight * model_um
        sum_um = -sum_um
        at_limit = not -largest_um <= sum_um <= largest_um
        if sum_um > largest_um:
            sum_um = largest_um
        elif sum_um < -largest_um:
            sum_um = -largest_um
        sum_um += added_um
        if sum_um > total_um:
            sum_um = total_um
        elif sum_um < -total_um:
            sum_um = -total_um
        wanted_um = sum_um
        """
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
    draft.input("asked_um", "where it is to go [um]")
    draft.input("keep", "whether it stays as it is instead", Kind.BOOL)
    draft.input("in_force_um", "correction in force [um]")
    draft.input("goal_before_um", "last goal [um]")
    draft.input("passed", "whether a cycle has passed", Kind.BOOL)
    draft.input("total_um", "largest magnitude [um]")
    draft.input("deadband_um", "deadband, 0 for none [um]")
    draft.input("rate_step_um", "largest change in a cycle [um]")
    draft.output("goal_um", "goal [um]")
    draft.output("correction_um", "correction that is allowed [um]")
    draft.temporary("step_um", "largest change in this cycle [um]")
    draft.temporary("distance_um", "from the last goal [um]")
    draft.temporary("highest_um", "highest correction that is allowed [um]")
    draft.temporary("lowest_um", "lowest correction that is allowed [um]")
    draft.temporary("after_um", "correction that is allowed [um]")
    draft.constant("zero", "nothing", 0.0)
    return draft.block(
        """
        if keep:
            goal_um = in_force_um
            correction_um = in_force_um
        else:
            step_um = zero
            if passed:
                step_um = rate_step_um
            # Where to: a small change of the goal is none.
            distance_um = asked_um - goal_before_um
            if (
                deadband_um > zero
                and -deadband_um <= distance_um <= deadband_um
                and not zero <= asked_um <= zero
                and not in_force_um <= asked_um <= in_force_um
            ):
                goal_um = goal_before_um
            else:
                goal_um = asked_um
            # How far: the total first, the rate last, so that nothing passes it.
            after_um = goal_um
            if after_um > total_um:
                after_um = total_um
            elif after_um < -total_um:
                after_um = -total_um
            highest_um = in_force_um + step_um
            lowest_um = in_force_um - step_um
            if after_um > highest_um:
                after_um = highest_um
            elif after_um < lowest_um:
                after_um = lowest_um
            correction_um = after_um
        """
    )
