"""What an export warns of: settings that are allowed, and that few people want."""

from collections.abc import Iterator

from thermaxis.codes import Message
from thermaxis.compensation import STATED, Output
from thermaxis.plc._settings import PlcSettings

LARGEST_CALM_STEP_UM = 10.0
"""A larger change in one call is warned of. Default: ten micrometres, which a finished surface
shows. [µm]"""
OPEN_INPUT_C = 0.0
"""What many input modules report of an input that is open. [degC]"""
_TIMES_TO_REST = 3.0


def setting_warnings(settings: PlcSettings) -> tuple[Message, ...]:
    """Return what is to be said of the settings of an export."""
    return tuple(_warnings(settings))


def _warnings(settings: PlcSettings) -> Iterator[Message]:
    compensation = settings.compensation
    model = compensation.model
    for output, step_um in zip(model.outputs, settings.steps_um, strict=True):
        if step_um > LARGEST_CALM_STEP_UM:
            yield Message("warning-large_step", {"output": output.name, "step_um": step_um})
    for output in model.outputs:
        if _never_corrects(output):
            yield Message("warning-never_corrects", {"output": output.name})
    for channel, rules in zip(compensation.judged, compensation.rules, strict=True):
        if rules.lowest_c <= OPEN_INPUT_C <= rules.highest_c:
            yield Message("warning-open_input_plausible", {"channel": channel})


def restart_warning(settings: PlcSettings) -> Message | None:
    """Return what a restart of a warm machine does to a model that counts from its start."""
    model = settings.compensation.model
    if model.reference == STATED or all(map(_never_corrects, model.outputs)):
        return None
    parts = [part for output in model.outputs for part in output.parts]
    slowest_s = model.input_filter_s + max(
        [0.0, *(s.time_constant_s for part in parts for s in part.sections if s.gain_um_per_k)]
    )
    if slowest_s == 0.0:
        return Message("warning-restart_at_zero")
    hours = float(f"{_TIMES_TO_REST * slowest_s / 3600.0:.2g}")
    return Message("warning-restart_at_zero_lasts", {"hours": hours})


def _never_corrects(output: Output) -> bool:
    """Return whether no temperature ever changes what an output says."""
    return not any(
        part.direct_gain_um_per_k or any(section.gain_um_per_k for section in part.sections)
        for part in output.parts
    )
