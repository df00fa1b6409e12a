"""Inputs and outputs of the exported block, by which the program, its vectors and tests know it."""

from collections.abc import Iterator
from enum import Enum
from typing import NamedTuple, final

from thermaxis.compensation import Outcome, Quality, SampleQuality, SupervisorState
from thermaxis.plc._library import LIBRARY_VERSION
from thermaxis.plc._line import LineSettings
from thermaxis.plc._names import remark_text
from thermaxis.plc._settings import PlcSettings

IDENTITY_DIGITS = 3
"""Hexadecimal digits of the model's hash in one number that every control holds. [1]"""

NEVER_OUTCOMES = frozenset(
    {
        Outcome.CLOCK_BACKWARD,
        Outcome.CLOCK_STILL,
        Outcome.STATE_UNUSABLE,
        Outcome.DIAMETER_UNKNOWN,
    }
)
"""Outcomes that a block never has, whose clock is the time since the last call."""
NEVER_QUALITIES = frozenset(
    {
        SampleQuality.REDUNDANT,
        SampleQuality.OLD,
        SampleQuality.NO_TIME_STAMP,
        SampleQuality.DISAGREES,
    }
)
"""Qualities of what a block has not: redundant sensors and time stamps."""


class Kind(Enum):
    """Kind of a variable."""

    NUMBER = "number"
    """LREAL or REAL, one for the whole program."""
    BOOL = "BOOL"
    INT = "INT"


@final
class Variable(NamedTuple):
    """An input or output of the block."""

    name: str
    """Lower case, at most 24 signs."""
    kind: Kind
    """Its kind."""
    text: str
    """What it means, for the remark beside it."""
    unit: str = ""
    """Unit of a number."""
    start: float = 0.0
    """Value before the first call."""

    @property
    def remark(self) -> str:
        """What stands beside it: text and unit."""
        return f"{self.text} [{self.unit}]" if self.unit else self.text


@final
class Interface(NamedTuple):
    """Inputs and outputs of a block, in their order."""

    inputs: tuple[Variable, ...]
    """What a caller states in every call."""
    outputs: tuple[Variable, ...]
    """What a caller may read."""
    identity: tuple[Variable, ...]
    """Outputs that never change: library and model."""


def interface_of(settings: PlcSettings, line: LineSettings | None = None) -> Interface:
    """Return inputs and outputs of the block of a compensation.

    Parameters
    ----------
    settings : PlcSettings
        What is exported.
    line : LineSettings, optional
        The line in the control. Default: there is none.

    Returns
    -------
    Interface
        The variables.
    """
    return Interface(
        tuple(_inputs(settings, line=line is not None)),
        tuple(_outputs(settings, line=line is not None)),
        tuple(_identity(settings)),
    )


def model_only_interface(settings: PlcSettings) -> Interface:
    """Return inputs and outputs of the block of a model with limits and rate alone."""
    model = settings.compensation.model
    gained, count = bool(model.layout.gained), len(model.channels)
    inputs = [
        _bool("enable", "the correction follows the model, else it goes to zero at the rate"),
        _bool("start", "start the model anew, with these temperatures"),
        *(_number(f"t_{stem}", text, "degC") for stem, text in _channels(settings)[:count]),
    ]
    if gained:
        inputs.append(_number("diameter_mm", "clamping diameter of the workpiece", "mm"))
        inputs.append(_bool("diameter_known", "it is stated, else the tool centre point counts"))
    parts = zip(settings.names.parts, settings.compensation.model.layout.parts, strict=True)
    outputs = [
        *(
            made
            for stem, text in _named(settings)
            for made in (
                _number(f"correction_{stem}", f"{text}: correction to be written", "um"),
                _number(f"model_{stem}", f"{text}: displacement by the model", "um"),
            )
        ),
        *(
            _number(f"part_{stem}", f"what {remark_text(part.name)} contributes", "um")
            for stem, part in parts
        ),
        _bool("inputs_ok", "every temperature is plausible"),
        _bool("settled", "the correction is what the model asks for, within 1 um"),
    ]
    return Interface(tuple(inputs), tuple(outputs), tuple(_identity(settings)))


def _number(name: str, text: str, unit: str, start: float = 0.0) -> Variable:
    return Variable(name, Kind.NUMBER, text, unit, start)


def _bool(name: str, text: str) -> Variable:
    return Variable(name, Kind.BOOL, text)


def _int(name: str, text: str, start: float = 0.0) -> Variable:
    return Variable(name, Kind.INT, text, "", start)


