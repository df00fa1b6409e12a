"""Wheel and sdist are built, checked by the programs of others, and carry what they must."""

import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.system


@pytest.fixture(scope="module")
def packages(root: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("dist")
    words = [sys.executable, "-m", "build", "--outdir", folder, root]
    subprocess.run(words, check=True, capture_output=True)
    (wheel,), (sdist,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    return wheel, sdist


def test_the_checkers_of_others_have_nothing_against_them(packages: tuple[Path, Path]) -> None:
    bin_ = Path(sys.executable).parent
    for words in (
        [bin_ / "twine", "check", "--strict", *packages],
        [bin_ / "check-wheel-contents", packages[0]],
    ):
        done = subprocess.run(words, check=False, capture_output=True, text=True)
        assert done.returncode == 0, done.stdout


def test_they_carry_pages_catalogues_types_and_the_licence(packages: tuple[Path, Path]) -> None:
    wheel, sdist = packages
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {"thermaxis/py.typed", "thermaxis/positioning/__init__.pyi"} <= names
    for part in ("messages/cs/", "app/pages/", "web/static/", "plc/library/", "screen/pages/"):
        assert any(name.startswith(f"thermaxis/{part}") for name in names), part
    assert any(name.endswith("licenses/LICENSE") for name in names)
    assert not any(name.startswith(("tests", "docs")) for name in names)
    assert wheel.stat().st_size < 4_000_000
    with tarfile.open(sdist) as packed:
        held = {name.partition("/")[2] for name in packed.getnames()}
    assert {"Makefile", "CITATION.cff", "SECURITY.md", "docs/index.md", "constraints.txt"} <= held
