"""Files as people have them: one run in many forms, and what becomes of each."""

import io
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta

import numpy as np
import openpyxl

from tests.unit.files.old_workbook import old_workbook
from thermaxis.files import RunColumn, RunMapping

CYCLES = 3
TARGETS = np.array([0.0, 150.5, 300.0, 451.25, 600.0, 1200.0])
_RNG = np.random.default_rng(20261122)
DEVIATION = np.round(
    _RNG.normal(0.0, 1.2, (6, CYCLES, 2))
    + np.linspace(-6, 11, 6)[:, None, None]
    + np.array([0.0, -2.4]),
    2,
)
"""Deviations by target, cycle and approach. [µm]"""
BEGIN = datetime(2026, 11, 20, 11, 58, 20)  # noqa: DTZ001  files state local time
STEP_S = 9.5
STOPS = [
    (i, j, a)
    for j in range(CYCLES)
    for a in range(2)
    for i in (range(6) if a == 0 else reversed(range(6)))
]
"""Target, cycle and approach of the readings in the order of acquisition."""
WORDS = ("forward", "backward")


@dataclass(frozen=True)
class Nasty:
    """A file and what becomes of it."""

    name: str
    content: bytes
    refused: str = ""
    """Code of the error; empty where it is read."""
    mapping: RunMapping = field(default_factory=RunMapping)
    """With it the file is read."""
    missing: tuple[tuple[int, int, int], ...] = ()
    """Readings that are not there."""
    timed: bool = False
    """Whether its times are read."""
    other: bool = False
    """Whether it holds another run."""


def number(value: float, decimal: str = ".") -> str:
    """Write a number as spreadsheets do."""
    return f"{value:g}".replace(".", decimal)


def moments() -> list[datetime]:
    """Times of the readings."""
    return [BEGIN + timedelta(seconds=STEP_S * k) for k in range(len(STOPS))]


Row = Sequence[object]


def tidy(decimal: str = ".", words: Sequence[str] = WORDS) -> list[list[str]]:
    """Rows of cycle, direction, target and deviation."""
    return [
        [str(j + 1), words[a], number(TARGETS[i], decimal), number(DEVIATION[i, j, a], decimal)]
        for i, j, a in STOPS
    ]


def wide(columns: Sequence[tuple[int, int]], decimal: str = ".") -> list[list[str]]:
    """Rows of a target and its deviations in the passes of the columns."""
    return [
        [number(t, decimal), *(number(DEVIATION[i, j, a], decimal) for j, a in columns)]
        for i, t in enumerate(TARGETS)
    ]


PASSES = [(j, a) for j in range(CYCLES) for a in range(2)]
BY_SIDE = [(j, a) for a in range(2) for j in range(CYCLES)]
HEAD = ["cycle", "direction", "target_mm", "deviation_um"]


def text(rows: Iterable[Row], delimiter: str = ";") -> bytes:
    """Write rows of cells as text."""
    lines = (delimiter.join("" if c is None else str(c) for c in row) for row in rows)
    return "".join(f"{line}\n" for line in lines).encode()


def book(*sheets: Iterable[Row], merge: Sequence[str] = ()) -> bytes:
    """Write rows of cells as a workbook."""
    workbook = openpyxl.Workbook()
    workbook.remove(workbook.active)
    for rows in sheets:
        sheet = workbook.create_sheet()
        for row in rows:
            sheet.append(list(row))
        for cells in merge:
            sheet.merge_cells(cells)
    stream = io.BytesIO()
    workbook.save(stream)
    return stream.getvalue()


