"""Compensation models as JSON, ``thermaxis-compensation-model`` version 1.

One object. A key that is not listed here is an error; keys marked (*) may be left out.

``format``, ``version``
    ``"thermaxis-compensation-model"`` and 1.
``sign`` (*)
    The sign in words, always the sentence `SIGN`; for the reader, never another convention.
``sample_time_s`` (*), ``input_filter_s`` (*)
    Nominal time between readings; time constant of the filter of every input, 0 for none.
``reference``, ``reference_c`` (*)
    ``"start"`` (temperatures at the start) or ``"stated"``; temperatures by channel.
``longest_gap_s`` (*), ``longest_hold_s`` (*)
    After a longer gap the model starts anew; an input that fails is held so long.
``limits`` (*)
    Limits of the correction; always null: they belong to a machine and stand in its configuration,
    ``machine.toml``.
``outputs``
    List of ``name``, ``offset_um`` (*), ``parts``: list of ``name``, ``plus``, ``minus`` (*),
    ``direct_gain_um_per_k``, ``sections`` (list of ``gain_um_per_k``, ``time_constant_s``),
    ``delay_s`` (*), ``gain_by_diameter`` (*) (list of ``diameter_mm``, ``gain``), ``tool_gain``
    (*), ``lowest_k`` (*), ``highest_k`` (*) (range of the input in the training logs),
    ``static_gain_um_per_k`` (*) (baseline of a verification; no part of the model).
``provenance`` (*)
    ``method``, ``program``, ``date``, ``logs`` (list of ``name``, ``sha256``, ``rows``,
    ``first_row``), ``figures`` (by name); each may be left out.
``warnings`` (*)
    List of sentences.
``sha256`` (*)
    SHA-256 of the content; where it stands it must be right.
"""

import json
from pathlib import Path

from thermaxis.compensation import (
    START,
    CompensationModel,
    GainPoint,
    Output,
    Part,
    Provenance,
    Section,
    TrainingLog,
)
from thermaxis.files.settings._document import Form, SettingsTable, content_sha256, read_document
from thermaxis.files.settings._settings_file import write_json_text

FORMAT = "thermaxis-compensation-model"
"""What every model says that it is."""
VERSION = 1
"""Version of the format that is written, and the only one that is read. [1]"""
SIGN = (
    "An output is the displacement of the tool point relative to the workpiece in um, positive"
    " away from it; the correction is minus the output."
)
"""The sign convention, as it stands in every model."""

FORM = Form(
    noun="model",
    format=FORMAT,
    version=VERSION,
    largest_bytes=5_000_000,
    largest_number=1e12,
    longest_text=2000,
    remedy="Give a model that thermaxis identify or combine has written",
    again="identify the model again",
)


def model_as_json(model: CompensationModel) -> dict[str, object]:
    """Return a model with the keys of the format, its hash as the last one."""
    content = _content(model)
    return {**content, "sha256": content_sha256(content)}


def model_sha256(model: CompensationModel) -> str:
    """Return the hash by which a model is named.

    Parameters
    ----------
    model : CompensationModel
        The model.

    Returns
    -------
    str
        SHA-256, 64 hexadecimal digits, of the model's JSON without the key ``sha256``: keys in
        alphabetical order, no blanks, ASCII.
    """
    return content_sha256(_content(model))


def _content(model: CompensationModel) -> dict[str, object]:
    provenance = model.provenance
    return {
        "format": FORMAT,
        "version": VERSION,
        "sign": SIGN,
        "sample_time_s": float(model.sample_time_s),
        "reference": model.reference,
        "reference_c": {c: float(v) for c, v in model.reference_c.items()},
        "input_filter_s": float(model.input_filter_s),
        "longest_gap_s": float(model.longest_gap_s),
        "longest_hold_s": float(model.longest_hold_s),
        "limits": None,
        "outputs": [_output_as_json(output) for output in model.outputs],
        "provenance": {
            "method": provenance.method,
            "program": provenance.program,
            "date": provenance.date,
            "logs": [
                {"name": g.name, "sha256": g.sha256, "rows": g.rows, "first_row": g.first_row}
                for g in provenance.logs
            ],
            "figures": {name: float(v) for name, v in provenance.figures.items()},
        },
        "warnings": list(model.warnings),
    }


def _output_as_json(output: Output) -> dict[str, object]:
    return {
        "name": output.name,
        "offset_um": float(output.offset_um),
        "parts": [_part_as_json(part) for part in output.parts],
    }


