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

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TypeVar, cast

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
from thermaxis.errors import ConfigurationError, printable
from thermaxis.files.settings._settings_file import (
    read_json_object,
    unknown_key,
    write_json_text,
)

FORMAT = "thermaxis-compensation-model"
"""What every model says that it is."""
VERSION = 1
"""Version of the format that is written, and the only one that is read. [1]"""
LARGEST_MODEL_BYTES = 5_000_000
"""Largest model that is read. [byte]"""
SIGN = (
    "An output is the displacement of the tool point relative to the workpiece in um, positive"
    " away from it; the correction is minus the output."
)
"""The sign convention, as it stands in every model."""

_REMEDY = "Give a model that thermaxis identify or combine has written"
_LONGEST_WORD = 2000
_MOST_ENTRIES = 10_000
_T = TypeVar("_T")


# ---- writing ------------------------------------------------------------------------------------


def model_as_json(model: CompensationModel) -> dict[str, object]:
    """Return a model with the keys of the format, its hash as the last one."""
    content = _content(model)
    return {**content, "sha256": _hash_of(content)}


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
    return _hash_of(_content(model))


def _hash_of(content: Mapping[str, object]) -> str:
    plain = json.dumps(content, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(plain.encode("ascii")).hexdigest()


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
    return {
        "name": part.name,
        "plus": part.plus,
        "minus": part.minus,
        "direct_gain_um_per_k": float(part.direct_gain_um_per_k),
        "sections": [
            {
                "gain_um_per_k": float(s.gain_um_per_k),
                "time_constant_s": float(s.time_constant_s),
            }
            for s in part.sections
        ],
        "delay_s": float(part.delay_s),
        "gain_by_diameter": [
            {"diameter_mm": float(p.diameter_mm), "gain": float(p.gain)}
            for p in part.gain_by_diameter
        ],
        "tool_gain": float(part.tool_gain),
        "lowest_k": None if part.lowest_k is None else float(part.lowest_k),
        "highest_k": None if part.highest_k is None else float(part.highest_k),
        "static_gain_um_per_k": (
            None if part.static_gain_um_per_k is None else float(part.static_gain_um_per_k)
        ),
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


# ---- reading ------------------------------------------------------------------------------------


class _Object:
    """A JSON object whose keys are taken one by one; what is left over is an error."""

    def __init__(self, name: str, place: str, value: object) -> None:
        self.name, self.place = name, place
        if not isinstance(value, dict):
            raise self.wrong("", "not an object")
        self.left = dict(cast("Mapping[str, object]", value))

    def wrong(self, key: str, what: str, remedy: str = "") -> ConfigurationError:
        """Return the error of a value."""
        place = f"{self.place}.{key}" if self.place and key else self.place or key
        return ConfigurationError(
            f"the value is {what}", where=f"{self.name}, key {printable(place, 120)}", remedy=remedy
        )

    def _take(self, key: str, default: object) -> object:
        if key in self.left:
            return self.left.pop(key)
        if default is _NEEDED:
            place = f" of {self.place}" if self.place else ""
            raise ConfigurationError(
                f"the model lacks the key {key}{place}", where=self.name, remedy=f"Add {key}"
            )
        return default

    def number(self, key: str, default: object = None) -> float:
        """Return a number."""
        value = self._take(key, _NEEDED if default is None else default)
        return self._as_number(key, value)

    def number_or_none(self, key: str) -> float | None:
        """Return a number or None."""
        value = self._take(key, None)
        return None if value is None else self._as_number(key, value)

    def _as_number(self, key: str, value: object) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.wrong(key, "not a number", "Write it without quotes")
        if not abs(value) <= 1e12:
            raise self.wrong(key, "not a number of at most 1e12 in magnitude")
        return float(value)

    def whole(self, key: str, default: int = 0) -> int:
        """Return a whole number from 0 up."""
        value = self._take(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**63:
            raise self.wrong(key, "not a whole number from 0 up")
        return value

    def word(self, key: str, default: str | None = None) -> str:
        """Return a text."""
        value = self._take(key, _NEEDED if default is None else default)
        if not isinstance(value, str):
            raise self.wrong(key, "not a text", "Write it in quotes")
        if len(value) > _LONGEST_WORD or not value.isprintable():
            raise self.wrong(key, f"no line of at most {_LONGEST_WORD} characters")
        return value

    def entries(self, key: str, read: "Callable[[_Object], _T]", *, needed: bool) -> tuple[_T, ...]:
        """Return a list of objects, each read by a function."""
        return tuple(
            read_all(
                _Object(self.name, f"{self.place}{'.' if self.place else ''}{key}[{k}]", v), read
            )
            for k, v in enumerate(self.items(key, needed=needed))
        )

    def items(self, key: str, *, needed: bool) -> list[object]:
        """Return a list."""
        value = self._take(key, _NEEDED if needed else [])
        if not isinstance(value, list):
            raise self.wrong(key, "not a list")
        listed = cast("list[object]", value)
        if len(listed) > _MOST_ENTRIES:
            raise self.wrong(key, f"a list of more than {_MOST_ENTRIES} entries")
        return listed

    def numbers(self, key: str) -> dict[str, float]:
        """Return numbers by name."""
        value = self._take(key, {})
        inner = _Object(self.name, f"{self.place}{'.' if self.place else ''}{key}", value)
        return {name: inner.number(name) for name in list(inner.left)}

    def inner(self, key: str, read: "Callable[[_Object], _T]") -> _T:
        """Return what a function reads of an object that may be left out."""
        place = f"{self.place}{'.' if self.place else ''}{key}"
        return read_all(_Object(self.name, place, self._take(key, {})), read)

    def null(self, key: str, why: str) -> None:
        """Accept nothing but null."""
        if self._take(key, None) is not None:
            raise self.wrong(key, "not null", why)


_NEEDED = object()


def read_all(of: _Object, read: Callable[[_Object], _T]) -> _T:
    """Return what a function reads of an object, and refuse keys that it did not ask for."""
    result = read(of)
    if of.left:
        place = f" in {of.place}" if of.place else ""
        raise unknown_key(of.name, next(iter(of.left)), _KNOWN, place)
    return result


_KNOWN = (
    *("sample_time_s", "reference", "reference_c", "input_filter_s", "longest_gap_s"),
    *("longest_hold_s", "limits", "outputs", "provenance", "warnings", "sha256", "name"),
    *("offset_um", "parts", "plus", "minus", "direct_gain_um_per_k", "sections", "delay_s"),
    *(
        "gain_by_diameter",
        "tool_gain",
        "lowest_k",
        "highest_k",
        "static_gain_um_per_k",
        "gain_um_per_k",
    ),
    *("time_constant_s", "diameter_mm", "gain", "method", "program", "date", "logs", "figures"),
)


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
    name = str(path)
    table = read_json_object(name, largest_bytes=LARGEST_MODEL_BYTES, remedy=_REMEDY)
    if table.get("format") != FORMAT:
        stated = printable(str(table.get("format", "nothing")), 40)
        raise ConfigurationError(
            f"the key format says {stated}, not {FORMAT}: this is no model",
            where=name,
            remedy=_REMEDY,
        )
    version = table.get("version")
    if isinstance(version, bool) or version != VERSION:
        raise ConfigurationError(
            f"version {printable(str(version), 20)} of the model's format is not known",
            where=f"{name}, key version",
            remedy=f"This program reads version {VERSION}; identify the model again",
        )
    try:
        model = read_all(_Object(name, "", table), _model)
    except ConfigurationError as error:
        if error.where.startswith(name):
            raise
        raise ConfigurationError(
            error.what, where=f"{name}, {error.where}", remedy=error.remedy
        ) from None
    stated_hash = table.get("sha256")
    if stated_hash is not None and stated_hash != model_sha256(model):
        raise ConfigurationError(
            "the hash does not fit the content: the model was changed after it was written",
            where=f"{name}, key sha256",
            remedy="Restore the model; or leave the key out, and the changed model has its own"
            " hash",
        )
    return model


def _model(of: _Object) -> CompensationModel:
    of.word("format")
    of.left.pop("version")
    if of.word("sign", SIGN) != SIGN:
        raise of.wrong("sign", "another convention than this program's", f"It must be: {SIGN}")
    of.word("sha256", "")
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
        warnings=_sentences(of),
    )


def _sentences(of: _Object) -> tuple[str, ...]:
    listed = of.items("warnings", needed=False)
    return tuple(
        _Object(of.name, f"warnings[{k}]", {"sentence": v}).word("sentence")
        for k, v in enumerate(listed)
    )


def _output(of: _Object) -> Output:
    return Output(
        name=of.word("name"),
        offset_um=of.number("offset_um", 0.0),
        parts=of.entries("parts", _part, needed=True),
    )


def _part(of: _Object) -> Part:
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


def _section(of: _Object) -> Section:
    return Section(of.number("gain_um_per_k"), of.number("time_constant_s"))


def _gain_point(of: _Object) -> GainPoint:
    return GainPoint(of.number("diameter_mm"), of.number("gain"))


def _provenance(of: _Object) -> Provenance:
    return Provenance(
        method=of.word("method", ""),
        program=of.word("program", ""),
        date=of.word("date", ""),
        logs=of.entries("logs", _log, needed=False),
        figures=of.numbers("figures"),
    )


def _log(of: _Object) -> TrainingLog:
    return TrainingLog(
        of.word("name"), of.word("sha256", ""), of.whole("rows"), of.whole("first_row")
    )
