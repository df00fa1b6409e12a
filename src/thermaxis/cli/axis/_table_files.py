"""Files of compensation tables and NC programs: read with limits, never overwritten by mistake."""

from collections.abc import Sequence
from pathlib import Path

from thermaxis.controls import LARGEST_TABLE_BYTES, check_size
from thermaxis.errors import ConfigurationError, MeasurementFileError
from thermaxis.report import write_bytes

_BYTE_ORDER_MARKS = (b"\xff\xfe", b"\xfe\xff")
_MOST_KEPT = 1000


def read_table_text(path: Path | str) -> tuple[str, tuple[str, ...]]:
    """Read the text of a control's table."""
    name = str(path)
    try:
        if Path(path).exists() and not Path(path).is_file():
            raise MeasurementFileError(
                "this is not a regular file", path=name, remedy="Name the file of the table"
            )
        with Path(path).open("rb") as stream:
            content = stream.read(LARGEST_TABLE_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL character in the name
        reason = error.strerror if isinstance(error, OSError) else None
        raise MeasurementFileError(
            f"the table cannot be read ({reason or type(error).__name__})",
            path=name,
            remedy="Check its name and that it may be read",
        ) from None
    check_size(content, name)
    if content.startswith(_BYTE_ORDER_MARKS) or b"\0" in content:
        raise MeasurementFileError(
            "the file is no plain text (UTF-16, or binary)",
            path=name,
            remedy="Save it as plain ASCII text, as the control reads it",
        )
    findings: list[str] = []
    marked = content.startswith(b"\xef\xbb\xbf")
    if marked:
        findings.append("the file begins with a byte order mark, which a control may not skip")
    strange = next(
        (k for k, byte in enumerate(content) if byte > 127 and (k > 2 or not marked)), None
    )
    if strange is not None:
        line = content.count(b"\n", 0, strange) + 1
        findings.append(f"line {line} has letters outside of ASCII, which a control may not read")
    return content.decode("latin-1"), tuple(findings)


def check_output(
    output: str, *, inputs: Sequence[Path | str], what: str = "an input", option: str = "-o"
) -> None:
    """Refuse an output that is an input, a folder, or in no folder."""
    path = Path(output)
    if output in {"", "-"}:
        raise ConfigurationError(
            "the output has no name",
            where=option,
            remedy="Name a file; the summary goes to standard output",
        )
    if path.is_dir() or not path.absolute().parent.is_dir():
        raise ConfigurationError(
            "this is a folder, or its folder does not exist",
            where=output,
            remedy="Name a file in a folder that exists",
        )
    if path.exists() and any(Path(f).exists() and path.samefile(f) for f in inputs):
        raise ConfigurationError(
            f"this output would overwrite {what}", where=output, remedy="Give it another name"
        )


def keep_older(output: str, text: str) -> str | None:
    """Keep what stands in the place of a table that is to be written, under another name."""
    path = Path(output)
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
        raise ConfigurationError(
            "the table that stands there cannot be kept"
            f" ({error.strerror or type(error).__name__})",
            where=output,
            remedy="Give the new table another name",
        ) from None
    raise ConfigurationError(
        f"{_MOST_KEPT - 1} older tables are kept beside it already",
        where=output,
        remedy="Move them to another place",
    )


def write_ascii(output: str, text: str) -> None:
    """Write a program or table."""
    write_bytes(Path(output), text.encode("ascii"))