def _inputs(settings: PlcSettings, *, line: bool) -> Iterator[Variable]:
    outputs = _named(settings)
    yield _bool("init", "TRUE in the first scan after power-on: begin as a new instance")
    yield _number("cycle_time_s", "measured time since the last call", "s")
    yield _bool("enable", "rising: enable, falling: disable")
    yield _bool("hold", "while it is TRUE: hold, falling: resume")
    yield _bool("reset", "rising: acknowledge a fault or the jump of a sensor")
    yield _number("diameter_mm", "clamping diameter of the workpiece", "mm")
    yield _bool("diameter_known", "it is stated, else the tool centre point counts")
    for stem, text in _channels(settings):
        yield _number(f"t_{stem}", text, "degC")
        yield _bool(f"ok_{stem}", f"{text}: its status is good")
    for stem, text in outputs:
        yield _number(f"trim_{stem}", f"{text}: trim that is asked for", "um")
    yield _bool("interlocks_met", "every interlock is met")
    yield _bool("connected", "the control can be written to")
    yield _bool("other_compensation", "another compensation is active")
    if line:
        yield _number("read_k0_mm", "SD43900 that the control reports", "mm")
        yield _number("read_slope", "SD43910 that the control reports", "mm/mm")
        yield _number("read_reference_mm", "SD43920 that the control reports", "mm")
    else:
        for stem, text in outputs:
            yield _number(f"read_{stem}", f"{text}: offset that the control reports", "um")
    yield _bool("read_ok", "that was read: in Off it is taken over in every call")


def _outputs(settings: PlcSettings, *, line: bool) -> Iterator[Variable]:
    outputs = _named(settings)
    parts = [part.name for part in settings.compensation.model.layout.parts]
    if line:
        yield _number("k0_mm", "K0, for SD43900", "mm")
        yield _number("slope", "slope, for SD43910", "mm/mm")
        yield _number("reference_mm", "reference position, for SD43920", "mm")
        yield _number("residual_um", "largest distance of a correction from the line", "um")
        yield _bool("line_limited", "a bound of the line acts")
    for stem, text in outputs:
        yield _number(f"correction_{stem}", f"{text}: correction to be written", "um")
        yield _number(f"model_{stem}", f"{text}: displacement by the model", "um")
        yield _number(f"wanted_{stem}", f"{text}: correction before rate and supervisor", "um")
        yield _number(f"weight_{stem}", f"{text}: weight of the model", "1", 1.0)
        yield _bool(f"limit_{stem}", f"{text}: the model asks for more than the output limit")
        yield _number(f"added_{stem}", f"{text}: trim in force", "um")
        yield _number(f"to_go_{stem}", f"{text}: distance from what is wanted", "um")
    for stem, name in zip(settings.names.parts, parts, strict=True):
        yield _number(f"part_{stem}", f"what {remark_text(name)} contributes", "um")
    for stem, text in _channels(settings):
        yield _int(f"quality_{stem}", f"{text}: 0 good, else what is wrong")
    yield _int("state", ", ".join(f"{k} {state}" for k, state in enumerate(SupervisorState)))
    yield _bool("enabled", "somebody has enabled it")
    yield _bool("held", "the hold of an operator is in force, or has expired")
    yield _bool("linked", "the corrections may be written")
    yield _bool("settled", "the corrections are what the model asks for, within 1 um")
    yield _bool("standing", "Off, and an offset stands in the control that nobody commands")
    yield _int("fault_word", "why it is not active, bits in the guide")
    qualities = ", ".join(f"{k} {quality}" for k, quality in enumerate(Quality))
    yield _int("model_quality", qualities, float(list(Quality).index(Quality.BAD)))
    yield _int("outcome_word", "what was out of the ordinary, bits in the guide")
    yield _bool("refused", "a request of this call was refused")
    yield _int("heartbeat", "counts the calls to 32767, then from 0")


def _identity(settings: PlcSettings) -> Iterator[Variable]:
    digits = settings.model_sha256
    yield _int("library_version", "version of the library", float(LIBRARY_VERSION))
    for k in range(2 if digits else 0):
        first, behind = k * IDENTITY_DIGITS, (k + 1) * IDENTITY_DIGITS
        text = f"hexadecimal digits {first + 1} to {behind} of the hash of the model, as a number"
        yield _int(f"model_id_{k + 1}", text, float(int(digits[first:behind], 16)))


def _channels(settings: PlcSettings) -> list[tuple[str, str]]:
    channels = settings.compensation.judged
    return [(s, remark_text(c)) for s, c in zip(settings.names.channels, channels, strict=True)]


def _named(settings: PlcSettings) -> list[tuple[str, str]]:
    outputs = settings.compensation.model.outputs
    return [(s, remark_text(o.name)) for s, o in zip(settings.names.outputs, outputs, strict=True)]
