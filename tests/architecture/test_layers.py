"""A forbidden import is caught by the contracts; that they hold, `make lint` says."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

CHECK = "from importlinter.cli import lint_imports; import sys; sys.exit(lint_imports())"


def lint_imports(folder: Path) -> tuple[int, str]:
    """Run the contracts on the package that lies in a folder."""
    run = subprocess.run(
        [sys.executable, "-c", CHECK],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    return run.returncode, run.stdout + run.stderr


@pytest.fixture
def package_copy(root: Path, tmp_path: Path) -> Path:
    """Return a folder with a copy of the package and its contracts."""
    shutil.copytree(
        root / "src" / "thermaxis",
        tmp_path / "thermaxis",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    shutil.copy(root / "pyproject.toml", tmp_path)
    return tmp_path


def add_line(path: Path, line: str) -> None:
    path.write_text(path.read_text(encoding="utf-8") + f"\n{line}\n", encoding="utf-8")


FORBIDDEN = (
    ("positioning/standard/_iso230_2.py", "thermaxis.files", "one way"),
    ("files/table/_source.py", "thermaxis.report", "one way"),
    ("report/_limits_check.py", "thermaxis.cli", "one way"),
    ("quantities.py", "thermaxis.positioning", "one way"),
    ("positioning/standard/_iso230_2.py", "csv", "pure layers"),
    ("positioning/standard/_spread_anomaly.py", "logging", "pure layers"),
    ("cli/axis/evaluate.py", "matplotlib", "report layer"),
    ("files/runs/tidy_csv.py", "typst", "report layer"),
)


def test_every_forbidden_import_is_caught(package_copy: Path) -> None:
    for module, imported, _ in FORBIDDEN:
        add_line(package_copy / "thermaxis" / module, f"import {imported}")
    code, printed = lint_imports(package_copy)
    assert code == 1, printed
    for module, imported, broken in FORBIDDEN:
        assert re.search(rf"{broken}.* BROKEN", printed), printed
        named = "thermaxis." + module.removesuffix(".py").replace("/", ".")
        assert re.search(rf"{named} -> {imported}\b", printed), (module, imported)


def test_a_folder_without_a_place_among_the_layers_is_caught(package_copy: Path) -> None:
    folder = package_copy / "thermaxis" / "elsewhere"
    folder.mkdir()
    (folder / "__init__.py").write_text("", encoding="utf-8")
    code, printed = lint_imports(package_copy)
    assert code != 0
    assert "elsewhere" in printed


def test_a_rule_that_is_left_out_has_its_reason_beside_it(root: Path) -> None:
    bare = re.compile(r"# (?:noqa(?:: [A-Z0-9, ]+)?|\w+: ignore(?:\[[\w, -]*\])?)$")
    files = (path for of in ("src", "tests", "benchmarks") for path in (root / of).rglob("*.py"))
    lines = ((path, line) for path in files for line in path.read_text("utf-8").splitlines())
    assert [f"{path}: {line}" for path, line in lines if bare.search(line)] == []
