"""The block of the model: `thermaxis.compensation.model_step` and the weights of the cycle."""

from dataclasses import dataclass, field
from math import expm1, isfinite
from typing import final

from thermaxis.compensation import STATED, Outcome, Part
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.blocks._draft import (
    NO,
    YES,
    Body,
    Draft,
    above,
    at_most,
    below,
    both,
    call,
    choose,
    either,
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
from thermaxis.plc.blocks._lag import LAG, delay_block, delay_name, gain_block
from thermaxis.plc.tree import (
    Block,
    Count,
    Expression,
    Kind,
    Name,
    OutputOf,
    Statement,
    noted,
    remark_text,
)

MODEL = "tx_model"
"""Name of the block."""
GOOD, HELD, BAD = Count(0), Count(1), Count(2)
"""Numbers of the model's quality."""

_OUTCOMES = list(Outcome)


def outcome_bit(outcome: Outcome) -> Count:
    """Return the number that an outcome adds to the word of outcomes."""
    return Count(2 ** _OUTCOMES.index(outcome))


@final
@dataclass(slots=True)
class ModelDraft:
    """The block of the model while it is written."""

    settings: PlcSettings
    """What is exported."""
    draft: Draft
    """Its variables."""
    zero: Name
    """Nothing."""
    one: Name
    """One."""
    value: list[Name] = field(default_factory=list)
    """Last good values by channel."""
    reference: list[Name] = field(default_factory=list)
    """References by channel."""
    raw: list[Name] = field(default_factory=list)
    """By input: before the filter."""
    acting: list[Name] = field(default_factory=list)
    """By input: as it acts until the next call."""
    delayed: dict[tuple[int, int], Name] = field(default_factory=dict)
    """By input and delay in cycles: the delayed input."""

    def acts(self, part: Part, wire: int) -> Name:
        """Return the input that acts on a part."""
        cycles = self.settings.delay_cycles(part)
        return self.delayed[wire, cycles] if cycles else self.acting[wire]


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
    return (*inner, _model_block(settings))


def _model_block(settings: PlcSettings) -> Block:
    draft = Draft(
        MODEL,
        "The thermal model: displacement of the tool point relative to the workpiece, positive",
        "away from it. Every section is advanced with the input since the last call, then the",
        "output is read with the present input. An input that fails keeps its last good value.",
        double=settings.double,
    )
    m = ModelDraft(settings, draft, Name("zero"), Name("one"))
    clock_ok = draft.input("clock_ok", "whether a cycle of the right length has passed", Kind.BOOL)
    diameter = draft.input("diameter_mm", "clamping diameter of the workpiece [mm]")
    known = draft.input("diameter_known", "whether it is stated", Kind.BOOL)
    draft.constant("zero", "nothing", 0.0)
    draft.constant("one", "one", 1.0)
    quality = draft.output("quality", "0 good, 1 an input is held, 2 bad", Kind.INT)
    started = draft.output("started", "whether the model started in this call", Kind.BOOL)
    waiting = draft.output("waiting", "whether it waits for the first good values", Kind.BOOL)
    word = draft.output("outcome_word", "what was out of the ordinary, see the head", Kind.INT)
    runs = draft.state("runs", "whether the model has started", Kind.BOOL)
    failed = draft.temporary("failed", "whether an input failed for too long", Kind.BOOL)
    some_held = draft.temporary("held", "whether an input failed", Kind.BOOL)
    outside = draft.temporary("outside", "whether an input is outside its training", Kind.BOOL)
    beyond = draft.temporary("diameter_held", "whether a gain is held at its end", Kind.BOOL)
    present = _present(m, failed, some_held)
    starts = _starts(m)
    raw_now, inputs = _inputs(m, outside)
    advanced = _advanced(m, started, raw_now)
    contributions = _contributions(m, diameter, known, beyond)
    silent = tuple(
        let(Name(name), m.zero)
        for name in (
            *(f"part_{stem}" for stem in settings.names.parts),
            *(f"model_{stem}" for stem in settings.names.outputs),
        )
    )
    return draft.block(
        let(started, NO),
        let(waiting, NO),
        let(failed, NO),
        let(some_held, NO),
        let(outside, NO),
        let(beyond, NO),
        when(
            clock_ok,
            *present,
            choose(
                (both(no(runs), failed), (let(waiting, YES),)),
                otherwise=(
                    when(no(runs), let(started, YES), let(runs, YES), *starts),
                    *inputs,
                    *advanced,
                ),
            ),
        ),
        choose((runs, contributions), otherwise=silent),
        *_weights(m, outside),
        choose(
            (either(no(clock_ok), failed), (let(quality, BAD),)),
            (some_held, (let(quality, HELD),)),
            otherwise=(let(quality, GOOD),),
        ),
        let(word, Count(0)),
        _add(word, started, Outcome.STARTED),
        _add(word, waiting, Outcome.WAITING),
        _add(word, no(clock_ok), Outcome.CLOCK_UNUSABLE),
        _add(word, both(some_held, no(failed)), Outcome.INPUT_HELD),
        _add(word, failed, Outcome.INPUT_FAILED),
        _add(word, beyond, Outcome.DIAMETER_HELD),
        _add(word, outside, Outcome.OUTSIDE_VALIDITY),
    )


def _add(word: Name, condition: Expression, outcome: Outcome) -> Statement:
    return when(condition, let(word, plus(word, outcome_bit(outcome))))


# ---- inputs -------------------------------------------------------------------------------------


def _present(m: ModelDraft, failed: Name, some_held: Name) -> Body:
    """Take what was read; let the last good value stand for what was not."""
    draft, settings = m.draft, m.settings
    model = settings.compensation.model
    longest = draft.constant(
        "longest_hold_s", "an input that fails is held so long [s]", model.longest_hold_s
    )
    cycle_s = draft.constant("cycle_s", "time from call to call [s]", settings.cycle_s)
    body: list[Statement] = [note("What was read. What failed keeps its last good value.")]
    for k, channel in enumerate(model.channels, 1):
        text = remark_text(channel)
        read = draft.input(f"value{k}_c", f"{text}: what was read [degC]")
        usable = draft.input(f"usable{k}", f"{text}: whether it may be used", Kind.BOOL)
        value = draft.state(f"good{k}_c", f"{text}: last good value [degC]")
        known = draft.state(f"known{k}", f"{text}: whether there is one", Kind.BOOL)
        age = draft.state(f"age{k}_s", f"{text}: its age, counted to the limit [s]")
        m.value.append(value)
        body.append(
            choose(
                (usable, (let(value, read), let(known, YES), let(age, m.zero))),
                otherwise=(
                    let(some_held, YES),
                    when(at_most(age, longest), let(age, plus(age, cycle_s))),
                    when(either(no(known), above(age, longest)), let(failed, YES)),
                ),
            )
        )
    return tuple(body)


def _starts(m: ModelDraft) -> Body:
    """Declare the references; where the model refers to its start, take them."""
    model = m.settings.compensation.model
    body: list[Statement] = []
    for k, (channel, value) in enumerate(zip(model.channels, m.value, strict=True), 1):
        text = f"{remark_text(channel)}: reference [degC]"
        if model.reference == STATED:
            constant = m.draft.constant(f"reference{k}_c", text, model.reference_c[channel])
            m.reference.append(constant)
        else:
            state = m.draft.state(f"reference{k}_c", text)
            m.reference.append(state)
            body.append(let(state, value))
    return tuple(body)


def _inputs(m: ModelDraft, outside: Name) -> tuple[list[Name], Body]:
    """Return every input relative to its reference, and the statements that compute it."""
    layout, draft = m.settings.compensation.model.layout, m.draft
    filtered = m.settings.compensation.model.input_filter_s > 0.0
    channels = [remark_text(c) for c in m.settings.compensation.model.channels]
    other = Name("other_k")
    if any(second >= 0 for _, second in layout.wires):
        draft.temporary(other.name, "the temperature that is subtracted [K]")
    now: list[Name] = []
    body: list[Statement] = [note("Inputs of the model, relative to their references.")]
    for n, ((first, second), (lowest, highest)) in enumerate(
        zip(layout.wires, layout.ranges, strict=True), 1
    ):
        text = channels[first] + (f" - {channels[second]}" if second >= 0 else "")
        new = draft.temporary(f"new{n}_k", f"{text}, in this call [K]")
        m.raw.append(draft.state(f"input{n}_k", f"{text}, in the last call [K]"))
        m.acting.append(
            draft.state(f"acting{n}_k", f"{text}, filtered [K]") if filtered else m.raw[-1]
        )
        now.append(new)
        body.append(let(new, less(m.value[first], m.reference[first])))
        if second >= 0:
            body.append(let(other, less(m.value[second], m.reference[second])))
            body.append(let(new, less(new, other)))
        limits = _range(draft, f"{n}", text, lowest, highest)
        if limits is not None:
            body.append(when(no(within(new, *limits)), let(outside, YES)))
    return now, tuple(body)


def _range(
    draft: Draft, name: str, text: str, lowest: float, highest: float
) -> tuple[Name, Name] | None:
    """Declare a range of training; None where none is known."""
    if not isfinite(lowest) or not isfinite(highest):
        return None
    return (
        draft.constant(f"lowest{name}_k", f"{text}: lowest in training [K]", lowest),
        draft.constant(f"highest{name}_k", f"{text}: highest in training [K]", highest),
    )


# ---- sections -----------------------------------------------------------------------------------


def _advanced(m: ModelDraft, started: Name, now: list[Name]) -> Body:
    """Advance sections, filter and delays by a cycle, or start them."""
    settings, draft = m.settings, m.draft
    model = settings.compensation.model
    layout, cycle_s = model.layout, settings.cycle_s
    body: list[Statement] = []
    for k in layout.delayed:
        part, wire = layout.parts[k], layout.driven[k]
        cycles = settings.delay_cycles(part)
        if cycles and (wire, cycles) not in m.delayed:
            n = len(m.delayed) + 1
            m.delayed[wire, cycles] = draft.state(f"late{n}_k", f"input {wire + 1}, delayed [K]")
    for i, (tau_s, wire, owner) in enumerate(
        zip(layout.taus_s, layout.drives, layout.owners, strict=True), 1
    ):
        part = layout.parts[owner]
        alpha = draft.constant(
            f"alpha{i}",
            f"section {i}, time constant {noted(tau_s)} s: share of a cycle [1]",
            -expm1(-cycle_s / tau_s),
        )
        lag = draft.instance(f"lag{i}", LAG)
        body.append(
            call(
                lag,
                u_k=m.acts(part, wire),
                alpha=alpha,
                start=started,
                start_k=now[wire] if model.reference == STATED else m.zero,
            )
        )
    if body:
        rest = "in the steady state" if model.reference == STATED else "at rest"
        body.insert(0, note(f"Sections, with the inputs since the last call, at the start {rest}."))
    body.extend(_filtered(m, started, now))
    for n, ((wire, cycles), late) in enumerate(m.delayed.items(), 1):
        delay = draft.instance(f"delay{n}", delay_name(cycles))
        body.append(call(delay, u_k=m.acting[wire], start=started))
        body.append(let(late, OutputOf(delay, "y_k")))
    return tuple(body)


def _filtered(m: ModelDraft, started: Name, now: list[Name]) -> Body:
    """Keep the inputs for the next call, behind their filter where there is one."""
    filter_s = m.settings.compensation.model.input_filter_s
    body: list[Statement] = [note("The inputs act until the next call.")]
    if filter_s > 0.0:
        alpha = m.draft.constant(
            "filter_alpha",
            f"filter of the inputs, {noted(filter_s)} s: share of a cycle [1]",
            -expm1(-m.settings.cycle_s / filter_s),
        )
        for n, (new, raw, acting) in enumerate(zip(now, m.raw, m.acting, strict=True), 1):
            lag = m.draft.instance(f"filter{n}", LAG)
            body.append(call(lag, u_k=raw, alpha=alpha, start=started, start_k=new))
            body.append(let(acting, OutputOf(lag, "x_k")))
    body.extend(let(raw, new) for new, raw in zip(now, m.raw, strict=True))
    return tuple(body)


# ---- output -------------------------------------------------------------------------------------


def _contributions(m: ModelDraft, diameter: Name, known: Name, beyond: Name) -> Body:
    """Read the output: gains times inputs and sections, part by part, added in their order."""
    settings, draft = m.settings, m.draft
    model, names = settings.compensation.model, settings.names
    layout = model.layout
    term = Name("term_um")
    if any(_terms(part) > 1 for part in layout.parts):
        draft.temporary(term.name, "one term of a part [um]")
    body: list[Statement] = []
    said: list[Name] = []
    gained = {k: n for n, k in enumerate(layout.gained, 1)}
    for k, part in enumerate(layout.parts):
        text = remark_text(part.name)
        out = draft.output(f"part_{names.parts[k]}", f"what {text} contributes [um]")
        said.append(out)
        body.append(note(f"Part {text}."))
        body.extend(_part(m, k, out, term))
        if k in gained:
            gain = draft.instance(f"gain{gained[k]}", f"tx_gain_{gained[k]}")
            body.append(call(gain, diameter_mm=diameter, known=known))
            body.append(let(out, times(out, OutputOf(gain, "gain"))))
            body.append(when(OutputOf(gain, "held"), let(beyond, YES)))
    total = draft.temporary("sum_um", "sum of the parts [um]")
    for k, (output, (first, behind, offset_um)) in enumerate(
        zip(model.outputs, layout.spans, strict=True)
    ):
        text = remark_text(output.name)
        out = draft.output(f"model_{names.outputs[k]}", f"{text}: displacement [um]")
        offset = draft.constant(f"offset{k + 1}_um", f"{text}: offset [um]", offset_um)
        body.append(note(f"Output {text}: its parts, one after the other, and its offset."))
        body.append(let(total, said[first]))
        body.extend(let(total, plus(total, part)) for part in said[first + 1 : behind])
        body.append(let(out, plus(offset, total)))
    return tuple(body)


def _is_direct(part: Part) -> bool:
    """Whether the direct term is written: a gain of zero beside sections adds nothing."""
    return part.direct_gain_um_per_k != 0.0 or not part.sections


def _terms(part: Part) -> int:
    return len(part.sections) + _is_direct(part)


def _part(m: ModelDraft, k: int, out: Name, term: Name) -> Body:
    """Compute what a part contributes, before its gain by diameter."""
    layout, draft = m.settings.compensation.model.layout, m.draft
    part = layout.parts[k]
    body: list[Statement] = []
    if _is_direct(part):
        direct = draft.constant(
            f"direct{k + 1}_um_per_k", "direct gain [um/K]", part.direct_gain_um_per_k
        )
        body.append(let(out, times(direct, m.acts(part, layout.driven[k]))))
    for i, owner in enumerate(layout.owners, 1):
        if owner != k:
            continue
        section = draft.constant(
            f"gain{i}_um_per_k",
            f"gain of section {i} [um/K]",
            part.sections[i - 1 - layout.owners.index(k)].gain_um_per_k,
        )
        state = OutputOf(f"lag{i}", "x_k")
        if body:
            body += [let(term, times(section, state)), let(out, plus(out, term))]
        else:
            body.append(let(out, times(section, state)))
    return tuple(body)


def _weights(m: ModelDraft, outside: Name) -> Body:
    """Let an output lose its weight outside the range of its training logs."""
    compensation, draft, names = m.settings.compensation, m.draft, m.settings.names
    layout = compensation.model.layout
    weights = [
        draft.output(f"weight_{stem}", f"{remark_text(output.name)}: weight [1]", start=1.0)
        for stem, output in zip(names.outputs, compensation.model.outputs, strict=True)
    ]
    full: Body = tuple(let(weight, m.one) for weight in weights)
    ranges = {k: _part_range(m, k) for k, part in enumerate(layout.parts) if _is_ranged(part)}
    if not ranges:
        return full
    farthest = draft.temporary("farthest_k", "how far an input is outside its training [K]")
    distance = draft.temporary("distance_k", "the same of one input [K]")
    margin = draft.constant(
        "margin_k", "no weight is left so far outside [K]", compensation.validity_margin_k
    )
    lowest = draft.constant(
        "lowest_weight", "weight that is left far outside [1]", compensation.lowest_weight
    )
    body: list[Statement] = []
    for weight, (first, behind, _) in zip(weights, layout.spans, strict=True):
        body.append(let(farthest, m.zero))
        for raw, low, high in [ranges[k] for k in range(first, behind) if k in ranges]:
            for difference in (less(low, raw), less(raw, high)):
                body.append(let(distance, difference))
                body.append(when(above(distance, farthest), let(farthest, distance)))
        body.append(let(distance, over(farthest, margin)))
        body.append(let(weight, less(m.one, distance)))
        body.append(when(below(weight, lowest), let(weight, lowest)))
    remark = note("Outside the range of its training logs an output loses its weight.")
    return (remark, choose((outside, tuple(body)), otherwise=full))


def _is_ranged(part: Part) -> bool:
    return part.lowest_k is not None and part.highest_k is not None


def _part_range(m: ModelDraft, k: int) -> tuple[Name, Name, Name]:
    """Return the input of a part before its filter, and its range of training."""
    layout = m.settings.compensation.model.layout
    part = layout.parts[k]
    text, (lowest_k, highest_k) = remark_text(part.name), (part.lowest_k, part.highest_k)
    low = m.draft.constant(f"low{k + 1}_k", f"{text}: lowest in training [K]", lowest_k or 0.0)
    high = m.draft.constant(f"high{k + 1}_k", f"{text}: highest in training [K]", highest_k or 0.0)
    return m.raw[layout.driven[k]], low, high
