"""What is told of a cycle: the status for everybody, and its record for the history."""

from collections.abc import Iterator, Mapping
from typing import Any

from thermaxis.codes import Message
from thermaxis.compensation import Compensation, CycleOutput, CycleState, Memory
from thermaxis.runtime._offsets import Found
from thermaxis.runtime._ports import Applied, CycleRecord
from thermaxis.runtime.loop._settings import LoopSettings
from thermaxis.runtime.status import RuntimeStatus, facts_of


def status_of(
    compensation: Compensation,
    settings: LoopSettings,
    state: CycleState,
    output: CycleOutput,
    **seen: Any,
) -> RuntimeStatus:
    """Return the status of a cycle, by what the loop has seen of the world beside it."""
    channels = compensation.model.channels
    names = tuple(one.name for one in compensation.model.outputs)
    return RuntimeStatus(
        machine=settings.machine,
        cycle_s=compensation.cycle_s,
        enabled=state.memory.enabled,
        output=output,
        outputs=names,
        channels=channels,
        model_file=settings.model_file,
        model_sha256=settings.model_sha256,
        diameter_mm=state.diameter_mm,
        reference_c=dict(zip(channels, state.thermal.reference, strict=False)),
        held_s=state.memory.held_s,
        active_in_s=_active_in_s(compensation, state.memory),
        trim_owner={name: trim.who for name, trim in zip(names, state.trims, strict=True)},
        trim_left_s={name: trim.left_s for name, trim in zip(names, state.trims, strict=True)},
        facts=facts_of(compensation),
        configuration_sha256=settings.configuration_sha256,
        **seen,
    )


def differing(
    compensation: Compensation, memory: Memory, found: Found, output: CycleOutput
) -> Iterator[str]:
    """Yield the outputs that are not read back as they were written."""
    if not memory.differs_s:
        return
    nothing = (None,) * len(output.before_um)
    rows = (found.found_um or nothing, found.read_back_um or nothing, output.before_um)
    tolerance_um = compensation.supervisor.read_back_tolerance_um
    for of, anew_um, said_um, um in zip(compensation.model.outputs, *rows, strict=True):
        if anew_um is None and (said_um is None or abs(said_um - um) > tolerance_um):
            yield of.name


def _active_in_s(compensation: Compensation, memory: Memory) -> float:
    """Return the time after which the compensation is active if nothing else blocks. [s]"""
    rules = compensation.supervisor
    return max(rules.settle_s - memory.running_s, rules.recovery_delay_s - memory.ready_s, 0.0)


def record_of(
    status: RuntimeStatus,
    monotonic_s: float,
    applied: Mapping[str, Applied],
    touched: Mapping[str, str],
) -> CycleRecord:
    """Return what is recorded of a cycle."""
    return CycleRecord(
        status.number,
        status.utc,
        monotonic_s,
        status.samples,
        status.output,
        applied,
        status.lateness_s,
        status.channels,
        tuple(status.facts[name].parts for name in status.outputs),
        status.diameter_mm,
        _code_of(status.source_reason),
        _code_of(status.sink_reason),
        touched,
    )


def _code_of(message: Message | None) -> str:
    return "" if message is None else message.code
