"""What a caller of the block sees: its inputs and outputs, with their units."""

from thermaxis.compensation import Quality, SupervisorState
from thermaxis.plc._settings import PlcSettings
from thermaxis.plc.blocks._draft import Draft, number_of, numbered
from thermaxis.plc.tree import Kind, remark_text

IDENTITY_DIGITS = 3
"""Hexadecimal digits of the model's hash in one number. [1]"""

_BOOL, _INT = Kind.BOOL, Kind.INT


def channel_texts(settings: PlcSettings) -> list[tuple[str, str]]:
    """Return stem and text of every channel."""
    channels = settings.compensation.model.channels
    return [(s, remark_text(c)) for s, c in zip(settings.names.channels, channels, strict=True)]


def output_texts(settings: PlcSettings) -> list[tuple[str, str]]:
    """Return stem and text of every output."""
    outputs = settings.compensation.model.outputs
    return [(s, remark_text(o.name)) for s, o in zip(settings.names.outputs, outputs, strict=True)]


def identity(settings: PlcSettings) -> tuple[int, ...]:
    """Return the first digits of the model's hash, as numbers that every control holds."""
    digits = settings.model_sha256
    if not digits:
        return ()
    n = IDENTITY_DIGITS
    return int(digits[:n], 16), int(digits[n : 2 * n], 16)


def declare_inputs(draft: Draft, settings: PlcSettings) -> None:
    """Declare what a caller states."""
    draft.input("cycle_time_s", "measured time since the last call [s]")
    draft.input("enable", "rising: enable, falling: disable", _BOOL)
    draft.input("hold", "while it is TRUE: hold, falling: resume", _BOOL)
    draft.input("reset", "rising: acknowledge a fault or the jump of a sensor", _BOOL)
    draft.input("diameter_mm", "clamping diameter of the workpiece [mm]")
    draft.input("diameter_known", "whether it is stated, else the tool centre point", _BOOL)
    for stem, text in channel_texts(settings):
        draft.input(f"t_{stem}", f"{text}: temperature [degC]")
        draft.input(f"ok_{stem}", f"{text}: whether its status is good", _BOOL)
    for stem, text in output_texts(settings):
        draft.input(f"trim_{stem}", f"{text}: trim that is asked for [um]")
    draft.input("interlocks_met", "whether every interlock is met", _BOOL)
    draft.input("connected", "whether the machine can be written to", _BOOL)
    draft.input("other_compensation", "whether another compensation is active", _BOOL)
    for stem, text in output_texts(settings):
        draft.input(f"read_{stem}", f"{text}: correction that the machine reports [um]")
    draft.input("read_ok", "whether that was read: in Off it is taken over in every call", _BOOL)


def declare_outputs(draft: Draft, settings: PlcSettings) -> None:
    """Declare what a caller may read."""
    for stem, text in output_texts(settings):
        draft.output(f"correction_{stem}", f"{text}: correction to be written [um]")
        draft.output(f"model_{stem}", f"{text}: displacement by the model [um]")
        draft.output(f"wanted_{stem}", f"{text}: correction before rate and supervisor [um]")
        draft.output(f"weight_{stem}", f"{text}: weight of the model [1]", start=1.0)
        draft.output(f"limit_{stem}", f"{text}: whether the model asks for more", _BOOL)
        draft.output(f"added_{stem}", f"{text}: trim in force, 0 once it has expired [um]")
    parts = settings.compensation.model.layout.parts
    for stem, part in zip(settings.names.parts, parts, strict=True):
        draft.output(f"part_{stem}", f"what {remark_text(part.name)} contributes [um]")
    for stem, text in channel_texts(settings):
        draft.output(f"quality_{stem}", f"{text}: what is wrong with it, 0 for nothing", _INT)
    draft.output("state", numbered(SupervisorState), _INT)
    draft.output("enabled", "whether somebody has enabled it", _BOOL)
    draft.output("held", "whether the hold of an operator is in force, or has expired", _BOOL)
    draft.output("linked", "whether the corrections may be written, see the head", _BOOL)
    draft.output("fault_word", "why it is not active, see the head", _INT)
    draft.output("model_quality", numbered(Quality), _INT, start=number_of(Quality.BAD))
    draft.output("outcome_word", "what was out of the ordinary, see the head", _INT)
    draft.output("refused", "whether a request of this call was refused", _BOOL)
    draft.output("heartbeat", "counts the calls to 32767, then begins at 0 again [1]", _INT)
    for n, value in enumerate(identity(settings), 1):
        last = IDENTITY_DIGITS * n
        first = last - IDENTITY_DIGITS + 1
        text = f"hexadecimal digits {first} to {last} of the hash of the model, as a number"
        draft.output(f"model_id_{n}", text, _INT, start=value)
