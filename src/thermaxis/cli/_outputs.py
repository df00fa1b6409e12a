"""Outputs of commands: checked before anything is read, never over an input or each other."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from thermaxis.codes import Place
from thermaxis.errors import ConfigurationError
from thermaxis.report import write_bytes

_MOST_KEPT = 1000
REPORT_SUFFIXES = (".pdf", ".html", ".htm")

Named = tuple[str, Path | str | None]


def check_outputs(
    written: Iterable[Named],
    read: Iterable[Path | str | None],
    *,
    charts: Path | None = None,
    report_suffixes: Sequence[str] = REPORT_SUFFIXES,
) -> None:
    """Refuse an output that would overwrite what is read or another output, or has no folder.

    `written` are options with what they name; None is not asked for, and ``-`` is standard output.
    """
    inputs = [Path(name) for name in read if name is not None]
    outputs = [(option, name) for option, name in written if name is not None and name != "-"]
    for number, (option, name) in enumerate(outputs):
        path, place = Path(name), Place(file=str(name), key=option)
        if str(name) == "":
            raise ConfigurationError("no_name", place=place)
        if not path.absolute().parent.is_dir():
            raise ConfigurationError("folder_missing", place=place)
        if path.is_dir():
            raise ConfigurationError("is_a_folder", place=place)
        if any(_same(path, other) for other in inputs):
            raise ConfigurationError("output_is_input", place=place)
        if any(_same(path, Path(other)) for _, other in outputs[:number]):
            raise ConfigurationError("outputs_have_one_name", place=place)
        if option == "--report" and path.suffix.lower() not in report_suffixes:
            raise ConfigurationError("report_suffix", place=place, suffix=path.suffix or path.name)
    if charts is not None and charts.is_file():
        raise ConfigurationError("charts_need_folder", file=charts, key="--figures")


def _same(one: Path, other: Path) -> bool:
    if one.exists() and other.exists():
        return one.samefile(other)
    return one.absolute() == other.absolute()


def check_table_name(name: str) -> None:
    """Refuse standard output in place of a file for the control: the summary goes there."""
    if name in {"", "-"}:
        raise ConfigurationError("no_name", key="-o")


def check_csv_name(path: Path) -> None:
    """Refuse a name of another format for a log that is written as CSV."""
    if path.suffix.lower() in {".parquet", ".xlsx", ".mat", ".tdms", ".json"}:
        raise ConfigurationError("written_as_csv", file=path)


def keep_older(output: str, text: str) -> str | None:
    """Keep what stands in the place of a table that is to be written, under another name."""
    path, place = Path(output), Place(file=output)
    if not path.is_file():
        return None
    try:
        older = path.read_bytes()
        if older == text.encode("ascii"):
            return None
        for number in range(1, _MOST_KEPT):
            kept = path.with_name(f"{path.name}.old-{number}")
            if not kept.exists():
                kept.write_bytes(older)
                return str(kept)
    except OSError as error:
        cause = error.strerror or type(error).__name__
        raise ConfigurationError("older_table_not_kept", place=place, cause=cause) from None
    raise ConfigurationError("too_many_older_tables", place=place, tables=_MOST_KEPT - 1)


def write_ascii(output: str, text: str) -> None:
    """Write a program or table."""
    write_bytes(Path(output), text.encode("ascii"))
