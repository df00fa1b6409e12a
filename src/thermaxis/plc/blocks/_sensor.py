"""The block that judges one sensor: `thermaxis.compensation.validate_sample`."""

from thermaxis.compensation import SampleQuality
from thermaxis.plc.blocks._draft import (
    NO,
    YES,
    Draft,
    above,
    at_most,
    both,
    choose,
    either,
    less,
    let,
    minus,
    no,
    note,
    plus,
    when,
    within,
)
from thermaxis.plc.tree import Block, Count, Kind

LARGEST_NUMBER = {True: 1.7976931348623157e308, False: 3.4028234663852886e38}
"""Largest finite number, by whether numbers are LREAL."""
MOST_ALLOWANCE_K = 1e6
"""Allowances are counted no further. [K]"""
SENSOR = "tx_sensor"
"""Name of the block."""

_QUALITIES = list(SampleQuality)


def quality_number(quality: SampleQuality) -> Count:
    """Return the number of a quality: its place among them."""
    return Count(_QUALITIES.index(quality))


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
    value = draft.input("value_c", "what was read [degC]")
    ok = draft.input("is_ok", "whether its status is good", Kind.BOOL)
    forget = draft.input("forget", "whether to take the value as the first one", Kind.BOOL)
    passed = draft.input("passed", "whether a cycle has passed", Kind.BOOL)
    timed = draft.input("timed", "whether any call came in time yet", Kind.BOOL)
    cycle_s = draft.input("cycle_s", "time of a cycle [s]")
    lowest = draft.input("lowest_c", "lowest plausible value [degC]")
    highest = draft.input("highest_c", "highest plausible value [degC]")
    step = draft.input("step_k", "jump that is believed at any rate [K]")
    two_steps = draft.input("two_steps_k", "twice that [K]")
    rate_step = draft.input("rate_step_k", "fastest plausible change in a cycle [K]")
    frozen = draft.input("frozen_s", "time after which a value that stands still is not believed,"
                         " 0 for never [s]")  # fmt: skip
    usable = draft.output("usable", "whether the value may be used", Kind.BOOL)
    quality = draft.output("quality", "what is wrong with it, 0 for nothing", Kind.INT)
    known = draft.state("known", "whether a value was believed before", Kind.BOOL)
    good = draft.state("good_c", "last value that was believed [degC]")
    still = draft.state("still_s", "time since it changed, counted to the limit [s]")
    dated = draft.state("dated", "whether the time of that change is known", Kind.BOOL)
    allowance = draft.state("allowance_k", "how far it may have moved unseen [K]")
    rate = draft.temporary("rate_k", "how far it may have moved in this cycle [K]")
    moved = draft.temporary("moved_k", "how far it has moved [K]")
    distance = draft.temporary("distance_k", "the same without its sign [K]")
    most = draft.temporary("most_k", "largest allowance or largest believed distance [K]")
    zero = draft.constant("zero", "nothing", 0.0)
    longest = draft.constant("most_allowance_k", "allowances end here [K]", MOST_ALLOWANCE_K)
    finite = draft.constant("largest_number", "largest number that is one", LARGEST_NUMBER[double])
    grown = (
        let(allowance, plus(allowance, rate)),
        when(above(allowance, longest), let(allowance, longest)),
    )
    believed = (
        let(usable, YES),
        let(quality, Count(0)),
        let(known, YES),
        let(good, value),
        let(still, zero),
        let(dated, timed),
        let(allowance, zero),
    )
    return draft.block(
        let(usable, NO),
        let(quality, quality_number(SampleQuality.MISSING)),
        when(forget, let(known, NO), let(still, zero), let(allowance, zero)),
        let(rate, zero),
        when(
            passed,
            let(rate, rate_step),
            when(both(dated, at_most(still, frozen)), let(still, plus(still, cycle_s))),
        ),
        choose(
            (
                no(within(value, minus(finite), finite)),
                (note("No number: every comparison with it is false."), *grown),
            ),
            (no(ok), (let(quality, quality_number(SampleQuality.STATUS_BAD)), *grown)),
            (
                no(within(value, lowest, highest)),
                (let(quality, quality_number(SampleQuality.OUT_OF_RANGE)), *grown),
            ),
            (no(known), believed),
            otherwise=(
                let(moved, less(value, good)),
                let(distance, moved),
                when(above(zero, moved), let(distance, minus(moved))),
                choose(
                    (
                        both(within(moved, zero, zero), above(frozen, zero), above(still, frozen)),
                        (let(quality, quality_number(SampleQuality.FROZEN)),),
                    ),
                    (
                        within(moved, zero, zero),
                        (
                            let(usable, YES),
                            let(quality, Count(0)),
                            note("Believed before any call came in time: it counts from now on."),
                            let(dated, timed),
                            let(allowance, zero),
                        ),
                    ),
                    otherwise=(
                        let(most, plus(step, rate)),
                        let(most, plus(most, allowance)),
                        choose(
                            (
                                either(at_most(distance, step), at_most(distance, most)),
                                believed,
                            ),
                            otherwise=(
                                note("Too far: twice the step is all that waiting allows."),
                                let(quality, quality_number(SampleQuality.TOO_FAST)),
                                let(most, two_steps),
                                when(above(allowance, most), let(most, allowance)),
                                let(allowance, plus(allowance, rate)),
                                when(above(allowance, most), let(allowance, most)),
                            ),
                        ),
                    ),
                ),
            ),
        ),
    )
