"""The main block: one call is one cycle of `thermaxis.compensation.cycle`."""

from typing import final

from thermaxis.compensation import LARGEST_DIAMETER_MM, SupervisorState
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.blocks._draft import (
    NO,
    YES,
    Draft,
    at_least,
    both,
    call,
    choose,
    either,
    equals,
    let,
    minus,
    no,
    note,
    plus,
    when,
    within,
)
from thermaxis.plc.blocks._interface import (
    channel_texts,
    declare_inputs,
    declare_outputs,
    identity,
    output_texts,
)
from thermaxis.plc.blocks._limit import LARGEST_READ_UM, LIMIT, READ_BACK, TRIM, WANTED
from thermaxis.plc.blocks._model import BAD, MODEL
from thermaxis.plc.blocks._sensor import SENSOR
from thermaxis.plc.blocks._supervisor import REQUESTS, SUPERVISOR, state_number
from thermaxis.plc.tree import Block, Count, Kind, Name, OutputOf, Statement

LAST_HEARTBEAT = 32_767
"""The heartbeat counts so far and begins again. [1]"""

_BOOL, _INT = Kind.BOOL, Kind.INT


def main_block(settings: PlcSettings) -> Block:
    """Return the block that a user calls.

    Not protected: what `build_program` says.
    """
    main = _Main(settings)
    declare_inputs(main.draft, settings)
    declare_outputs(main.draft, settings)
    main.clock()
    main.take_over()
    main.read_back()
    main.requests()
    main.sensors()
    main.model()
    main.wanted()
    main.supervisor()
    main.limits()
    main.say()
    return main.draft.block(*main.body)


