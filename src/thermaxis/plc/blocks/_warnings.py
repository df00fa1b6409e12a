"""What an export warns of: settings that are allowed, and that few people want."""

from collections.abc import Iterator

from thermaxis.compensation import Output
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.tree import noted, remark_text

LARGEST_CALM_STEP_UM = 10.0
"""A larger change in one call is warned of. Default: ten micrometres, which a finished surface
shows. [µm]"""
OPEN_INPUT_C = 0.0
"""What many input modules report of an input that is open. [degC]"""


def setting_warnings(settings: PlcSettings) -> tuple[str, ...]:
    """Return what is to be said of the settings of an export."""
    return (*_steps(settings), *_gains(settings), *_ranges(settings))


def never_corrects(output: Output) -> bool:
    """Return whether no temperature ever changes what an output says."""
    return not any(
        part.direct_gain_um_per_k or any(section.gain_um_per_k for section in part.sections)
        for part in output.parts
    )


def _steps(settings: PlcSettings) -> Iterator[str]:
    outputs = settings.compensation.model.outputs
    for output, step_um in zip(outputs, settings.steps_um, strict=True):
        if step_um > LARGEST_CALM_STEP_UM:
            yield (
                f"{remark_text(output.name)} may move by {noted(step_um)} um in one call, rate"
                " times cycle: a finished surface shows it. Take a shorter cycle or a smaller rate"
            )


def _gains(settings: PlcSettings) -> Iterator[str]:
    for output in settings.compensation.model.outputs:
        if never_corrects(output):
            yield f"{remark_text(output.name)} never corrects: all its gains are zero"


def _ranges(settings: PlcSettings) -> Iterator[str]:
    compensation = settings.compensation
    for channel, rules in zip(compensation.model.channels, compensation.rules, strict=True):
        if rules.lowest_c <= OPEN_INPUT_C <= rules.highest_c:
            yield (
                f"0.0 degC lies in the plausible range of {remark_text(channel)}: an open input"
                " that reads 0.0 is not told from a temperature by it. Wire ok_ to its diagnosis"
            )
