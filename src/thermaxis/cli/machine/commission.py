"""Prove sign and size of an offset: move it out by a small step and back, at the allowed rate.

The motion is compared with what a gauge, a probe or touches show. Nothing moves before you have
said yes. The machine must be switched on, stand still, and touch nothing unless it is asked for a
touch; the loop must not run. What was asked, accepted and measured is recorded.
"""

import argparse
import asyncio
import json
import math
import sys
from collections.abc import Coroutine
from pathlib import Path
from statistics import median

from thermaxis import runtime
from thermaxis.cli._arguments import adder, refuse_alone
from thermaxis.cli.machine._machine_parts import MachineParts, build_parts, sole_runner
from thermaxis.cli.machine._signals import at_signals
from thermaxis.codes import Message, printable
from thermaxis.errors import ConfigurationError, DataError
from thermaxis.messages import sentence_of
from thermaxis.runtime.checks import DEFAULT_STEP_UM, Measure
from thermaxis.runtime.config import keep_touch_proof

STEP_PER_NOISE = 20.0
"""The step with touches is so many times their noise: the quarter of it that may lack is then 3.5
standard deviations of the difference of two. [1]"""
_READINGS, _FEWEST_READINGS = 9, 5
_ANSWERS_YES = {"yes", "y", "ja", "ano"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the command."""
    add = adder(parser)
    add("configuration MACHINE.toml", "the machine (TOML)", Path)
    add("--output NAME", "output to prove (default: the only one)")
    add(
        "--step UM",
        "size of the step in µm; negative goes towards the workpiece first (default: 10; with"
        " --touch 20 times the noise of a touch where that is more)",
        float,
    )
    add(
        "--probe NODE",
        "node of a probe that measures, in place of a person with a gauge (default: a person"
        " is asked for each reading)",
    )
    add(
        "--probe-unit",
        "unit of the probe; positive is away from the workpiece",
        choices=("um", "mm"),
        default="um",
    )
    add(
        "--touch",
        "the machine's own touches measure: run its probing cycle each time when told; what is"
        " proven lets touches act (acts, in [probe.NAME])",
        bool,
    )
    add("--yes", "do not ask: with a probe or touches only", bool)
    add("--json FILE", "write the record there as well", Path)


def run(arguments: argparse.Namespace) -> int:
    """Prove sign and size."""
    configuration = runtime.read_machine(arguments.configuration)
    limits = configuration.compensation.limits
    output = arguments.output or (next(iter(limits)) if len(limits) == 1 else "")
    if output not in limits:
        code, known = "unknown_name" if output else "output_unstated", ", ".join(limits)
        raise ConfigurationError(code, key="--output", name=output, known=known)
    if configuration.sink.kind == "dry":
        raise ConfigurationError(
            "dry_run_has_no_offset", file=arguments.configuration, key="sink.kind"
        )
    if not arguments.touch:
        refuse_alone(arguments, "--probe", "--yes")
    noise_um = _touch_noise_um(configuration, output) if arguments.touch else 0.0
    step_um = max(DEFAULT_STEP_UM, STEP_PER_NOISE * noise_um)
    rules = configuration.compensation.supervisor
    plan = runtime.CommissioningPlan(
        output=output,
        limits=limits[output],
        step_um=min(step_um, limits[output].largest_um)
        if arguments.step is None
        else arguments.step,
        tolerance_um=rules.read_back_tolerance_um,
        read_back_s=rules.read_back_s,
        noise_um=noise_um,
    )
    sys.stdout.write(_intention(configuration, plan))
    if not arguments.yes and not _asked("Shall the offset move now? Type yes: "):
        sys.stdout.write("Nothing was moved.\n")
        return 1
    with sole_runner(configuration):
        try:
            if arguments.touch:
                keep_touch_proof(configuration, output, proven=False)
            proof = asyncio.run(_until_a_signal(_prove(configuration, plan, arguments)))
            if arguments.touch:
                keep_touch_proof(configuration, output, proven=proof.passed)
        except asyncio.CancelledError:
            raise KeyboardInterrupt from None
    sys.stdout.write(_said(proof))
    if arguments.touch:
        sys.stdout.write(_said_of_touches(configuration, output, proven=proof.passed))
    if arguments.json is not None:
        arguments.json.write_text(
            json.dumps(_record(proof, touches=arguments.touch), indent=2) + "\n", encoding="utf-8"
        )
    return 0 if proof.passed else 1


def _intention(configuration: runtime.MachineConfiguration, plan: runtime.CommissioningPlan) -> str:
    output = configuration.outputs[plan.output]
    raw = plan.step_um * runtime.offset_factor(output.unit, output.sign)
    seconds = abs(plan.step_um) / plan.limits.largest_rate_um_per_s
    direction = "away from" if plan.step_um > 0.0 else "towards"
    return (
        f"{printable(configuration.name)}, output {plan.output}: the offset goes by"
        f" {plan.step_um:+g} um and comes back, {seconds:.0f} s each way.\n"
        f"The configuration says: {output.sign}; unit {output.unit}.\n"
        f"The node gets {raw:+g} {output.unit} more than it holds now.\n"
        f"So the tool must move {abs(plan.step_um):g} um {direction} the workpiece.\n"
    )


def _asked(question: str) -> bool:
    sys.stdout.write(question)
    sys.stdout.flush()
    return sys.stdin.readline().strip().casefold() in _ANSWERS_YES


async def _until_a_signal(
    proof: Coroutine[object, object, runtime.StepProof],
) -> runtime.StepProof:
    """Bring the offset back at a signal; a second one ends at once, but a terminal's none."""
    proving = asyncio.create_task(proof)
    with at_signals(proving.cancel, lambda: proving.cancelling() or proving.cancel()):
        return await proving


async def _prove(
    configuration: runtime.MachineConfiguration,
    plan: runtime.CommissioningPlan,
    arguments: argparse.Namespace,
) -> runtime.StepProof:
    clock = runtime.SystemClock()
    parts = build_parts(configuration, clock)
    ports = parts.ports
    await ports.historian.open(tuple(configuration.outputs))
    await ports.source.open()
    await ports.sink.open()
    try:
        await wait_for_machine(parts, configuration)
        looked = await runtime.self_test(
            configuration, parts.sessions, parts.sink, parts.probes, parts.pins
        )
        forbidden = runtime.reasons_against(looked)
        if forbidden:
            raise DataError("self_test_forbids", file=configuration.path, reasons=forbidden)
        measure = _probe(parts, configuration, arguments) if arguments.probe else _gauge
        if arguments.touch:
            rules = configuration.compensation
            measure = runtime.by_touches(ports.source, clock, rules, plan.output, _ask_for_a_touch)
        proof = await runtime.prove_step(ports.sink, clock, plan, measure)
        told = (
            "commission",
            "the command line",
            proof.verdict,
            _record(proof, touches=arguments.touch),
        )
        ports.historian.event(runtime.EventRecord.of(clock.utc(), *told))
        return proof
    finally:
        await ports.sink.close()
        await ports.source.close()
        await ports.historian.close(5.0)


async def wait_for_machine(
    parts: MachineParts, configuration: runtime.MachineConfiguration
) -> None:
    """Wait some seconds until the machine can be written to; else say why it cannot."""
    for _ in range(100):
        await parts.ports.source.read(0.2)
        await parts.sink.read_back(0.2)  # a token that stands there must be seen to be old
        if parts.sink.connected:
            return
        await asyncio.sleep(0.1)
    failures = (one.failure for one in (*parts.sessions.values(), parts.sink))
    causes = tuple(failure for failure in failures if failure is not None)
    raise DataError(
        "machine_not_reached",
        file=configuration.path,
        cause=causes or (Message("error-machine_silent"),),
    )


def _touch_noise_um(configuration: runtime.MachineConfiguration, output: str) -> float:
    """Return the standard deviation of a touch. [um]"""
    rules, probe = configuration.rules.touches.get(output), configuration.probes.get(output)
    if rules is None or probe is None or not probe.counter_node:
        raise ConfigurationError("touches_not_read", file=configuration.path, key=f"probe.{output}")
    return rules.noise_um


def _ask_for_a_touch(stands: Message) -> None:
    sys.stdout.write(f"Now {sentence_of(stands)}: run the probing cycle.\n")
    sys.stdout.flush()


async def _gauge(stands: Message) -> float:
    """Ask a person for the gauge's reading; the heartbeat goes on meanwhile."""
    while True:
        sys.stdout.write(
            f"Now {sentence_of(stands)}. Gauge in um, away from the workpiece positive: "
        )
        sys.stdout.flush()
        line = await asyncio.to_thread(sys.stdin.readline)
        if not line:
            raise DataError("no_gauge_reading")
        try:
            value = float(line.strip().replace(",", "."))
        except ValueError:
            value = math.nan
        if math.isfinite(value):
            return value
        sys.stdout.write("That is no number.\n")


def _probe(
    parts: MachineParts, configuration: runtime.MachineConfiguration, arguments: argparse.Namespace
) -> Measure:
    """Return what reads a probe: the median of some readings."""
    connection = configuration.sink.connection or configuration.source.connection
    asked = parts.pins or parts.sessions[connection]
    factor = 1.0 if arguments.probe_unit == "um" else 1e3

    async def measure(stands: Message) -> float:
        readings: list[float] = []
        for _ in range(_READINGS):
            found = await asked.describe(arguments.probe, 1.0)
            value = None if found is None else found.value
            if value is not None and math.isfinite(value):
                readings.append(factor * float(value))
            await asyncio.sleep(0.1)
        if len(readings) < _FEWEST_READINGS:
            raise DataError(
                "probe_not_measuring",
                key=arguments.probe,
                readings=len(readings),
                needed=_FEWEST_READINGS,
            )
        sys.stdout.write(f"Now {sentence_of(stands)}: the probe shows {median(readings):.2f} um.\n")
        return median(readings)

    return measure


def _record(proof: runtime.StepProof, *, touches: bool) -> dict[str, str | float | bool | None]:
    return {
        "output": proof.output,
        "asked_um": proof.asked_um,
        "found_um": proof.found_um,
        "accepted_um": proof.accepted_um,
        "effective_um": proof.effective_um,
        "measured_out_um": proof.out_um,
        "measured_back_um": proof.back_um,
        "touches": touches,
        "passed": proof.passed,
        "verdict": sentence_of(proof.verdict),
        "verdict_code": proof.verdict.code,
    }


def _said_of_touches(
    configuration: runtime.MachineConfiguration, output: str, *, proven: bool
) -> str:
    if not proven:
        return (
            f"Prove {output} with a gauge, without --touch, and change nothing before: is it proven"
            " so, then node, sign or unit of its probe is wrong.\n"
        )
    agree = "Touches and output agree; that the signs of both are wrong, a gauge alone shows.\n"
    if configuration.rules.touches[output].acts:
        return f"{agree}Touches are added to the correction from the next start of the loop on.\n"
    return f"{agree}Touches are shown only, until acts = true stands in [probe.{output}].\n"


def _said(proof: runtime.StepProof) -> str:
    accepted = "not read" if proof.accepted_um is None else f"{proof.accepted_um:.2f} um"
    effective = "not told" if proof.effective_um is None else f"{proof.effective_um:.2f} um"
    return (
        f"offset found {proof.found_um:.2f} um, accepted {accepted}, effective {effective}\n"
        f"{'PROVEN' if proof.passed else 'NOT PROVEN'}: {sentence_of(proof.verdict)}.\n"
    )