@final
class _Main:
    """The main block while it is written, section by section."""

    def __init__(self, settings: PlcSettings) -> None:
        self.settings = settings
        self.compensation = settings.compensation
        self.channels = settings.names.channels
        self.outputs = settings.names.outputs
        self.body: list[Statement] = []
        self.draft = Draft(
            settings.names.block,
            "The compensation: one call is one cycle. In order: requests, sensors, model, what is",
            "wanted, supervisor, goals, limits, outputs.",
            double=settings.double,
        )
        self.zero = self.draft.constant("zero", "nothing", 0.0)
        self.cycle_s = self.draft.constant(
            "cycle_s", "time from call to call [s]", settings.cycle_s
        )

    def add(self, *statements: Statement) -> None:
        """Add statements."""
        self.body.extend(statements)

    def flag(self, name: str, text: str) -> Name:
        """Declare a BOOL that is found anew in every call."""
        return self.draft.temporary(name, text, _BOOL)

    def force(self, k: int) -> Name:
        """Return the correction in force of an output."""
        return Name(f"in_force{k}_um")

    # ---- sections of the body -------------------------------------------------------------------

    def clock(self) -> None:
        """Believe the measured cycle time, or advance nothing."""
        draft, settings = self.draft, self.settings
        shortest = draft.constant(
            "shortest_cycle_s", "shortest cycle that is one [s]", settings.shortest_cycle_s
        )
        longest = draft.constant(
            "longest_cycle_s", "longest cycle that is one [s]", settings.longest_cycle_s
        )
        known = draft.state("clock_known", "whether a cycle was a good one before", _BOOL)
        clock_ok = self.flag("clock_ok", "whether the call came in time")
        passed = self.flag("passed", "whether a cycle has passed since a good call")
        count = draft.state("call_count", "calls, as the heartbeat says them [1]", _INT)
        self.add(
            note("A call that comes too early or too late advances nothing."),
            let(clock_ok, within(Name("cycle_time_s"), shortest, longest)),
            let(passed, both(clock_ok, known)),
            when(clock_ok, let(known, YES)),
            choose(
                (at_least(count, Count(LAST_HEARTBEAT)), (let(count, Count(0)),)),
                otherwise=(let(count, plus(count, Count(1))),),
            ),
            let(Name("heartbeat"), count),
        )
        self.add(
            *(let(Name(f"model_id_{n}"), Count(v)) for n, v in enumerate(identity(settings), 1))
        )

    def take_over(self) -> None:
        """Take over an offset that stands in the control, before anything else is written."""
        largest = self.draft.constant("largest_read_um", "more is no offset [um]", LARGEST_READ_UM)
        called = self.draft.state("called", "whether it was called before", _BOOL)
        waiting = self.draft.state(
            "waiting", "whether the offset in the control is still to be read", _BOOL, start=True
        )
        first = self.flag("first", "whether this is the first call")
        was_read = self.flag("was_read", "whether every reported correction is a number")
        linked = Name("linked")
        take_over = self.flag("take_over", "whether the offset in the control is taken over")
        connected = Name("connected")
        read_all: list[Statement] = []
        found: list[Statement] = []
        off = equals(Name("state_now"), state_number(SupervisorState.OFF))
        for k, (stem, text) in enumerate(output_texts(self.settings), 1):
            force = self.draft.state(f"in_force{k}_um", f"{text}: correction in force [um]")
            self.draft.state(f"goal{k}_um", f"{text}: where it goes [um]")
            read = Name(f"read_{stem}")
            is_offset = within(read, minus(largest), largest)
            read_all.append(when(no(is_offset), let(was_read, NO)))
            found.append(let(force, read))
        self.add(
            let(first, no(called)),
            let(called, YES),
            note("The offset that stands in the control is taken over in every call in Off, and"),
            note("after a loss of the connection, as soon as it is read. Until then it counts as"),
            note("not connected: in Off nobody writes, so anybody may change it."),
            let(was_read, Name("read_ok")),
            *read_all,
            when(either(no(connected), off), let(waiting, YES)),
            let(take_over, both(waiting, connected, was_read)),
            when(take_over, *found),
            let(linked, both(connected, either(no(waiting), was_read))),
            when(linked, let(waiting, NO)),
        )

    def read_back(self) -> None:
        """Compare what the machine reports, and look where the corrections are."""
        tolerance = self.draft.constant(
            "tolerance_um",
            "difference of read-back and correction that is believed [um]",
            self.compensation.supervisor.read_back_tolerance_um,
        )
        agrees = self.flag("agrees", "whether the machine reports what was written")
        outside = self.flag("outside", "whether a correction lies outside its total")
        at_zero = self.flag("at_zero", "whether every correction is zero")
        self.add(
            note("What the machine reports, and where the corrections are."),
            let(agrees, YES),
            let(outside, NO),
            let(at_zero, YES),
        )
        for k, (stem, text) in enumerate(output_texts(self.settings), 1):
            fb = self.draft.instance(f"fb_read_back{k}", READ_BACK)
            bounds = self.compensation.bounds[k - 1]
            total = self.draft.constant(
                f"total{k}_um", f"{text}: largest magnitude with the trim [um]", bounds.total_um
            )
            force = self.force(k)
            self.add(
                call(
                    fb,
                    read_um=Name(f"read_{stem}"),
                    read_ok=Name("read_ok"),
                    in_force_um=force,
                    tolerance_um=tolerance,
                ),
                when(no(OutputOf(fb, "agrees")), let(agrees, NO)),
                when(no(within(force, minus(total), total)), let(outside, YES)),
                when(no(within(force, self.zero, self.zero)), let(at_zero, NO)),
            )

    def requests(self) -> None:
        """Answer the requests: reset, enable, hold, diameter, trims."""
        fb = self.draft.instance("fb_requests", REQUESTS)
        state = self.draft.state("state_now", "state of the compensation", _INT)
        fault = self.draft.state("fault_now", "why it is in the state Fault", _INT)
        in_fault = self.flag("in_fault", "whether it is in the state Fault")
        refused = Name("refused")
        self.add(
            note("Requests, each an edge of its input, but for hold, which is a level."),
            call(
                fb,
                first=Name("first"),
                reset=Name("reset"),
                enable=Name("enable"),
                hold=Name("hold"),
                state=state,
                fault=fault,
                other_compensation=Name("other_compensation"),
                offset_outside=Name("outside"),
                read_back_agrees=Name("agrees"),
                connected=Name("linked"),
            ),
            let(refused, OutputOf(fb, "refused")),
            let(
                in_fault,
                both(
                    equals(state, state_number(SupervisorState.FAULT)),
                    no(OutputOf(fb, "acknowledged")),
                ),
            ),
        )
        for name in ("enabled", "held"):
            self.add(let(Name(name), OutputOf(fb, name)))
        for flag, text in (
            ("forget", "whether the sensors take their present values"),
            ("acknowledged", "whether a fault was acknowledged"),
            ("enabled_anew", "whether it was enabled in this call"),
        ):
            self.add(let(self.flag(flag, text), OutputOf(fb, flag)))
        self._diameter(refused)
        self._trims(refused, in_fault)

    def _diameter(self, refused: Name) -> None:
        diameter = self.draft.state("workpiece_mm", "clamping diameter in force [mm]")
        known = self.draft.state("workpiece_known", "whether there is one", _BOOL)
        largest = self.draft.constant(
            "largest_mm", "largest clamping diameter [mm]", LARGEST_DIAMETER_MM
        )
        told = Name("diameter_mm")
        self.add(
            choose(
                (no(Name("diameter_known")), (let(known, NO),)),
                (within(told, self.zero, largest), (let(diameter, told), let(known, YES))),
                otherwise=(let(refused, YES),),
            )
        )

    def _trims(self, refused: Name, in_fault: Name) -> None:
        longest = self.draft.constant(
            "longest_trim_s",
            "time after which a trim expires [s]",
            self.compensation.supervisor.longest_trim_s,
        )
        for k, (stem, text) in enumerate(output_texts(self.settings), 1):
            fb = self.draft.instance(f"fb_trim{k}", TRIM)
            largest = self.draft.constant(
                f"largest_trim{k}_um",
                f"{text}: largest trim [um]",
                self.compensation.bounds[k - 1].largest_trim_um,
            )
            self.add(
                call(
                    fb,
                    trim_um=Name(f"trim_{stem}"),
                    first=Name("first"),
                    in_fault=in_fault,
                    passed=Name("passed"),
                    cycle_s=self.cycle_s,
                    largest_um=largest,
                    longest_s=longest,
                ),
                let(Name(f"added_{stem}"), OutputOf(fb, "added_um")),
                when(OutputOf(fb, "refused"), let(refused, YES)),
            )

    def sensors(self) -> None:
        """Judge every temperature."""
        everything = self.flag("all_usable", "whether every temperature may be used")
        self.add(note("Sensors: which temperatures are believed."), let(everything, YES))
        for k, (stem, text) in enumerate(channel_texts(self.settings), 1):
            fb = self.draft.instance(f"fb_sensor{k}", SENSOR)
            flag = self.flag(f"usable{k}", f"{text}: whether it may be used")
            rules = self._sensor_rules(k, text)
            self.add(
                call(
                    fb,
                    value_c=Name(f"t_{stem}"),
                    is_ok=Name(f"ok_{stem}"),
                    forget=Name("forget"),
                    passed=Name("passed"),
                    timed=Name("clock_known"),
                    cycle_s=self.cycle_s,
                    **rules,
                ),
                let(flag, OutputOf(fb, "usable")),
                let(Name(f"quality_{stem}"), OutputOf(fb, "quality")),
                when(no(flag), let(everything, NO)),
            )

    def _sensor_rules(self, k: int, text: str) -> dict[str, Name]:
        rules = self.compensation.rules[k - 1]
        values = {
            "lowest_c": ("lowest plausible value [degC]", rules.lowest_c),
            "highest_c": ("highest plausible value [degC]", rules.highest_c),
            "step_k": ("jump that is believed at any rate [K]", rules.step_k),
            "two_steps_k": ("twice that [K]", 2.0 * rules.step_k),
            "rate_step_k": (
                "fastest plausible change in a cycle [K]",
                rules.largest_rate_k_per_s * self.settings.cycle_s,
            ),
            "frozen_s": ("longest time without a change, 0 for any [s]", rules.frozen_s),
        }
        return {
            name: self.draft.constant(f"{name}_{k}", f"{text}: {meaning}", value)
            for name, (meaning, value) in values.items()
        }

    def model(self) -> None:
        """Advance the model."""
        fb = self.draft.instance("fb_model", MODEL)
        inputs = {
            "clock_ok": Name("clock_ok"),
            "diameter_mm": Name("workpiece_mm"),
            "diameter_known": Name("workpiece_known"),
        }
        for k, stem in enumerate(self.channels, 1):
            inputs[f"value{k}_c"] = Name(f"t_{stem}")
            inputs[f"usable{k}"] = Name(f"usable{k}")
        self.add(note("The model."), call(fb, **inputs))
        for stem in self.settings.names.parts:
            self.add(let(Name(f"part_{stem}"), OutputOf(fb, f"part_{stem}")))
        for stem in self.outputs:
            self.add(
                let(Name(f"model_{stem}"), OutputOf(fb, f"model_{stem}")),
                let(Name(f"weight_{stem}"), OutputOf(fb, f"weight_{stem}")),
            )
        self.add(
            let(Name("model_quality"), OutputOf(fb, "quality")),
            let(Name("outcome_word"), OutputOf(fb, "outcome_word")),
        )

    def wanted(self) -> None:
        """Say what the corrections should be."""
        at_limit = self.flag("at_limit", "whether the model asks for more than is allowed")
        self.add(
            note("What the corrections should be: minus the model, trimmed."), let(at_limit, NO)
        )
        for k, (stem, text) in enumerate(output_texts(self.settings), 1):
            fb = self.draft.instance(f"fb_wanted{k}", WANTED)
            largest = self.draft.constant(
                f"largest{k}_um",
                f"{text}: largest magnitude of the correction [um]",
                self.compensation.bounds[k - 1].largest_um,
            )
            self.add(
                call(
                    fb,
                    model_um=Name(f"model_{stem}"),
                    weight=Name(f"weight_{stem}"),
                    added_um=Name(f"added_{stem}"),
                    largest_um=largest,
                    total_um=Name(f"total{k}_um"),
                ),
                let(Name(f"wanted_{stem}"), OutputOf(fb, "wanted_um")),
                let(Name(f"limit_{stem}"), OutputOf(fb, "at_limit")),
                when(Name(f"limit_{stem}"), let(at_limit, YES)),
            )

    def supervisor(self) -> None:
        """Ask the supervisor."""
        fb = self.draft.instance("fb_supervisor", SUPERVISOR)
        usable = self.flag("inputs_usable", "whether every input has a usable value")
        runs = self.flag("model_runs", "whether the model neither waits nor has just started")
        state, fault = Name("state_now"), Name("fault_now")
        self.add(
            note("The supervisor."),
            let(
                usable,
                both(Name("passed"), Name("all_usable"), no(equals(Name("model_quality"), BAD))),
            ),
            let(runs, no(either(OutputOf("fb_model", "started"), OutputOf("fb_model", "waiting")))),
            call(
                fb,
                state_before=state,
                fault_before=fault,
                enabled=Name("enabled"),
                held=Name("held"),
                acknowledged=Name("acknowledged"),
                enabled_anew=Name("enabled_anew"),
                inputs_usable=usable,
                model_runs=runs,
                connected=Name("linked"),
                interlocks_met=Name("interlocks_met"),
                read_back_agrees=Name("agrees"),
                at_limit=Name("at_limit"),
                other_compensation=Name("other_compensation"),
                offset_outside=Name("outside"),
                at_zero=Name("at_zero"),
            ),
            let(state, OutputOf(fb, "state")),
            let(fault, OutputOf(fb, "fault")),
            let(Name("fault_word"), OutputOf(fb, "fault_word")),
        )

    def limits(self) -> None:
        """Choose goals, and go there as fast as allowed."""
        follows = self.flag("follows", "whether the corrections follow the model")
        keep = self.flag("keep", "whether they stay as they are")
        to_zero = self.flag("to_zero", "whether they go to zero")
        state, agrees = Name("state_now"), Name("agrees")
        fading = equals(state, state_number(SupervisorState.FADING))
        fault = equals(state, state_number(SupervisorState.FAULT))
        told = either(agrees, no(Name("linked")))
        self.add(
            note("Where they go: to what is wanted while active, to zero while it fades."),
            let(
                follows,
                both(
                    equals(state, state_number(SupervisorState.ACTIVE)),
                    agrees,
                    no(equals(Name("model_quality"), BAD)),
                ),
            ),
            let(to_zero, both(told, either(fading, fault))),
            let(keep, no(either(follows, to_zero, fault))),
        )
        for k, (stem, text) in enumerate(output_texts(self.settings), 1):
            self._limit(k, stem, text)

    def _limit(self, k: int, stem: str, text: str) -> None:
        bounds, draft = self.compensation.bounds[k - 1], self.draft
        fb = draft.instance(f"fb_limit{k}", LIMIT)
        asked = draft.temporary(f"asked{k}_um", f"{text}: where it is to go [um]")
        deadband = draft.constant(f"deadband{k}_um", f"{text}: deadband [um]", bounds.deadband_um)
        rate_step = draft.constant(
            f"rate_step{k}_um",
            f"{text}: largest change in a cycle [um]",
            bounds.largest_rate_um_per_s * self.settings.cycle_s,
        )
        force, goal = self.force(k), Name(f"goal{k}_um")
        self.add(
            choose(
                (Name("follows"), (let(asked, Name(f"wanted_{stem}")),)),
                (either(Name("to_zero"), Name("keep")), (let(asked, self.zero),)),
                otherwise=(let(asked, OutputOf(f"fb_read_back{k}", "followed_um")),),
            ),
            call(
                fb,
                asked_um=asked,
                keep=Name("keep"),
                in_force_um=force,
                goal_before_um=goal,
                passed=Name("passed"),
                total_um=Name(f"total{k}_um"),
                deadband_um=deadband,
                rate_step_um=rate_step,
            ),
            let(goal, OutputOf(fb, "goal_um")),
            let(force, OutputOf(fb, "correction_um")),
        )

    def say(self) -> None:
        """Write the outputs that are left."""
        self.add(note("Outputs."), let(Name("state"), Name("state_now")))
        for k, stem in enumerate(self.outputs, 1):
            self.add(let(Name(f"correction_{stem}"), self.force(k)))
