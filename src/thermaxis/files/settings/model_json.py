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
from typing import Any, cast

from thermaxis.compensation import CompensationModel
from thermaxis.errors import ConfigurationError
from thermaxis.files.settings._document import (
    Form,
    content_sha256,
    document_of,
    plain,
    read_document,
    write_document,
)
from thermaxis.files.settings._reading import parse_json_object, settings_of

FORMAT = "thermaxis-compensation-model"
"""What every model says that it is."""
VERSION = 1
"""Version of the format that is written, and the only one that is read. [1]"""
SIGN = (
    "An output is the displacement of the tool point relative to the workpiece in um, positive"
    " away from it; the correction is minus the output."
)
"""The sign convention, as it stands in every model."""

_FORM = Form(FORMAT, VERSION, largest_bytes=5_000_000)
_ORDER = (
    *("sample_time_s", "reference", "reference_c", "input_filter_s", "longest_gap_s"),
    *("longest_hold_s", "limits", "outputs", "provenance", "warnings"),
)


def model_as_json(model: CompensationModel) -> dict[str, object]:
    """Return a model with the keys of the format, its hash as the last one."""
    content = _content(model)
    return {**content, "sha256": content_sha256(content)}


def model_sha256(model: CompensationModel) -> str:
    """Return the hash by which a model is named.

    Returns
    -------
    str
        SHA-256, 64 hexadecimal digits, of the model's JSON without the key ``sha256``: keys in
        alphabetical order, no blanks, ASCII.
    """
    return content_sha256(_content(model))


def _content(model: CompensationModel) -> dict[str, object]:
    each = {**plain(model), "limits": None}
    content: dict[str, object] = {"format": FORMAT, "version": VERSION, "sign": SIGN}
    return content | {key: each[key] for key in _ORDER}


def format_model(model: CompensationModel) -> str:
    """Return a model as the text of its file.

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
    path : Path or str
        The file; it is replaced if it exists.

    Raises
    ------
    ConfigurationError
        If it cannot be written.
    """
    write_document(format_model(model), path)


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
    return read_document(path, _FORM, _model, model_sha256)


def parse_model(text: str, *, name: str) -> CompensationModel:
    """Return the model whose file has a text, as `read_model` does; errors call it by a name."""
    return document_of(parse_json_object(text, file=name), name, _FORM, _model, model_sha256)


def _model(content: dict[str, object], file: str) -> CompensationModel:
    if content.pop("sign", SIGN) != SIGN:
        raise ConfigurationError("other_sign_convention", expected=SIGN, file=file, key="sign")
    if content.pop("limits", None) is not None:
        raise ConfigurationError("limits_in_model", file=file, key="limits")
    model = settings_of(CompensationModel, content, file=file)
    # What has a default in a program must be stated in a file that may act on a machine.
    for i, output in enumerate(cast("list[dict[str, Any]]", content["outputs"])):
        for k, part in enumerate(output["parts"]):
            for key in ("direct_gain_um_per_k", "sections"):
                if key not in part:
                    raise ConfigurationError(
                        "missing_key", file=file, key=f"outputs[{i}].parts[{k}].{key}"
                    )
    for k, log in enumerate(model.provenance.logs):
        if min(log.rows, log.first_row) < 0:
            raise ConfigurationError(
                "negative",
                value=min(log.rows, log.first_row),
                file=file,
                key=f"provenance.logs[{k}].rows",
            )
    return model