def markdown(rows: Sequence[Row]) -> bytes:
    """Write rows as a Markdown table."""
    lines = ["| " + " | ".join(map(str, row)) + " |" for row in rows]
    lines.insert(1, "|" + "---|:-:" * (len(rows[0]) // 2) + "|--:" * (len(rows[0]) % 2) + "|")
    return ("# Run of the X axis\n\n" + "\n".join(lines) + "\n").encode()


def turned(rows: Sequence[Row]) -> list[Row]:
    """Exchange rows and columns."""
    return list(zip(*rows, strict=True))


def numbers(rows: Iterable[Row]) -> list[list[object]]:
    """Make numbers of cells that are some."""

    def cell(value: object) -> object:
        try:
            return float(str(value))
        except ValueError:
            return value

    return [[cell(value) for value in row] for row in rows]


def timed(form: Callable[[datetime], str], heading: str = "time") -> list[list[str]]:
    """Tidy rows with times in a form."""
    at = map(form, moments())
    return [[*HEAD, heading], *([*row, when] for row, when in zip(tidy(), at, strict=True))]


def changed(rows: list[list[str]], row: int, column: int, cell: str) -> list[list[str]]:
    """Put another text into a cell."""
    return [
        [cell if (r, c) == (row, column) else one for c, one in enumerate(cells)]
        for r, cells in enumerate(rows)
    ]


def encoder(scale: float) -> list[list[str]]:
    """Tidy rows whose targets are measured each time."""
    noise = np.random.default_rng(5).uniform(-scale, scale, len(STOPS))
    rows = tidy()
    for row, shift in zip(rows, noise, strict=True):
        row[2] = f"{float(row[2]) + shift:.5f}"
    return rows


def _summaries() -> list[Nasty]:
    rows = tidy()
    sheet = [["Target (mm)", *(f"Run {k + 1} (µm)" for k in range(6))], *wide(PASSES)]
    means = DEVIATION.mean(axis=0).reshape(-1)
    mean = [[word, *(number(round(m, 2)) for m in means)] for word in ("Mittelwert", "2s", "Max.")]
    return [
        Nasty(
            "summary below (csv)",
            text([HEAD, *rows, ["Mean", "", "", "1.2"], ["Std", "", "", "2"]]),
        ),
        Nasty("summary in short rows", text([HEAD, *rows, [], ["Mean", "1.2"], ["Range", "9.9"]])),
        Nasty("summary below (wide xlsx)", book(numbers([*sheet, [], *mean]))),
        Nasty(
            "summary beside and below",
            text([[*r, "0"] for r in [[*sheet[0][:-1], sheet[0][-1]], *sheet[1:], *mean]]).replace(
                b";0\n", b";Mean\n", 1
            ),
        ),
        Nasty("text below", text([HEAD, *rows, ["Measured by J. N."], ["Page 1 of 1"]])),
        Nasty(
            "summary after each cycle",
            text(
                [
                    HEAD,
                    *(
                        row
                        for k in range(3)
                        for row in [*rows[12 * k : 12 * k + 12], ["", "", f"Mittel {k + 1}", "3.3"]]
                    ),
                ]
            ),
        ),
        Nasty(
            "summary without a word",
            text([HEAD, *rows, ["", "", "", "3.31"]]),
            "row_incomplete",
            RunMapping(last_row=37),
        ),
        Nasty(
            "word between readings",
            text([HEAD, *rows[:9], ["laser", "x", "re-aligned", "here"], *rows[9:]]),
            "not_a_number",
        ),
    ]


def _missing() -> list[Nasty]:
    gone = STOPS[4]
    cases = [
        Nasty(f"missing: {word}", text([HEAD, *changed(tidy(), 4, 3, word)]), missing=(gone,))
        for word in ("NaN", "n/a", "---", "#N/A", "BEAM BREAK", "Strahlunterbrechung", "")
    ]
    first = [[d, c, w, t] for c, w, t, d in changed(tidy(), 4, 3, "#N/A")]
    runs = wide(PASSES)
    return [
        *cases,
        Nasty("#N/A begins the line", text([["deviation_um", *HEAD[:3]], *first]), missing=(gone,)),
        Nasty(
            "missing in a wide table",
            text([["Target (mm)", *range(1, 7)], *changed(runs, 2, 3, "n/a")]),
            missing=((2, 1, 0),),
        ),
        Nasty(
            "#N/A in a workbook",
            book([HEAD, *numbers(changed(tidy(), 4, 3, "#N/A"))]),
            missing=(gone,),
        ),
        Nasty("missing target", text([HEAD, *changed(tidy(), 4, 2, "")]), "row_incomplete"),
    ]


def _heads() -> list[Nasty]:
    target = "Ziel (mm)"
    sides = ["", "Vorwärts", "", "", "Rückwärts", "", ""]
    count = [1, 2, 3, 1, 2, 3]
    pairs = ["", "Zyklus 1", "", "Zyklus 2", "", "Zyklus 3", ""]
    nm = [[r[0], *(number(round(1000 * float(c), 3)) for c in r[1:])] for r in wide(BY_SIDE)]
    blocks = [
        row
        for a, word in enumerate(("Vorwärts", "Rückwärts"))
        for row in [[word], [target, 1, 2, 3], *wide([(j, a) for j in range(3)]), []]
    ]
    lists = [
        row
        for k, (j, a) in enumerate(PASSES)
        for row in [
            [f"Lauf {k + 1} ({('hin', 'zurück')[a]})"],
            *([["Soll (mm)", "Abweichung (µm)"]] if not k else []),
            *([r[2], r[3]] for r in tidy()[6 * k : 6 * k + 6]),
        ]
    ]
    semi = [
        ["Cycle", target, "Forward (µm)", "Backward (µm)"],
        *(
            [j + 1, number(t), number(DEVIATION[i, j, 0]), number(DEVIATION[i, j, 1])]
            for j in range(3)
            for i, t in enumerate(TARGETS)
        ),
    ]
    return [
        *(
            Nasty(
                f"merged heads {forward} | {backward} over numbers",
                text(
                    [
                        ["", forward, "", "", backward, "", ""],
                        [target, *count],
                        *wide(BY_SIDE),
                    ]
                ),
            )
            for forward, backward in (("pos", "neg"), ("+", "-"))
        ),
        Nasty("merged heads over numbers", text([sides, [target, *count], *wide(BY_SIDE)])),
        Nasty(
            "merged heads in a workbook",
            book(
                [[c or None for c in sides], [target, *count], *numbers(wide(BY_SIDE))],
                merge=["B1:D1", "E1:G1"],
            ),
        ),
        Nasty(
            "numbers below the words", text([[target, *sides[1:]], ["", *count], *wide(BY_SIDE)])
        ),
        *(
            Nasty(
                f"merged heads with {unit} over numbers",
                text(
                    [[target, *(f"{c} {unit}" if c else c for c in sides[1:])], ["", *count], *nm]
                ),
            )
            for unit in ("[nm]", "nm")
        ),
        Nasty(
            "the unit of the targets beside the numbers",
            text([[target, *sides[1:]], ["mm", *count], *wide(BY_SIDE)]),
        ),
        Nasty(
            "cycles with unit over directions",
            text(
                [
                    [f"{c} [µm]" if c else c for c in pairs],
                    [target, *["vor", "zurück"] * 3],
                    *wide(PASSES),
                ]
            ),
        ),
        Nasty(
            "a caption with the unit above each block",
            text(
                [
                    ["Forward deviations in nm"],
                    [target, 1, 2, 3],
                    *[[one, *cells[:3]] for one, *cells in nm],
                    [],
                    ["Backward deviations in nm"],
                    [target, 1, 2, 3],
                    *[[one, *cells[3:]] for one, *cells in nm],
                ]
            ),
        ),
        Nasty(
            "cycles over directions",
            text([pairs, [target, *["vor", "rück"] * 3], *wide(PASSES)]),
        ),
        *(
            Nasty(
                f"{' and '.join(words)} with numbers",
                text([[target, *(f"{w} {k}" for k in (1, 2, 3) for w in words)], *wide(PASSES)]),
            )
            for words in (
                ("Hin", "Her"),
                ("Go", "Return"),
                ("aller", "retour"),
                ("cw", "ccw"),
                ("Tam", "Zpět"),
            )
        ),
        Nasty(
            "words for the way back that nobody knows",
            text(
                [
                    [target, *(f"{w} {k}" for w in ("Hin", "Kulku") for k in (1, 2, 3))],
                    *wide(BY_SIDE),
                ]
            ),
            "column_like_runs",
            RunMapping(
                columns={f"Kulku {k}": RunColumn(cycle=k, direction="backward") for k in (1, 2, 3)}
            ),
        ),
        Nasty(
            "units in a third row",
            text(
                [
                    [target, *sides[1:]],
                    ["", *count],
                    ["mm", *["nm"] * 6],
                    *nm,
                ]
            ),
        ),
        Nasty("F1 B1", text([[target, "F1", "B1", "F2", "B2", "F3", "B3"], *wide(PASSES)])),
        Nasty("1+ 1-", text([[target, "1+", "1-", "2+", "2-", "3+", "3-"], *wide(PASSES)])),
        Nasty(
            "forward 1 to 3, backward 1 to 3",
            text(
                [
                    [target, *(f"{w} {k} (µm)" for w in ("Forward", "Reverse") for k in (1, 2, 3))],
                    *wide(BY_SIDE),
                ]
            ),
        ),
        Nasty(
            "F1 F2 F3 alone",
            text([[target, "F1", "F2", "F3"], *wide([(j, 0) for j in range(3)])]),
            "run_headings_incomplete",
            RunMapping(
                columns={f"F{k}": RunColumn(cycle=k, direction="forward") for k in (1, 2, 3)}
            ),
            missing=tuple((i, j, 1) for i in range(6) for j in range(3)),
        ),
        Nasty("blocks of forward and backward", text(blocks)),
        Nasty("blocks in a workbook", book(numbers(blocks))),
        Nasty("a block for each pass", text(lists)),
        Nasty("a column for each direction", text(semi)),
        Nasty(
            "a column for each direction, one unknown",
            text(semi).replace(b"Backward", b"Kulku"),
            "column_like_runs",
        ),
        Nasty(
            "transposed, wide",
            text(
                turned([["Target (mm)", *(f"Run {k + 1} (µm)" for k in range(6))], *wide(PASSES)])
            ),
        ),
        Nasty("transposed, tidy, in a workbook", book(numbers(turned([HEAD, *tidy()])))),
        Nasty(
            "transposed, bare numbers", text(turned([["Target (mm)", *range(1, 7)], *wide(PASSES)]))
        ),
        Nasty(
            "runs or targets",
            text([["target_mm", 1, 2], [1, 0.5, 0.7], [2, 0.6, 0.9], [3, 0.1, 0.2]]),
            "runs_or_targets",
        ),
        Nasty("Markdown, tidy", markdown([HEAD, *tidy()])),
        Nasty("Markdown, wide", markdown([["Target (mm)", *range(1, 7)], *wide(PASSES)])),
        Nasty(
            "Pos. Soll, Pos.-Abw.",
            text(
                [
                    ["Zyklus", "Richtung", "Pos. Soll [mm]", "Pos.-Abw. [µm]"],
                    *tidy(",", ("hin", "zurück")),
                ]
            ),
        ),
    ]


def _numbers() -> list[Nasty]:
    grouped = [
        [
            c,
            w,
            f"{TARGETS[i]:,.3f}".replace(",", "X").replace(".", ",").replace("X", "."),
            d.replace(".", ","),
        ]
        for (c, w, _, d), (i, _, _) in zip(tidy(), STOPS, strict=True)
    ]
    english = [
        [c, w, f'"{TARGETS[i]:,.2f}"', d]
        for (c, w, _, d), (i, _, _) in zip(tidy(), STOPS, strict=True)
    ]
    either = [
        [c, w, f"{1 + k % 6}.{k % 6 * 100 + 100}", f"{1 + k}.125"]
        for k, (c, w, _, _) in enumerate(tidy())
    ]
    mixed = changed(tidy(","), 3, 3, "1.5")
    return [
        Nasty("1.200,000", text([HEAD, *grouped])),
        Nasty("1,200.00 in quotation marks", text([HEAD, *english], ",")),
        Nasty(
            "1 200,000",
            text([HEAD, *([c, w, t.replace(".", "\u00a0"), d] for c, w, t, d in grouped)]),
        ),
        Nasty(
            "1'200.000",
            text(
                [
                    HEAD,
                    *(
                        [c, w, t.replace(".", "'").replace(",", "."), d.replace(",", ".")]
                        for c, w, t, d in grouped
                    ),
                ]
            ),
        ),
        Nasty("1.100 and 1.125 only", text([HEAD, *either]), "decimal_sign_unclear"),
        Nasty("point and comma mixed", text([HEAD, *mixed]), "decimal_signs_mixed"),
        Nasty(
            "targets of an encoder",
            text([HEAD, *encoder(2e-4)]),
            "targets_nearly_equal",
            RunMapping(target_tolerance=0.001),
        ),
        Nasty(
            "unit above the headings",
            text(
                [
                    ["Unit of positions: mm"],
                    ["Unit of deviations: µm"],
                    ["cycle", "direction", "target", "deviation"],
                    *tidy(),
                ]
            ),
        ),
        Nasty(
            "no unit at all",
            text([["cycle", "direction", "target", "deviation"], *tidy()]),
            "unit_not_stated",
            RunMapping(position_unit="mm", deviation_unit="um"),
        ),
        Nasty(
            "one unit for both",
            text([["Units: mm"], ["cycle", "direction", "target", "deviation"], *tidy()]),
            "unit_not_stated",
            RunMapping(position_unit="mm", deviation_unit="um"),
        ),
        Nasty(
            "units mm/µm",
            text([["Units: mm/µm"], ["cycle", "direction", "target", "deviation"], *tidy()]),
        ),
        Nasty(
            "headings of another language",
            text([["kör", "irány", "hely", "hiba"], *tidy()]),
            "run_headings_incomplete",
            RunMapping(
                columns={
                    "kör": RunColumn("cycle"),
                    "irány": RunColumn("direction"),
                    "hely": RunColumn("target", "mm"),
                    "hiba": RunColumn("deviation", "um"),
                }
            ),
        ),
        Nasty(
            "directions of another language",
            text([HEAD, *tidy(words=("oda", "vissza"))]),
            "not_a_direction",
            RunMapping(directions={"oda": "forward", "vissza": "backward"}),
        ),
        Nasty(
            "motor_c is a temperature",
            text([[*HEAD, "motor_c"], *([*row, 21.5] for row in tidy())]),
        ),
        Nasty("UTF-16 without mark", text([HEAD, *tidy()]).decode().encode("utf-16-le")),
        Nasty(
            "UTF-16 big-endian without mark",
            text([HEAD, *tidy()], "\t").decode().encode("utf-16-be"),
        ),
    ]


def _times() -> list[Nasty]:
    order = sorted(range(36), key=lambda k: STOPS[k])
    undirected = [[row[0], row[2], row[3], row[4]] for row in timed(datetime.isoformat)]
    bare = [row[1:] for row in undirected]
    early = timed(lambda t: f"{t:%m/%d/%Y %H:%M:%S}".replace("11/20", "03/04"))
    wrapped = timed(lambda t: f"{t + timedelta(hours=11, minutes=59, seconds=-120):%H:%M:%S}")
    return [
        Nasty("AM/PM", text(timed(lambda t: f"{t:%I:%M:%S %p}")), timed=True),
        Nasty(
            "AM/PM with date, month first",
            text(timed(lambda t: f"{t:%m/%d/%Y %I:%M:%S.%f %p}")),
            timed=True,
        ),
        Nasty("clock times", text(timed(lambda t: f"{t:%H:%M:%S}", "Uhrzeit")), timed=True),
        Nasty("clock times past midnight", text(wrapped), timed=True),
        Nasty(
            "date and time apart",
            text(
                [
                    [*HEAD, "Datum", "Uhrzeit"],
                    *(
                        [*row[:4], *row[4].split()]
                        for row in timed(lambda t: f"{t:%d.%m.%Y %H:%M:%S}")[1:]
                    ),
                ]
            ),
            timed=True,
        ),
        Nasty("to the minute", text(timed(lambda t: f"{t:%Y-%m-%d %H:%M}")), timed=True),
        Nasty("clock times to the minute", text(timed(lambda t: f"{t:%H:%M}", "Zeit")), timed=True),
        Nasty(
            "03/04/2026",
            text(early),
            "date_order_unclear",
            RunMapping(date_order="day"),
            timed=True,
        ),
        Nasty(
            "12:30 of one reading each",
            text(
                [
                    [*HEAD, "time"],
                    *([*row, f"{8 + k // 6:02}:{k % 6 * 7:02}"] for k, row in enumerate(tidy())),
                ]
            ),
            "hours_or_minutes",
            RunMapping(time_format="%H:%M"),
            timed=True,
        ),
        Nasty("no direction, but times", text(undirected), timed=True),
        Nasty("neither direction nor cycle, but times", text(bare), timed=True),
        Nasty(
            "no direction, sorted by target",
            text([undirected[0], *(undirected[1 + k] for k in order)]),
            timed=True,
        ),
    ]


def _old_workbooks() -> list[Nasty]:
    gone = STOPS[4]
    rows = numbers(changed(tidy(), 4, 3, "#N/A"))
    when = [[*row, at] for row, at in zip(numbers(tidy()), moments(), strict=True)]
    blank = [[None], ["Machine", "MCV 750"], []]
    return [
        Nasty(".xls, tidy, with #N/A", old_workbook([HEAD, *rows]), missing=(gone,)),
        Nasty(".xls, times as dates", old_workbook([[*HEAD, "time"], *when]), timed=True),
        Nasty(
            ".xls, second sheet, merged heads",
            old_workbook(
                [["notes"]],
                [
                    *blank,
                    ["", "Vorwärts", "", "", "Rückwärts"],
                    ["Ziel (mm)", *[1, 2, 3] * 2],
                    *numbers(wide(BY_SIDE)),
                    ["Mittelwert", *[0.5] * 6],
                ],
            ),
        ),
    ]


CASES = [*_summaries(), *_missing(), *_heads(), *_numbers(), *_times(), *_old_workbooks()]
