"""The Markdown pages and the tracked files, as the tests of the documentation see them."""

import shutil
import subprocess
from pathlib import Path

import pytest

LEFT_OUT = {".venv", ".git", "build", "dist", "demo"}


def _without_git(root: Path) -> list[Path]:
    return [
        path
        for path in sorted(root.rglob("*"))
        if path.is_file()
        and not LEFT_OUT & set(path.relative_to(root).parts)
        and "cache" not in str(path.relative_to(root))
    ]


@pytest.fixture(scope="session")
def tracked_files(root: Path) -> list[Path]:
    """Return every file that is or would be under version control."""
    git = shutil.which("git")
    if git is None or not (root / ".git").exists():
        return _without_git(root)
    listed = subprocess.run(
        [git, "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=root,
        capture_output=True,
        check=True,
    )
    paths = [root / name for name in listed.stdout.decode().split("\0") if name]
    return [path for path in paths if path.is_file()]


@pytest.fixture(scope="session")
def pages(tracked_files: list[Path]) -> dict[Path, str]:
    """Return the text of every Markdown page."""
    return {
        path: path.read_text(encoding="utf-8") for path in tracked_files if path.suffix == ".md"
    }


@pytest.fixture(scope="session")
def documentation(root: Path, pages: dict[Path, str]) -> str:
    """Return all pages in docs/ as one text."""
    return "\n".join(text for path, text in pages.items() if (root / "docs") in path.parents)
