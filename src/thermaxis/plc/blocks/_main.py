"""The main block: one call is one cycle of `thermaxis.compensation.cycle`."""

import textwrap
from typing import final

from thermaxis.compensation import LARGEST_DIAMETER_MM
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.blocks._draft import Draft
from thermaxis.plc.blocks._interface import (
    channel_texts,
    declare_inputs,
    declare_outputs,
    identity,
    output_texts,
)
from thermaxis.plc.blocks._limit import LARGEST_READ_UM, LIMIT, READ_BACK, TRIM, WANTED
from thermaxis.plc.blocks._model import MODEL
from thermaxis.plc.blocks._sensor import SENSOR
from thermaxis.plc.blocks._supervisor import REQUESTS, SUPERVISOR
from thermaxis.plc.tree import Block, Kind

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
    return main.draft.block(main.text)


@final
class _Main:
    """The main block while it is written, section by section."""

    def __init__(self, settings: PlcSettings) -> None:
        self.settings = settings
        self.compensation = settings.compensation
        self.outputs = list(enumerate(output_texts(settings), 1))
        self.text = ""
        self.draft = Draft(
            settings.names.block,
            "The compensation: one call is one cycle. In order: requests, sensors, model, what is",
            "wanted, supervisor, goals, limits, outputs.",
            double=settings.double,
        )
        self.draft.constant("zero", "nothing", 0.0)
        self.draft.constant("cycle_s", "time from call to call [s]", settings.cycle_s)

    def add(self, text: str) -> None:
        """Add statements."""
        self.text += textwrap.dedent(text)

    def flag(self, name: str, text: str) -> None:
        """Declare a BOOL that is found anew in every call."""
        self.draft.temporary(name, text, _BOOL)

    def bound(self, k: int, name: str, text: str, key: str, factor: float = 1.0) -> None:
        """Declare a limit of an output, times a factor, in micrometres."""
        value_um = getattr(self.compensation.bounds[k - 1], key) * factor
        channel = self.compensation.model.outputs[k - 1].name
        self.draft.constant(f"{name}{k}_um", f"{text} [um]", value_um, key, channel)

    # ---- sections of the body -------------------------------------------------------------------

    def clock(self) -> None:
        """Believe the measured cycle time, or advance nothing."""
        draft, settings = self.draft, self.settings
        draft.constant(
            "shortest_cycle_s", "shortest cycle that is one [s]", settings.shortest_cycle_s
        )
        draft.constant("longest_cycle_s", "longest cycle that is one [s]", settings.longest_cycle_s)
        draft.state("clock_known", "whether a cycle was a good one before", _BOOL)
        self.flag("clock_ok", "whether the call came in time")
        self.flag("passed", "whether a cycle has passed since a good call")
        draft.state("call_count", "calls, as the heartbeat says them [1]", _INT)
        self.add(
            f"""
            # A call that comes too early or too late advances nothing.
            clock_ok = shortest_cycle_s <= cycle_time_s <= longest_cycle_s
            passed = clock_ok and clock_known
            if clock_ok:
                clock_known = True
            if call_count >= {LAST_HEARTBEAT}:
                call_count = 0
            else:
                call_count += 1
            heartbeat = call_count
            """
        )
        for n, value in enumerate(identity(settings), 1):
            self.add(f"model_id_{n} = {value}\n")

    def take_over(self) -> None:
        """Take over an offset that stands in the control, before anything else is written."""
        draft = self.draft
        draft.constant("largest_read_um", "more is no offset [um]", LARGEST_READ_UM)
        draft.state("called", "whether it was called before", _BOOL)
        draft.state(
            "waiting", "whether the offset in the control is still to be read", _BOOL, start=True
        )
        self.flag("first", "whether this is the first call")
        self.flag("was_read", "whether every reported correction is a number")
        self.flag("take_over", "whether the offset in the control is taken over")
        read_all = found = ""
        for k, (stem, text) in self.outputs:
            draft.state(f"in_force{k}_um", f"{text}: correction in force [um]")
            draft.state(f"goal{k}_um", f"{text}: where it goes [um]")
            read_all += f"""
            if not -largest_read_um <= read_{stem} <= largest_read_um:
                was_read = False"""
            found += f"""
                in_force{k}_um = read_{stem}"""
        self.add(
            f"""
            first = not called
            called = True
            # The offset that stands in the control is taken over in every call in Off, and
            # after a loss of the connection, as soon as it is read. Until then it counts as
            # not connected: in Off nobody writes, so anybody may change it.
            was_read = read_ok{read_all}
            if not connected or state_now == State.OFF:
                waiting = True
            take_over = waiting and connected and was_read
            if take_over:{found}
            linked = connected and (not waiting or was_read)
            if linked:
                waiting = False
            """
        )

    def read_back(self) -> None:
        """Compare what the machine reports, and look where the corrections are."""
        self.draft.constant(
            "tolerance_um",
            "difference of read-back and correction that is believed [um]",
            self.compensation.supervisor.read_back_tolerance_um,
        )
        self.flag("agrees", "whether the machine reports what was written")
        self.flag("outside", "whether a correction lies outside its total")
        self.flag("at_zero", "whether every correction is zero")
        self.add(
            """
            # What the machine reports, and where the corrections are.
            agrees = True
            outside = False
            at_zero = True
            """
        )
        for k, (stem, text) in self.outputs:
            self.draft.instance(f"fb_read_back{k}", READ_BACK)
            self.bound(k, "total", f"{text}: largest magnitude with the trim", "total_um")
            self.add(
                f"""
                fb_read_back{k}(
                    read_um=read_{stem},
                    read_ok=read_ok,
                    in_force_um=in_force{k}_um,
                    tolerance_um=tolerance_um,
                )
                if not fb_read_back{k}.agrees:
                    agrees = False
                if not -total{k}_um <= in_force{k}_um <= total{k}_um:
                    outside = True
                if not zero <= in_force{k}_um <= zero:
                    at_zero = False
                """
            )

    def requests(self) -> None:
        """Answer the requests: reset, enable, hold, diameter, trims."""
        self.draft.instance("fb_requests", REQUESTS)
        self.draft.state("state_now", "state of the compensation", _INT)
        self.draft.state("fault_now", "why it is in the state Fault", _INT)
        self.flag("in_fault", "whether it is in the state Fault")
        self.flag("forget", "whether the sensors take their present values")
        self.flag("acknowledged", "whether a fault was acknowledged")
        self.flag("enabled_anew", "whether it was enabled in this call")
        self.add(
            """
            # Requests, each an edge of its input, but for hold, which is a level.
            fb_requests(
                first=first,
                reset=reset,
                enable=enable,
                hold=hold,
                state=state_now,
                fault=fault_now,
                other_compensation=other_compensation,
                offset_outside=outside,
                read_back_agrees=agrees,
                connected=linked,
            )
            refused = fb_requests.refused
            in_fault = state_now == State.FAULT and not fb_requests.acknowledged
            enabled = fb_requests.enabled
            held = fb_requests.held
            forget = fb_requests.forget
            acknowledged = fb_requests.acknowledged
            enabled_anew = fb_requests.enabled_anew
            """
        )
        self._diameter()
        self._trims()

    def _diameter(self) -> None:
        self.draft.state("workpiece_mm", "clamping diameter in force [mm]")
        self.draft.state("workpiece_known", "whether there is one", _BOOL)
        self.draft.constant("largest_mm", "largest clamping diameter [mm]", LARGEST_DIAMETER_MM)
        self.add(
            """
            if not diameter_known:
                workpiece_known = False
            elif zero <= diameter_mm <= largest_mm:
                workpiece_mm = diameter_mm
                workpiece_known = True
            else:
                refused = True
            """
        )

    def _trims(self) -> None:
        self.draft.constant(
            "longest_trim_s",
            "time after which a trim expires [s]",
            self.compensation.supervisor.longest_trim_s,
        )
        for k, (stem, text) in self.outputs:
            self.draft.instance(f"fb_trim{k}", TRIM)
            self.bound(k, "largest_trim", f"{text}: largest trim", "largest_trim_um")
            self.add(
                f"""
                fb_trim{k}(
                    trim_um=trim_{stem},
                    first=first,
                    in_fault=in_fault,
                    passed=passed,
                    cycle_s=cycle_s,
                    largest_um=largest_trim{k}_um,
                    longest_s=longest_trim_s,
                )
                added_{stem} = fb_trim{k}.added_um
                if fb_trim{k}.refused:
                    refused = True
                """
            )

    def sensors(self) -> None:
        """Judge every temperature."""
        self.flag("all_usable", "whether every temperature may be used")
        self.add(
            """
            # Sensors: which temperatures are believed.
            all_usable = True
            """
        )
        for k, (stem, text) in enumerate(channel_texts(self.settings), 1):
            self.draft.instance(f"fb_sensor{k}", SENSOR)
            self.flag(f"usable{k}", f"{text}: whether it may be used")
            rules = self.compensation.rules[k - 1]
            rate_step_k = rules.largest_rate_k_per_s * self.settings.cycle_s
            channel = self.compensation.model.channels[k - 1]
            for name, key, meaning, value in (
                ("lowest_c", "lowest_c", "lowest plausible value [degC]", rules.lowest_c),
                ("highest_c", "highest_c", "highest plausible value [degC]", rules.highest_c),
                ("step_k", "step_k", "jump that is believed at any rate [K]", rules.step_k),
                ("two_steps_k", "step_k", "twice that [K]", 2.0 * rules.step_k),
                (
                    "rate_step_k",
                    "largest_rate_k_per_s",
                    "fastest plausible change in a cycle [K]",
                    rate_step_k,
                ),
                (
                    "frozen_s",
                    "frozen_s",
                    "longest time without a change, 0 for any [s]",
                    rules.frozen_s,
                ),
            ):
                self.draft.constant(f"{name}_{k}", f"{text}: {meaning}", value, key, channel)
            self.add(
                f"""
                fb_sensor{k}(
                    value_c=t_{stem},
                    is_ok=ok_{stem},
                    forget=forget,
                    passed=passed,
                    timed=clock_known,
                    cycle_s=cycle_s,
                    lowest_c=lowest_c_{k},
                    highest_c=highest_c_{k},
                    step_k=step_k_{k},
                    two_steps_k=two_steps_k_{k},
                    rate_step_k=rate_step_k_{k},
                    frozen_s=frozen_s_{k},
                )
                usable{k} = fb_sensor{k}.usable
                quality_{stem} = fb_sensor{k}.quality
                if not usable{k}:
                    all_usable = False
                """
            )

    def model(self) -> None:
        """Advance the model."""
        self.draft.instance("fb_model", MODEL)
        names = self.settings.names
        values = "".join(
            f", value{k}_c=t_{stem}, usable{k}=usable{k}"
            for k, stem in enumerate(names.channels, 1)
        )
        self.add(
            f"""
            # The model.
            fb_model(
                clock_ok=clock_ok,
                diameter_mm=workpiece_mm,
                diameter_known=workpiece_known{values}
            )
            """
        )
        shown = [f"part_{stem}" for stem in names.parts]
        shown += [f"{name}_{stem}" for stem in names.outputs for name in ("model", "weight")]
        for name in shown:
            self.add(f"{name} = fb_model.{name}\n")
        self.add(
            """
            model_quality = fb_model.quality
            outcome_word = fb_model.outcome_word
            """
        )

    def wanted(self) -> None:
        """Say what the corrections should be."""
        self.flag("at_limit", "whether the model asks for more than is allowed")
        self.add(
            """
            # What the corrections should be: minus the model, trimmed.
            at_limit = False
            """
        )
        for k, (stem, text) in self.outputs:
            self.draft.instance(f"fb_wanted{k}", WANTED)
            self.bound(k, "largest", f"{text}: largest magnitude of the correction", "largest_um")
            self.add(
                f"""
                fb_wanted{k}(
                    model_um=model_{stem},
                    weight=weight_{stem},
                    added_um=added_{stem},
                    largest_um=largest{k}_um,
                    total_um=total{k}_um,
                )
                wanted_{stem} = fb_wanted{k}.wanted_um
                limit_{stem} = fb_wanted{k}.at_limit
                if limit_{stem}:
                    at_limit = True
                """
            )

    def supervisor(self) -> None:
        """Ask the supervisor."""
        self.draft.instance("fb_supervisor", SUPERVISOR)
        self.flag("inputs_usable", "whether every input has a usable value")
        self.flag("model_runs", "whether the model neither waits nor has just started")
        self.add(
            """
            # The supervisor.
            inputs_usable = passed and all_usable and not model_quality == Quality.BAD
            model_runs = not (fb_model.started or fb_model.waiting)
            fb_supervisor(
                state_before=state_now,
                fault_before=fault_now,
                enabled=enabled,
                held=held,
                acknowledged=acknowledged,
                enabled_anew=enabled_anew,
                inputs_usable=inputs_usable,
                model_runs=model_runs,
                connected=linked,
                interlocks_met=interlocks_met,
                read_back_agrees=agrees,
                at_limit=at_limit,
                other_compensation=other_compensation,
                offset_outside=outside,
                at_zero=at_zero,
            )
            state_now = fb_supervisor.state
            fault_now = fb_supervisor.fault
            fault_word = fb_supervisor.fault_word
            """
        )

    def limits(self) -> None:
        """Choose goals, and go there as fast as allowed."""
        self.flag("follows", "whether the corrections follow the model")
        self.flag("keep", "whether they stay as they are")
        self.flag("to_zero", "whether they go to zero")
        self.add(
            """
            # Where they go: to what is wanted while active, to zero while it fades.
            follows = state_now == State.ACTIVE and agrees and not model_quality == Quality.BAD
            to_zero = (agrees or not linked) and (
                state_now == State.FADING or state_now == State.FAULT
            )
            keep = not (follows or to_zero or state_now == State.FAULT)
            """
        )
        for k, (stem, text) in self.outputs:
            draft = self.draft
            draft.instance(f"fb_limit{k}", LIMIT)
            draft.temporary(f"asked{k}_um", f"{text}: where it is to go [um]")
            self.bound(k, "deadband", f"{text}: deadband", "deadband_um")
            rate = f"{text}: largest change in a cycle"
            self.bound(k, "rate_step", rate, "largest_rate_um_per_s", self.settings.cycle_s)
            self.add(
                f"""
                if follows:
                    asked{k}_um = wanted_{stem}
                elif to_zero or keep:
                    asked{k}_um = zero
                else:
                    asked{k}_um = fb_read_back{k}.followed_um
                fb_limit{k}(
                    asked_um=asked{k}_um,
                    keep=keep,
                    in_force_um=in_force{k}_um,
                    goal_before_um=goal{k}_um,
                    passed=passed,
                    total_um=total{k}_um,
                    deadband_um=deadband{k}_um,
                    rate_step_um=rate_step{k}_um,
                )
                goal{k}_um = fb_limit{k}.goal_um
                in_force{k}_um = fb_limit{k}.correction_um
                """
            )

    def say(self) -> None:
        """Write the outputs that are left."""
        self.add(
            """
            # Outputs.
            state = state_now
            """
        )
        for k, (stem, _) in self.outputs:
            self.add(f"correction_{stem} = in_force{k}_um\n")