def _part_as_json(part: Part) -> dict[str, object]:
    sections = [(s.gain_um_per_k, s.time_constant_s) for s in part.sections]
    points = [(p.diameter_mm, p.gain) for p in part.gain_by_diameter]
    low, high, static = part.lowest_k, part.highest_k, part.static_gain_um_per_k
    return {
        "name": part.name,
        "plus": part.plus,
        "minus": part.minus,
        "direct_gain_um_per_k": float(part.direct_gain_um_per_k),
        "sections": [{"gain_um_per_k": float(g), "time_constant_s": float(t)} for g, t in sections],
        "delay_s": float(part.delay_s),
        "gain_by_diameter": [{"diameter_mm": float(d), "gain": float(g)} for d, g in points],
        "tool_gain": float(part.tool_gain),
        "lowest_k": None if low is None else float(low),
        "highest_k": None if high is None else float(high),
        "static_gain_um_per_k": None if static is None else float(static),
    }


def format_model(model: CompensationModel) -> str:
    """Return a model as the text of its file.

    Parameters
    ----------
    model : CompensationModel
        The model.

    Returns
    -------
    str
        JSON in ASCII, indented; the last line ends in a line feed.
    """
    return json.dumps(model_as_json(model), indent=1, allow_nan=False) + "\n"


def write_model(model: CompensationModel, path: Path | str) -> None:
    """Write a model.

    Parameters
    ----------
    model : CompensationModel
        The model.
    path : Path or str
        The file; it is replaced if it exists.

    Raises
    ------
    ConfigurationError
        If it cannot be written.
    """
    write_json_text(format_model(model), path)


def read_model(path: Path | str) -> CompensationModel:
    """Read a compensation model.

    Parameters
    ----------
    path : Path or str
        The file, JSON in UTF-8, at most 5 MB.

    Returns
    -------
    CompensationModel
        The model. Read, written and read again it is the same, and so is its hash.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, is too large, is not JSON or no model, has another version, an
        unknown, missing or repeated key, a value that cannot be, or a hash that does not fit.
    """
    return read_document(path, FORM, _model, model_sha256)


def _model(of: SettingsTable) -> CompensationModel:
    if of.word("sign", SIGN) != SIGN:
        raise of.wrong("sign", "another convention than this program's", f"It must be: {SIGN}")
    of.null("limits", "Limits are not part of this version's models: write null")
    plain = CompensationModel(outputs=(Output("any", (Part("any", "any"),)),))
    return CompensationModel(
        sample_time_s=of.number("sample_time_s", plain.sample_time_s),
        reference=of.word("reference", START),
        reference_c=of.numbers("reference_c"),
        input_filter_s=of.number("input_filter_s", plain.input_filter_s),
        longest_gap_s=of.number("longest_gap_s", plain.longest_gap_s),
        longest_hold_s=of.number("longest_hold_s", plain.longest_hold_s),
        outputs=of.entries("outputs", _output, needed=True),
        provenance=of.inner("provenance", _provenance),
        warnings=of.texts("warnings"),
    )


def _output(of: SettingsTable) -> Output:
    return Output(
        name=of.word("name"),
        offset_um=of.number("offset_um", 0.0),
        parts=of.entries("parts", _part, needed=True),
    )


def _part(of: SettingsTable) -> Part:
    return Part(
        name=of.word("name"),
        plus=of.word("plus"),
        minus=of.word("minus", ""),
        direct_gain_um_per_k=of.number("direct_gain_um_per_k"),
        sections=of.entries("sections", _section, needed=True),
        delay_s=of.number("delay_s", 0.0),
        gain_by_diameter=of.entries("gain_by_diameter", _gain_point, needed=False),
        tool_gain=of.number("tool_gain", 1.0),
        lowest_k=of.number_or_none("lowest_k"),
        highest_k=of.number_or_none("highest_k"),
        static_gain_um_per_k=of.number_or_none("static_gain_um_per_k"),
    )


def _section(of: SettingsTable) -> Section:
    return Section(of.number("gain_um_per_k"), of.number("time_constant_s"))


def _gain_point(of: SettingsTable) -> GainPoint:
    return GainPoint(of.number("diameter_mm"), of.number("gain"))


def _provenance(of: SettingsTable) -> Provenance:
    return Provenance(
        method=of.word("method", ""),
        program=of.word("program", ""),
        date=of.word("date", ""),
        logs=of.entries("logs", _log, needed=False),
        figures=of.numbers("figures"),
    )


def _log(of: SettingsTable) -> TrainingLog:
    return TrainingLog(
        of.word("name"), of.word("sha256", ""), of.whole("rows"), of.whole("first_row")
    )
