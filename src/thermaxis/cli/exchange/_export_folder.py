"""The folder of an export: written whole or not at all, nothing else is overwritten."""

import json
import shutil
import tempfile
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import cast

from thermaxis.errors import ConfigurationError
from thermaxis.plc.guide import REPORT_ENDING, REPORT_FORMAT, REPORT_HASH, report_sha256

_LARGEST_REPORT_BYTES = 5_000_000


def require_folder(folder: Path) -> None:
    """Refuse a folder that holds anything but an older export that nobody has changed."""
    if not folder.absolute().parent.is_dir():
        raise ConfigurationError("folder_missing", file=folder)
    if not folder.exists() and not folder.is_symlink():
        return
    if not folder.is_dir() or folder.is_symlink():
        raise ConfigurationError("not_a_folder", file=folder)
    _require_own(folder, folder)


def _require_own(lies_in: Path, folder: Path) -> None:
    """Refuse what is no older export that nobody has changed; errors name the folder."""
    lying = {entry.name: entry for entry in lies_in.iterdir()}
    if not lying:
        return
    known = _own_files(lying)
    foreign = sorted(set(lying) - set(known))
    if foreign:
        raise ConfigurationError("folder_holds_foreign_file", file=folder, name=foreign[0])
    for name, digest in known.items():
        if name in lying and digest and _hash(lying[name]) != digest:
            raise ConfigurationError("exported_file_changed", file=folder, name=name)


def _own_files(lying: Mapping[str, Path]) -> dict[str, str]:
    """Return names and hashes of an older export; that of its report is empty if it is right."""
    reports = [name for name in lying if name.endswith(REPORT_ENDING)]
    if len(reports) != 1 or not lying[reports[0]].is_file():
        return {}
    with lying[reports[0]].open("rb") as stream:
        content = stream.read(_LARGEST_REPORT_BYTES)
    try:
        report: object = json.loads(content)
    except (ValueError, RecursionError):
        return {}
    if not isinstance(report, dict):
        return {}
    found = cast("dict[str, object]", report)
    files = found.get("files")
    if found.get("format") != REPORT_FORMAT or not isinstance(files, dict):
        return {}
    named = cast("dict[str, object]", files)
    # A report of an older version has no hash of its own, and nothing is known of it.
    own = found.get(REPORT_HASH)
    right = own is not None and own == report_sha256(found)
    return {
        reports[0]: "" if right else "another",
        **{name: str(digest) for name, digest in named.items()},
    }


def _hash(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest() if path.is_file() else "no file"


def write_folder(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write files into a folder that `require_folder` takes.

    They are written beside it first; then the whole takes its place. What lay there is looked at
    once more when nobody finds it under its name any more, and only then removed; whatever ends
    the swap before puts it back.
    """
    require_folder(folder)
    place = folder.absolute()
    try:
        whole = Path(tempfile.mkdtemp(prefix=f".{place.name[:40]}.", dir=place.parent))
    except OSError as error:
        raise _unwritten(folder, error) from None
    new, old, done = whole / "new", whole / "old", False
    try:
        new.mkdir()
        for name, content in files.items():
            (new / name).write_bytes(content)
        if place.exists():
            place.replace(old)
            _require_own(old, folder)
        new.replace(place)
        done = True
    except OSError as error:
        raise _unwritten(folder, error) from None
    finally:
        # After an error, or Ctrl-C, what lay there goes back to its place.
        if old.exists() and not done and not place.exists():
            old.replace(place)
        if done or not old.exists():
            shutil.rmtree(whole, ignore_errors=True)


def _unwritten(folder: Path, error: OSError) -> ConfigurationError:
    return ConfigurationError(
        "folder_unwritable", file=folder, cause=error.strerror or type(error).__name__
    )
