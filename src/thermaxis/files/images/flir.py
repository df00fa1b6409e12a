"""Thermal fields from radiometric JPEG of FLIR cameras, by the library flyr (extra ``flir``)."""

import io
from datetime import datetime
from importlib import import_module
from pathlib import Path
from typing import Any, cast

import numpy as np

from thermaxis.codes import Message, remark
from thermaxis.errors import ConfigurationError, MeasurementFileError
from thermaxis.files.table import DAMAGE, read_content
from thermaxis.thermal import MOST_PIXELS, FloatArray, ThermalField
from thermaxis.thermal.images import ABSOLUTE_ZERO_C

_JPEG = b"\xff\xd8\xff"
_FLIR_SEGMENT = b"FLIR\x00"
_MOST_RECORDS = 4096
"""A damaged directory of records may claim billions of them, and be read for hours. [1]"""
_PNG = b"\x89PNG\r\n\x1a\n"


def is_jpeg(start: bytes) -> bool:
    """Say whether a file starts as a JPEG."""
    return start.startswith(_JPEG)


def read_flir(
    path: Path | str, *, emissivity: float | None = None, reflected_c: float | None = None
) -> ThermalField:
    """Read the temperatures of a radiometric JPEG.

    The camera's own formula (Planck constants, emissivity, reflection, air) is evaluated by flyr
    from the records of the file. Not verified on a real file; the remarks say so.

    Parameters
    ----------
    emissivity : float, optional
        Emissivity in place of the one that the camera was set to. [1]
    reflected_c : float, optional
        Reflected temperature in place of the one that the camera was set to. [°C]

    Returns
    -------
    ThermalField
        The temperatures, with the file's name, the settings and the remark 'not verified on a real
        file'. [°C]

    Raises
    ------
    ConfigurationError
        If flyr is not installed, or the emissivity is not in (0, 1].
    MeasurementFileError
        If the file cannot be read, is no radiometric JPEG, is damaged, or holds an image of more
        than 100 million pixels, which is refused before it is unpacked.
    """
    name = str(path)
    content = read_content(path)
    if not is_jpeg(content) or _FLIR_SEGMENT not in content:
        raise MeasurementFileError("not_radiometric", file=name)
    _refuse_if_too_large(name, content)
    _refuse_if_endless(name, content)
    adjusted = _adjusted(emissivity, reflected_c)
    temperature_c, settings, taken = _unpacked(name, content, adjusted)
    said = [remark("flir_unverified"), *_on_settings(settings)]
    if taken is not None:
        said.append(remark("camera_clock", moment=taken.isoformat(sep=" ")))
    return ThermalField(temperature_c, name=Path(path).name, remarks=tuple(said))


def _adjusted(emissivity: float | None, reflected_c: float | None) -> dict[str, float]:
    changed: dict[str, float] = {}
    if emissivity is not None:
        if not 0.0 < emissivity <= 1.0:
            raise ConfigurationError("not_an_emissivity", value=emissivity, key="emissivity")
        changed["emissivity"] = emissivity
    if reflected_c is not None:
        changed["reflected_apparent_temperature"] = reflected_c - ABSOLUTE_ZERO_C
    return changed


def _unpacked(
    name: str, content: bytes, adjusted: dict[str, float]
) -> tuple[FloatArray, dict[str, float], datetime | None]:
    flyr = _flyr()
    try:
        thermogram = flyr.unpack(io.BytesIO(content))
        camera = getattr(thermogram, "camera_metadata", None)
        taken = getattr(camera, "date_time", None)
        settings = {**thermogram.metadata, **adjusted}
        if adjusted:
            thermogram = thermogram.adjust_metadata(**adjusted)
        with np.errstate(all="ignore"):  # what is not finite is refused below
            temperature_c = np.array(thermogram.celsius, dtype=np.float64)
    except DAMAGE as error:
        raise MeasurementFileError("file_damaged", cause=type(error).__name__, file=name) from error
    if temperature_c.ndim != 2 or not bool(np.all(np.isfinite(temperature_c))):
        raise MeasurementFileError("pixels_without_temperature", file=name)
    return temperature_c, settings, taken if isinstance(taken, datetime) else None


def _flyr() -> Any:
    try:
        return cast("Any", import_module("flyr"))
    except ImportError:
        raise ConfigurationError("package_missing", package="flyr") from None


def _refuse_if_too_large(name: str, content: bytes) -> None:
    """Look at the heads of all pictures inside: a small one may unpack to a very large one."""
    at = content.find(_PNG)
    while at >= 0:
        columns, rows = (int.from_bytes(content[at + k : at + k + 4], "big") for k in (16, 20))
        if rows * columns > MOST_PIXELS:
            raise MeasurementFileError(
                "image_too_large", columns=columns, rows=rows, most_pixels=MOST_PIXELS, file=name
            )
        at = content.find(_PNG, at + 8)


def _refuse_if_endless(name: str, content: bytes) -> None:
    """Look at the number of records that the head of the camera's data states."""
    at = content.find(_FLIR_SEGMENT)
    while at >= 0:
        first_chunk = content[at + 6 : at + 7] == b"\x00"
        if first_chunk and int.from_bytes(content[at + 36 : at + 40], "big") > _MOST_RECORDS:
            raise MeasurementFileError("file_damaged", cause="directory", file=name)
        at = content.find(_FLIR_SEGMENT, at + 1)


def _on_settings(settings: dict[str, float]) -> list[Message]:
    if not {"emissivity", "reflected_apparent_temperature"} <= settings.keys():
        return []
    reflected_c = settings["reflected_apparent_temperature"] + ABSOLUTE_ZERO_C
    emissivity = f"{settings['emissivity']:.3g}"
    return [remark("camera_settings", emissivity=emissivity, reflected_c=reflected_c)]
