"""The block that judges one sensor: `thermaxis.compensation.validate_sample`."""

from thermaxis.plc.blocks._draft import Draft, statements
from thermaxis.plc.tree import Block, Kind

LARGEST_NUMBER = {True: 1.7976931348623157e308, False: 3.4028234663852886e38}
"""Largest finite number, by whether numbers are LREAL."""
MOST_ALLOWANCE_K = 1e6
"""Allowances are counted no further. [K]"""
SENSOR = "tx_sensor"
"""Name of the block."""


def sensor_block(*, double: bool) -> Block:
    """Return the block that judges what was read of one sensor.

    Not protected: what `validate_sample` says, such as a slow drift of the sensor.
    """
    draft = Draft(
        SENSOR,
        "Judges one temperature: it is believed where it is there, its status is good, it is",
        "plausible, it has not jumped and is not frozen. While nothing could be read it may have",
        "moved on at its rate. A value that jumped is believed again where it comes back, or",
        "where the jump is acknowledged, never by waiting alone.",
        double=double,
    )
    draft.input("value_c", "what was read [degC]")
    draft.input("is_ok", "whether its status is good", Kind.BOOL)
    draft.input("forget", "whether to take the value as the first one", Kind.BOOL)
    draft.input("passed", "whether a cycle has passed", Kind.BOOL)
    draft.input("timed", "whether any call came in time yet", Kind.BOOL)
    draft.input("cycle_s", "time of a cycle [s]")
    draft.input("lowest_c", "lowest plausible value [degC]")
    draft.input("highest_c", "highest plausible value [degC]")
    draft.input("step_k", "jump that is believed at any rate [K]")
    draft.input("two_steps_k", "twice that [K]")
    draft.input("rate_step_k", "fastest plausible change in a cycle [K]")
    draft.input("frozen_s", "time after which a value that stands still is not believed,"
                         " 0 for never [s]")  # fmt: skip
    draft.output("usable", "whether the value may be used", Kind.BOOL)
    draft.output("quality", "what is wrong with it, 0 for nothing", Kind.INT)
    draft.state("known", "whether a value was believed before", Kind.BOOL)
    draft.state("good_c", "last value that was believed [degC]")
    draft.state("still_s", "time since it changed, counted to the limit [s]")
    draft.state("dated", "whether the time of that change is known", Kind.BOOL)
    draft.state("allowance_k", "how far it may have moved unseen [K]")
    draft.temporary("rate_k", "how far it may have moved in this cycle [K]")
    draft.temporary("moved_k", "how far it has moved [K]")
    draft.temporary("distance_k", "the same without its sign [K]")
    draft.temporary("most_k", "largest allowance or largest believed distance [K]")
    draft.constant("zero", "nothing", 0.0)
    draft.constant("most_allowance_k", "allowances end here [K]", MOST_ALLOWANCE_K)
    draft.constant("largest_number", "largest number that is one", LARGEST_NUMBER[double])
    grown = statements(
        """
        allowance_k += rate_k
        if allowance_k > most_allowance_k:
            allowance_k = most_allowance_k
        """
    )
    believed = statements(
        """
        usable = True
        quality = 0
        known = True
        good_c = value_c
        still_s = zero
        dated = timed
        allowance_k = zero
        """
    )
    return draft.block(
        """
        usable = False
        quality = Sample.MISSING
        if forget:
            known = False
            still_s = zero
            allowance_k = zero
        rate_k = zero
        if passed:
            rate_k = rate_step_k
            if dated and still_s <= frozen_s:
                still_s += cycle_s
        if not -largest_number <= value_c <= largest_number:
            # No number: every comparison with it is false.
            grown
        elif not is_ok:
            quality = Sample.STATUS_BAD
            grown
        elif not lowest_c <= value_c <= highest_c:
            quality = Sample.OUT_OF_RANGE
            grown
        elif not known:
            believed
        else:
            moved_k = value_c - good_c
            distance_k = moved_k
            if zero > moved_k:
                distance_k = -moved_k
            if zero <= moved_k <= zero and frozen_s > zero and still_s > frozen_s:
                quality = Sample.FROZEN
            elif zero <= moved_k <= zero:
                usable = True
                quality = 0
                # Believed before any call came in time: it counts from now on.
                dated = timed
                allowance_k = zero
            else:
                most_k = step_k + rate_k
                most_k += allowance_k
                if distance_k <= step_k or distance_k <= most_k:
                    believed
                else:
                    # Too far: twice the step is all that waiting allows.
                    quality = Sample.TOO_FAST
                    most_k = two_steps_k
                    if allowance_k > most_k:
                        most_k = allowance_k
                    allowance_k += rate_k
                    if allowance_k > most_k:
                        allowance_k = most_k
        """,
        grown=grown,
        believed=believed,
    )
