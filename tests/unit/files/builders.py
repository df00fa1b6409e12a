"""One run as every format of files has it."""

import io
import tempfile
from datetime import datetime
from pathlib import Path

import numpy as np
import openpyxl

from tests.unit.files.old_workbook import old_workbook
from thermaxis.files import format_tidy_csv, write_rtl
from thermaxis.files.table import SourceText
from thermaxis.messages import sentence_of
from thermaxis.positioning import PositioningTest, StartEnd, TimeSource
from thermaxis.quantities import AxisKind


def remarks_of(read: PositioningTest | SourceText) -> tuple[str, ...]:
    """Return the remarks of a reader as sentences."""
    return tuple(map(sentence_of, read.remarks))


def example(kind: AxisKind = AxisKind.LINEAR) -> PositioningTest:
    """A small run with everything that a file can say."""
    targets, cycles = 6, 3
    random_part = np.random.default_rng(11).normal(0.0, 1.5, (targets, cycles, 2))
    deviation = np.round(random_part + np.linspace(-4, 9, targets)[:, None, None], 3)
    place = np.stack((np.arange(targets), 2 * targets - 1 - np.arange(targets)), axis=-1)
    order = place[:, None, :] + 2 * targets * np.arange(cycles)[None, :, None] + 1.0
    return PositioningTest(
        kind=kind,
        target=np.array([-40.0, -10.5, 0.0, 31.25, 60.0, 95.0]),
        deviation=deviation,
        time_source=TimeSource.FILE,
        time_s=(order - 1) * 7.5,
        order=order,
        start=datetime(2026, 3, 2, 8, 0),  # noqa: DTZ001  files state local time
        end=datetime(2026, 3, 2, 8, 5),  # noqa: DTZ001  files state local time
        channels={"motor temperature": np.round(20 + order / 50, 2)},
        environment={"air_temperature_c": StartEnd(20.3, 20.6)},
        header={"machine": "Čapek & söhne", "axis": "X", "title": '=1+2, "quoted"'},
    )


def tidy() -> bytes:
    return format_tidy_csv(example()).encode()


def foreign_tidy() -> bytes:
    """As another program might write it: semicolons, decimal commas, units in brackets."""
    test = example()
    lines = [
        "Machine: MCV 750",
        "Serial No;12-345",
        "",
        "Run;Target (mm);Error (µm);Measured [mm];Time",
    ]
    for run in range(1, 7):
        for k in range(6):
            i = k if run % 2 else 5 - k
            target, deviation = test.target[i], test.deviation[i, (run - 1) // 2, (run + 1) % 2]
            numbers = f"{target:.2f};{deviation:.3f};{target + deviation / 1000:.6f}"
            moment = f"2026-03-02 08:{run:02}:{6 * k:02}"
            lines.append(f"{run};{numbers.replace('.', ',')};{moment}")
    return "\r\n".join(lines).encode("cp1250")


def wide() -> bytes:
    test = example(AxisKind.ROTARY)
    lines = ["# unit: arcsec", "# header title: wide", "target_deg,1,2,3,4,5,6,note"]
    for target, row in zip(test.target, test.deviation.reshape(6, 6), strict=True):
        lines.append(f"{target}," + ",".join(map(str, row)) + ",")
    return "\n".join(lines).encode()


def dat() -> bytes:
    test = example()
    lines = ["TEST_DATA=# made for a test", "UNIT=mm", "CYCLES=3", "POSITIONS=6", "DEC=5"]
    lines += [f"TGT_DATA[{i + 1}]={target}" for i, target in enumerate(test.target)]
    for name, approach in (("FWD", 0), ("BWD", 1)):
        for (i, j), value in np.ndenumerate(test.deviation[:, :, approach]):
            lines.append(f"REF_DATA_{name}[{i + 1},{j + 1}]={test.target[i] + value / 1000:.9f}")
    return "\n".join(lines).encode()


def rtl() -> bytes:
    path = Path(tempfile.mkdtemp()) / "run.rtl"
    write_rtl(example(), path)
    content = path.read_bytes()
    path.unlink()
    path.parent.rmdir()
    return content


def workbook(rows: list[list[object]], *, formula: bool = False) -> bytes:
    book = openpyxl.Workbook()
    sheet = book.active
    for row in rows:
        sheet.append(row)
    if formula:
        sheet["J2"] = "=SUM(A2:A9)"
    stream = io.BytesIO()
    book.save(stream)
    return stream.getvalue()


def tidy_workbook() -> bytes:
    test = example()
    rows: list[list[object]] = [["cycle", "direction", "target_mm", "deviation_um", "time"]]
    for i, j, a in np.ndindex(6, 3, 2):
        moment = datetime(2026, 3, 2, 8, j, 6 * (i if a == 0 else 5 - i), 500_000 * a)  # noqa: DTZ001  files state local time
        rows.append([j + 1, ("+", "-")[a], test.target[i], test.deviation[i, j, a], moment])
    return workbook(rows, formula=True)


def wide_workbook() -> bytes:
    test = example()
    rows: list[list[object]] = [["Target (mm)", *(f"Run {run} (µm)" for run in range(1, 7))]]
    runs = test.deviation.reshape(6, 6).tolist()
    rows += [[target, *row] for target, row in zip(test.target, runs, strict=True)]
    return workbook(rows)


def an_old_workbook() -> bytes:
    test = example()
    rows = test.deviation.reshape(6, 6).tolist()
    table = [[target, *row] for target, row in zip(test.target.tolist(), rows, strict=True)]
    return old_workbook([["Target (mm)", *(f"Run {run} (µm)" for run in range(1, 7))], *table])


MADE = {
    "tidy": tidy,
    "foreign tidy": foreign_tidy,
    "wide": wide,
    "dat": dat,
    "rtl": rtl,
    "tidy workbook": tidy_workbook,
    "wide workbook": wide_workbook,
    "old workbook": an_old_workbook,
}
"""The content of a file of each format."""
