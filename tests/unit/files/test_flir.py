"""Radiometric JPEG go through an optional library; a stand-in shows how it is called."""

import datetime as dt
import io
import sys
import types

import numpy as np
import pytest

from tests.refusals import answer_of, refusal_of
from thermaxis.codes import remark
from thermaxis.errors import ConfigurationError
from thermaxis.files import read_flir
from thermaxis.files.images import is_jpeg

JPEG = b"\xff\xd8\xff\xe0\x00\x10JFIF\x00" + bytes(64)
FLIR = b"\xff\xd8\xff\xe1\x01\x00FLIR\x00\x01\x00\x00FFF\x00" + bytes(64)
SETTINGS = {"emissivity": 0.95, "reflected_apparent_temperature": 293.15}


class Thermogram:
    """What the library returns: temperatures that follow the settings, so that a test sees them."""

    def __init__(self, celsius, settings):
        self.metadata = settings
        self.camera_metadata = types.SimpleNamespace(
            date_time=dt.datetime(2026, 3, 2, 15, 4, 5)  # noqa: DTZ001 - a camera has no zone
        )
        self._celsius = celsius

    def adjust_metadata(self, **changed):
        shift = 1000.0 * (changed.get("emissivity", 0.95) - 0.95)
        return Thermogram(self._celsius + shift, {**self.metadata, **changed})

    @property
    def celsius(self):
        return self._celsius


@pytest.fixture
def library(monkeypatch):
    """Stand in for the library; what it returns or raises can be set."""
    module = types.ModuleType("flyr")
    module.answer = Thermogram(np.array([[20.0, 21.0], [22.0, 23.0]]), SETTINGS)

    def unpack(stream):
        assert isinstance(stream, io.BufferedIOBase)  # the library asks for that
        assert stream.read(3) == b"\xff\xd8\xff"
        if isinstance(module.answer, Exception):
            raise module.answer
        return module.answer

    module.unpack = unpack
    monkeypatch.setitem(sys.modules, "flyr", module)
    return module


@pytest.fixture
def image(tmp_path):
    path = tmp_path / "table.jpg"
    path.write_bytes(FLIR)
    return path


def test_temperatures_settings_and_time_are_taken_and_marked_as_not_verified(library, image):
    found = read_flir(image)
    assert found.temperature_c.tolist() == [[20.0, 21.0], [22.0, 23.0]]
    assert found.name == "table.jpg"
    assert found.remarks == (
        remark("flir_unverified"),
        remark("camera_settings", emissivity="0.95", reflected_c=pytest.approx(20.0)),
        remark("camera_clock", moment="2026-03-02 15:04:05"),
    )


def test_emissivity_and_reflection_go_to_the_formula_of_the_camera_in_kelvin(library, image):
    found = read_flir(image, emissivity=0.97, reflected_c=26.85)
    assert found.temperature_c[0, 0] == pytest.approx(40.0)
    said = remark("camera_settings", emissivity="0.97", reflected_c=pytest.approx(26.85))
    assert said in found.remarks


def test_without_the_library_the_error_says_how_to_install_it(monkeypatch, image):
    monkeypatch.setitem(sys.modules, "flyr", None)
    with pytest.raises(ConfigurationError) as caught:
        read_flir(image)
    assert (caught.value.code, caught.value.values) == ("package_missing", {"package": "flyr"})


def test_a_jpeg_without_temperatures_is_refused_before_the_library_is_asked(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "flyr", None)
    for content in (JPEG, b"\x89PNG\r\n\x1a\n FLIR\x00", b"20.5,21\n"):
        path = tmp_path / "photo.jpg"
        path.write_bytes(content)
        assert refusal_of(read_flir, path) == "not_radiometric"


def test_a_damaged_file_is_one_error_whatever_the_library_says(library, image):
    for error in (KeyError(1), ValueError("no"), OSError("no"), ZeroDivisionError(), IndexError()):
        library.answer = error
        assert refusal_of(read_flir, image) == "file_damaged"


def test_an_image_without_a_temperature_in_every_pixel_is_refused(library, image):
    for celsius in (np.array([[20.0, np.nan]] * 2), np.ones((2, 2, 2)), np.ones(3)):
        library.answer = Thermogram(celsius, SETTINGS)
        assert refusal_of(read_flir, image) == "pixels_without_temperature"


def test_an_image_of_more_than_100_megapixel_is_refused_before_it_is_unpacked(library, tmp_path):
    library.answer = AssertionError("must not be asked")
    path = tmp_path / "bomb.jpg"
    head = b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR" + (20_000).to_bytes(4) + (5_001).to_bytes(4)
    small = head.replace((20_000).to_bytes(4), (2).to_bytes(4))
    for pictures in (head, small + bytes(20) + head):
        path.write_bytes(FLIR + pictures + bytes(20))
        assert refusal_of(read_flir, path) == "image_too_large"


def test_a_directory_of_billions_of_records_is_refused_before_it_is_read(library, tmp_path):
    library.answer = Thermogram(np.full((2, 2), 20.0), SETTINGS)
    path = tmp_path / "endless.jpg"
    start = FLIR.index(b"FFF\x00")
    endless = FLIR[: start + 28] + b"\xff\xff\xff\xff" + FLIR[start + 32 :]
    for last_chunk in (0, 1):
        path.write_bytes(endless[: start - 1] + bytes([last_chunk]) + endless[start:])
        assert refusal_of(read_flir, path) == "file_damaged"


def test_an_impossible_emissivity_is_an_error(library, image):
    for emissivity in (0.0, -1.0, 1.5):
        assert answer_of(read_flir, image, emissivity=emissivity).endswith("not_an_emissivity")


def test_a_jpeg_is_known_by_its_first_bytes():
    assert is_jpeg(FLIR)
    assert not is_jpeg(b"20.5")
