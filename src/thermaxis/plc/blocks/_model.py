"""The block of the model: `thermaxis.compensation.model_step` and the weights of the cycle."""

from math import expm1, isfinite
from textwrap import dedent, indent
from typing import final

from thermaxis.compensation import STATED, Part
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.blocks._draft import Body, Draft, statements
from thermaxis.plc.blocks._lag import LAG, delay_block, delay_name, gain_block
from thermaxis.plc.tree import Block, Kind, noted, remark_text

MODEL = "tx_model"
"""Name of the block."""


def model_blocks(settings: PlcSettings) -> tuple[Block, ...]:
    """Return the block of the model, behind those of its delays and gains.

    Not protected: the model is neither limited nor ramped here.
    """
    layout, double = settings.compensation.model.layout, settings.double
    lengths = sorted({settings.delay_cycles(layout.parts[k]) for k in layout.delayed} - {0})
    inner = [delay_block(cycles, double=double) for cycles in lengths]
    inner += [
        gain_block(f"tx_gain_{n}", layout.parts[k], double=double)
        for n, k in enumerate(layout.gained, 1)
    ]
    return (*inner, _ModelDraft(settings).block())


@final
class _ModelDraft:
    """The block of the model while it is written."""

    def __init__(self, settings: PlcSettings) -> None:
        self.settings = settings
        self.model = settings.compensation.model
        self.layout = self.model.layout
        self.channels = [remark_text(channel) for channel in self.model.channels]
        self.draft = Draft(
            MODEL,
            "The thermal model: displacement of the tool point relative to the workpiece, positive",
            "away from it. Every section is advanced with the input since the last call, then the",
            "output is read with the present input. An input that fails keeps its last good value.",
            double=settings.double,
        )
        self.filtered = self.model.input_filter_s > 0.0
        self.delayed: dict[tuple[int, int], str] = {}
        """By input and delay in cycles: the delayed input."""

    def acts(self, part: Part, wire: int) -> str:
        """Return the input that acts on a part until the next call."""
        cycles = self.settings.delay_cycles(part)
        name = "acting" if self.filtered else "input"
        return self.delayed[wire, cycles] if cycles else f"{name}{wire + 1}_k"

    def alpha(self, tau_s: float) -> float:
        """Return the share of a cycle of a first-order lag. [1]"""
        return -expm1(-self.settings.cycle_s / tau_s)

    def block(self) -> Block:
        """Return the block."""
        draft = self.draft
        draft.input("clock_ok", "whether a cycle of the right length has passed", Kind.BOOL)
        draft.input("diameter_mm", "clamping diameter of the workpiece [mm]")
        draft.input("diameter_known", "whether it is stated", Kind.BOOL)
        draft.constant("zero", "nothing", 0.0)
        draft.constant("one", "one", 1.0)
        draft.output("quality", "0 good, 1 an input is held, 2 bad", Kind.INT)
        draft.output("started", "whether the model started in this call", Kind.BOOL)
        draft.output("waiting", "whether it waits for the first good values", Kind.BOOL)
        draft.output("outcome_word", "what was out of the ordinary, see the head", Kind.INT)
        draft.state("runs", "whether the model has started", Kind.BOOL)
        draft.temporary("failed", "whether an input failed for too long", Kind.BOOL)
        draft.temporary("held", "whether an input failed", Kind.BOOL)
        draft.temporary("outside", "whether an input is outside its training", Kind.BOOL)
        draft.temporary("diameter_held", "whether a gain is held at its end", Kind.BOOL)
        names = self.settings.names
        said = [f"part_{stem}" for stem in names.parts] + [f"model_{s}" for s in names.outputs]
        return draft.block(
            """
            started = False
            waiting = False
            failed = False
            held = False
            outside = False
            diameter_held = False
            if clock_ok:
                present
                if not runs and failed:
                    waiting = True
                else:
                    if not runs:
                        started = True
                        runs = True
                        starts
                    inputs
                    advanced
            if runs:
                contributions
            else:
                silent
            weights
            if not clock_ok or failed:
                quality = Quality.BAD
            elif held:
                quality = Quality.HELD
            else:
                quality = Quality.GOOD
            outcome_word = 0
            if started:
                outcome_word += Outcome.STARTED
            if waiting:
                outcome_word += Outcome.WAITING
            if not clock_ok:
                outcome_word += Outcome.CLOCK_UNUSABLE
            if held and not failed:
                outcome_word += Outcome.INPUT_HELD
            if failed:
                outcome_word += Outcome.INPUT_FAILED
            if diameter_held:
                outcome_word += Outcome.DIAMETER_HELD
            if outside:
                outcome_word += Outcome.OUTSIDE_VALIDITY
            """,
            present=self.present(),
            starts=self.starts(),
            inputs=self.inputs(),
            advanced=self.advanced(),
            contributions=self.contributions(),
            silent=statements("".join(f"{name} = zero\n" for name in said)),
            weights=self.weights(),
        )

    # ---- inputs ---------------------------------------------------------------------------------

    def present(self) -> Body:
        """Take what was read; let the last good value stand for what was not."""
        draft = self.draft
        draft.constant(
            "longest_hold_s", "an input that fails is held so long [s]", self.model.longest_hold_s
        )
        draft.constant("cycle_s", "time from call to call [s]", self.settings.cycle_s)
        code = "# What was read. What failed keeps its last good value.\n"
        for k, text in enumerate(self.channels, 1):
            draft.input(f"value{k}_c", f"{text}: what was read [degC]")
            draft.input(f"usable{k}", f"{text}: whether it may be used", Kind.BOOL)
            draft.state(f"good{k}_c", f"{text}: last good value [degC]")
            draft.state(f"known{k}", f"{text}: whether there is one", Kind.BOOL)
            draft.state(f"age{k}_s", f"{text}: its age, counted to the limit [s]")
            code += dedent(
                f"""\
                if usable{k}:
                    good{k}_c = value{k}_c
                    known{k} = True
                    age{k}_s = zero
                else:
                    held = True
                    if age{k}_s <= longest_hold_s:
                        age{k}_s += cycle_s
                    if not known{k} or age{k}_s > longest_hold_s:
                        failed = True
                """
            )
        return statements(code)

    def starts(self) -> Body:
        """Declare the references; where the model refers to its start, take them."""
        code = ""
        for k, (channel, name) in enumerate(
            zip(self.model.channels, self.channels, strict=True), 1
        ):
            text = f"{name}: reference [degC]"
            if self.model.reference == STATED:
                self.draft.constant(f"reference{k}_c", text, self.model.reference_c[channel])
            else:
                self.draft.state(f"reference{k}_c", text)
                code += f"reference{k}_c = good{k}_c\n"
        return statements(code)

    def inputs(self) -> Body:
        """Compute every input relative to its reference."""
        draft = self.draft
        if any(second >= 0 for _, second in self.layout.wires):
            draft.temporary("other_k", "the temperature that is subtracted [K]")
        code = "# Inputs of the model, relative to their references.\n"
        for n, ((first, second), (lowest, highest)) in enumerate(
            zip(self.layout.wires, self.layout.ranges, strict=True), 1
        ):
            text = self.channels[first] + (f" - {self.channels[second]}" if second >= 0 else "")
            draft.temporary(f"new{n}_k", f"{text}, in this call [K]")
            draft.state(f"input{n}_k", f"{text}, in the last call [K]")
            if self.filtered:
                draft.state(f"acting{n}_k", f"{text}, filtered [K]")
            code += f"new{n}_k = good{first + 1}_c - reference{first + 1}_c\n"
            if second >= 0:
                code += f"other_k = good{second + 1}_c - reference{second + 1}_c\n"
                code += f"new{n}_k -= other_k\n"
            if isfinite(lowest) and isfinite(highest):
                draft.constant(f"lowest{n}_k", f"{text}: lowest in training [K]", lowest)
                draft.constant(f"highest{n}_k", f"{text}: highest in training [K]", highest)
                code += f"if not lowest{n}_k <= new{n}_k <= highest{n}_k:\n    outside = True\n"
        return statements(code)

    # ---- sections -------------------------------------------------------------------------------

    def advanced(self) -> Body:
        """Advance sections, filter and delays by a cycle, or start them."""
        draft, layout = self.draft, self.layout
        for k in layout.delayed:
            wire, cycles = layout.driven[k], self.settings.delay_cycles(layout.parts[k])
            if cycles and (wire, cycles) not in self.delayed:
                name = f"late{len(self.delayed) + 1}_k"
                self.delayed[wire, cycles] = draft.state(name, f"input {wire + 1}, delayed [K]")
        stated = self.model.reference == STATED
        code = ""
        if layout.taus_s:
            rest = "in the steady state" if stated else "at rest"
            code += f"# Sections, with the inputs since the last call, at the start {rest}.\n"
        for i, (tau_s, wire, owner) in enumerate(
            zip(layout.taus_s, layout.drives, layout.owners, strict=True), 1
        ):
            text = f"section {i}, time constant {noted(tau_s)} s: share of a cycle [1]"
            draft.constant(f"alpha{i}", text, self.alpha(tau_s))
            draft.instance(f"lag{i}", LAG)
            acts = self.acts(layout.parts[owner], wire)
            start = f"new{wire + 1}_k" if stated else "zero"
            code += f"lag{i}(u_k={acts}, alpha=alpha{i}, start=started, start_k={start})\n"
        code += self.filter()
        for n, ((wire, cycles), late) in enumerate(self.delayed.items(), 1):
            draft.instance(f"delay{n}", delay_name(cycles))
            acting = "acting" if self.filtered else "input"
            code += f"delay{n}(u_k={acting}{wire + 1}_k, start=started)\n{late} = delay{n}.y_k\n"
        return statements(code)

    def filter(self) -> str:
        """Keep the inputs for the next call, behind their filter where there is one."""
        filter_s, numbers = self.model.input_filter_s, range(1, len(self.layout.wires) + 1)
        code = "# The inputs act until the next call.\n"
        if self.filtered:
            text = f"filter of the inputs, {noted(filter_s)} s: share of a cycle [1]"
            self.draft.constant("filter_alpha", text, self.alpha(filter_s))
            for n in numbers:
                self.draft.instance(f"filter{n}", LAG)
                code += f"filter{n}(u_k=input{n}_k, alpha=filter_alpha, start=started,"
                code += f" start_k=new{n}_k)\nacting{n}_k = filter{n}.x_k\n"
        return code + "".join(f"input{n}_k = new{n}_k\n" for n in numbers)

    # ---- output ---------------------------------------------------------------------------------

    def contributions(self) -> Body:
        """Read the output: gains times inputs and sections, part by part, added in their order."""
        draft, layout, names = self.draft, self.layout, self.settings.names
        if any(len(part.sections) + _is_direct(part) > 1 for part in layout.parts):
            draft.temporary("term_um", "one term of a part [um]")
        code = ""
        gained = {k: n for n, k in enumerate(layout.gained, 1)}
        outs = [f"part_{stem}" for stem in names.parts]
        for k, (part, out) in enumerate(zip(layout.parts, outs, strict=True)):
            text = remark_text(part.name)
            draft.output(out, f"what {text} contributes [um]")
            code += f"# Part {text}.\n{self.part(k, out)}"
            if k in gained:
                gain = draft.instance(f"gain{gained[k]}", f"tx_gain_{gained[k]}")
                code += f"{gain}(diameter_mm=diameter_mm, known=diameter_known)\n"
                code += f"{out} *= {gain}.gain\nif {gain}.held:\n    diameter_held = True\n"
        draft.temporary("sum_um", "sum of the parts [um]")
        for k, (output, (first, behind, offset_um)) in enumerate(
            zip(self.model.outputs, layout.spans, strict=True), 1
        ):
            text = remark_text(output.name)
            out = draft.output(f"model_{names.outputs[k - 1]}", f"{text}: displacement [um]")
            draft.constant(f"offset{k}_um", f"{text}: offset [um]", offset_um)
            code += f"# Output {text}: its parts, one after the other, and its offset.\n"
            code += f"sum_um = {outs[first]}\n"
            code += "".join(f"sum_um += {part}\n" for part in outs[first + 1 : behind])
            code += f"{out} = offset{k}_um + sum_um\n"
        return statements(code)

    def part(self, k: int, out: str) -> str:
        """Compute what a part contributes, before its gain by diameter."""
        part, owners = self.layout.parts[k], self.layout.owners
        terms: list[str] = []
        if _is_direct(part):
            gain = self.draft.constant(
                f"direct{k + 1}_um_per_k", "direct gain [um/K]", part.direct_gain_um_per_k
            )
            terms.append(f"{gain} * {self.acts(part, self.layout.driven[k])}")
        own = [i for i, owner in enumerate(owners, 1) if owner == k]
        for i, section in zip(own, part.sections, strict=True):
            gain = self.draft.constant(
                f"gain{i}_um_per_k", f"gain of section {i} [um/K]", section.gain_um_per_k
            )
            terms.append(f"{gain} * lag{i}.x_k")
        more = "".join(f"term_um = {term}\n{out} += term_um\n" for term in terms[1:])
        return f"{out} = {terms[0]}\n{more}"

    def weights(self) -> Body:
        """Let an output lose its weight outside the range of its training logs."""
        compensation, draft, layout = self.settings.compensation, self.draft, self.layout
        weights = [
            draft.output(f"weight_{stem}", f"{remark_text(output.name)}: weight [1]", start=1.0)
            for stem, output in zip(self.settings.names.outputs, self.model.outputs, strict=True)
        ]
        full = "".join(f"{weight} = one\n" for weight in weights)
        ranged = [
            k
            for k, part in enumerate(layout.parts)
            if part.lowest_k is not None and part.highest_k is not None
        ]
        for k in ranged:
            part = layout.parts[k]
            for end, value in (("lowest", part.lowest_k), ("highest", part.highest_k)):
                text = f"{remark_text(part.name)}: {end} in training [K]"
                draft.constant(f"{end.removesuffix('est')}{k + 1}_k", text, value or 0.0)
        if not ranged:
            return statements(full)
        draft.temporary("farthest_k", "how far an input is outside its training [K]")
        draft.temporary("distance_k", "the same of one input [K]")
        draft.constant(
            "margin_k", "no weight is left so far outside [K]", compensation.validity_margin_k
        )
        draft.constant(
            "lowest_weight", "weight that is left far outside [1]", compensation.lowest_weight
        )
        body = ""
        for weight, (first, behind, _) in zip(weights, layout.spans, strict=True):
            body += "farthest_k = zero\n"
            for k in (k for k in ranged if first <= k < behind):
                value = f"input{layout.driven[k] + 1}_k"
                for difference in (f"low{k + 1}_k - {value}", f"{value} - high{k + 1}_k"):
                    body += f"distance_k = {difference}\nif distance_k > farthest_k:\n"
                    body += "    farthest_k = distance_k\n"
            body += f"distance_k = farthest_k / margin_k\n{weight} = one - distance_k\n"
            body += f"if {weight} < lowest_weight:\n    {weight} = lowest_weight\n"
        return statements(
            "# Outside the range of its training logs an output loses its weight.\n"
            f"if outside:\n{indent(body, '    ')}else:\n{indent(full, '    ')}"
        )


def _is_direct(part: Part) -> bool:
    """Whether the direct term is written: a gain of zero beside sections adds nothing."""
    return part.direct_gain_um_per_k != 0.0 or not part.sections
