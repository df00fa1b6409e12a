"""Stored pitch error compensation read from a Fanuc parameter file, as the control would.

References
----------
Frame and words of a parameter file: parameter manual B-63330EN (Series 15i), p. 25 [V, its spindle
form]; everything else as in `thermaxis.controls.fanuc`.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import final

import numpy as np

from thermaxis.codes import Message, Place
from thermaxis.controls._control import ReadTable, finding, text_lines
from thermaxis.controls.fanuc._points import (
    AXIS_LETTERS,
    FIRST_POINT,
    LARGEST_MAGNIFICATION,
    LARGEST_POSITION,
    STATION,
    TURN_DEG,
    PointOptions,
)
from thermaxis.errors import MeasurementFileError
from thermaxis.positioning import CompensationTable, FloatArray
from thermaxis.quantities import AxisKind

LONGEST_LINE = 10_000
"""Longest line of a parameter file that is read; 32 axes take 400. [character]"""

_NAMED_BY_NUMBER = 3  # X, Y and Z are usually 1, 2 and 3; a fourth axis can be any

_POINT_COMMENT = re.compile(
    r"\(POINTS FROM (?P<first>-?[0-9.]{1,12}) TO (?P<last>-?[0-9.]{1,12})"
    r" REFERENCE (?P<reference>-?[0-9.]{1,12})\)"
)
_AXIS_COMMENT = re.compile(r"\(AXIS (?P<axis>[A-Z][A-Z0-9_]{0,15}) ")
_LINE = re.compile(r"N([0-9]{1,5})((?:[A-Z][^A-Z;]*)+)", re.ASCII)
# a word ends where P, or another letter with a number, follows: P1E5 and PNAN are wrong values
_PAIR = re.compile(r"([A-Z])(.*?)(?=P|[A-DF-Z][0-9+.-]|$)", re.ASCII)


def table_from_parameters(text: str, path: str, kind: AxisKind, chosen: PointOptions) -> ReadTable:
    """Return the pitch error compensation of one axis."""
    words = _words(text, path)
    return _Reading(path, words, chosen, _wanted_axis(path, words, chosen), kind).table()


@final
@dataclass(frozen=True, slots=True)
class _Word:
    """One value of the file."""

    line: int
    text: str


@final
@dataclass(frozen=True, slots=True)
class _Words:
    """What a parameter file holds, by number N and axis A (0 where no axis is stated)."""

    values: Mapping[tuple[int, int], _Word]
    comments: tuple[str, ...]
    findings: tuple[Message, ...]


def _words(text: str, path: str) -> _Words:
    """Return the words between the two ``%``."""
    lines, findings = text_lines(text, path)
    starts = [i for i, line in enumerate(lines) if line.strip().startswith("%")]
    if not starts or any(line.strip() for line in lines[: starts[0]]):
        raise MeasurementFileError("no_parameter_file", file=path, line=1)
    if len(starts) < 2:
        raise MeasurementFileError("table_cut_short", end="%", file=path, line=len(lines))
    values: dict[tuple[int, int], _Word] = {}
    comments: list[str] = []
    for number, line in enumerate(lines[: starts[1]], start=1):
        if number <= starts[0]:
            continue
        if len(line) > LONGEST_LINE:
            raise MeasurementFileError(
                "table_line_too_long", most=LONGEST_LINE, file=path, line=number
            )
        comments += re.findall(r"\([^()]*\)", line)
        bare = re.sub(r"\([^()]*\)", "", line).strip()
        for content in bare.removeprefix("%").split(";"):
            if content.strip():
                _add_words(path, number, content.strip(), values)
    if any(line.strip() for line in lines[starts[1] + 1 :]):
        findings.append(finding("unread_behind_end", Place(line=starts[1] + 1)))
    return _Words(values, tuple(comments), tuple(findings))


def _add_words(path: str, number: int, content: str, values: dict[tuple[int, int], _Word]) -> None:
    found = _LINE.fullmatch(re.sub(r"\s+", "", content).upper())
    if found is None:
        raise MeasurementFileError("no_parameter_line", text=content[:99], file=path, line=number)
    axis = 0
    for letter, word in _PAIR.findall(found[2]):
        if letter == "A":
            if not re.fullmatch(r"[0-9]{1,2}", word):
                raise MeasurementFileError(
                    "not_a_number", text=word, file=path, line=number, column="A"
                )
            axis = int(word)
        elif letter == "P":
            key = (int(found[1]), axis)
            if key in values:
                raise MeasurementFileError(
                    "word_stated_twice",
                    name=f"N{key[0]}",
                    first_line=values[key].line,
                    file=path,
                    line=number,
                )
            values[key] = _Word(number, word)


def _wanted_axis(path: str, words: _Words, chosen: PointOptions) -> int:
    """Return the axis number whose compensation is read; 0 for words without axis numbers."""
    there = sorted({axis for number, axis in words.values if number == 3620})
    if not there:
        raise MeasurementFileError("no_pitch_error_table", file=path)
    if chosen.axis_number is None:
        if len(there) > 1:
            raise MeasurementFileError("several_axes", axes=tuple(map(str, there)), file=path)
        return there[0]
    if chosen.axis_number not in there and there != [0]:
        raise MeasurementFileError(
            "other_axis_number",
            axes=tuple(map(str, there)),
            wanted=chosen.axis_number,
            file=path,
            line=words.values[3620, there[0]].line,
        )
    return chosen.axis_number if chosen.axis_number in there else 0


@final
@dataclass(frozen=True, slots=True)
class _Reading:
    """One axis of a parameter file on its way to a table."""

    path: str
    words: _Words
    chosen: PointOptions
    axis: int
    kind: AxisKind

    def table(self) -> ReadTable:
        """Return what the control would do with it."""
        findings = list(self.words.findings)
        axis_name = self._axis_name(findings)
        step = self._length(3624)
        magnification = self._whole(3623)
        if not 1 <= magnification <= LARGEST_MAGNIFICATION:
            raise MeasurementFileError(
                "outside_range",
                value=magnification,
                least=1,
                most=LARGEST_MAGNIFICATION,
                place=self._at(3623),
            )
        reference, extent = self._place(findings)
        quantum = magnification * self.chosen.unit
        turns = self._turns()
        position, counted = self._positive_table(reference, step, turns=turns, findings=findings)
        kept = self._kept(position, counted, extent, turns=turns)
        largest = int(np.max(np.abs(np.diff(counted[:, 0])), initial=0))
        findings.append(
            finding(
                "simulated_linear", most=0.5 * largest * quantum, unit=self.kind.units.deviation
            )
        )
        offset = self._whole(3627) * self.chosen.unit if self.chosen.bidirectional else 0.0
        if not self.chosen.returns_positive:
            offset = -offset
        # the zero of the table is that of the mean of both directions
        deviation: FloatArray = np.stack(
            (0.5 * offset - quantum * counted[:, 0], -0.5 * offset - quantum * counted[:, 1]),
            axis=1,
        )
        return ReadTable(
            table=CompensationTable(
                kind=self.kind,
                axis=axis_name,
                position=position[kept],
                deviation=deviation[kept],
                backlash=self._backlash(findings),
                reference_position=reference,
            ),
            findings=tuple(findings),
            resolution=quantum,
        )

    def _at(self, parameter: int) -> Place:
        line = self.words.values[parameter, self.axis].line
        return Place(self.path, line, f"N{parameter}")

    def _word(self, parameter: int) -> _Word:
        word = self.words.values.get((parameter, self.axis))
        if word is None:
            raise MeasurementFileError("parameter_missing", file=self.path, column=f"N{parameter}")
        return word

    def _whole(self, parameter: int) -> int:
        return self._as_whole(self._word(parameter))

    def _as_whole(self, word: _Word) -> int:
        if not re.fullmatch(r"[+-]?[0-9]{1,9}", word.text):
            raise MeasurementFileError(
                "not_a_whole_word", text=word.text[:99], file=self.path, line=word.line
            )
        return int(word.text)

    def _length(self, parameter: int) -> float:
        """Return an interval, whole numbers in 0.001, newer controls with a decimal point."""
        word = self._word(parameter)
        if re.fullmatch(r"\+?[0-9]{1,6}\.[0-9]{0,6}", word.text):
            value = float(word.text)
        else:
            value = self._as_whole(word) * STATION
        if not 0 < value <= LARGEST_POSITION:
            raise MeasurementFileError("not_positive", value=value, place=self._at(parameter))
        return value

    def _turns(self) -> bool:
        """Return whether the axis repeats after a turn."""
        word = self.words.values.get((3625, self.axis))
        if word is None or not re.search("[1-9]", word.text):
            return False
        if abs(self._length(3625) - TURN_DEG) > 1e-9:
            raise MeasurementFileError("turn_not_360", place=self._at(3625))
        return True

    def _place(self, findings: list[Message]) -> tuple[float, tuple[float, float] | None]:
        """Return where the reference position lies, and which grid positions were meant."""
        found = next(filter(None, map(_POINT_COMMENT.fullmatch, self.words.comments)), None)
        extent = None
        reference = self.chosen.reference
        if found is not None:
            try:
                first, last, place = (float(found[g]) for g in ("first", "last", "reference"))
            except ValueError:
                findings.append(finding("points_comment_unreadable"))
            else:
                extent = (first, last)
                if reference is not None and abs(reference - place) > 1e-6:
                    findings.append(finding("comment_of_other_reference", reference=place))
                    extent = None
                reference = place if reference is None else reference
        if reference is None:
            findings.append(finding("reference_unknown"))
            reference = 0.0
        return reference, extent

    def _positive_table(
        self, reference: float, step: float, *, turns: bool, findings: list[Message]
    ) -> tuple[FloatArray, FloatArray]:
        """Return grid positions and the sums of the values from the reference position, (k, 2)."""
        at, first, last = (self._whole(p) for p in (3620, 3621, 3622))
        if not first - 1 <= at <= last or last > 9999:
            raise MeasurementFileError(
                "points_miss_reference",
                first=first,
                last=last,
                reference_point=at,
                place=self._at(3621),
            )
        sides = [self._points(first, last)]
        if self.chosen.bidirectional:
            if (3626, self.axis) not in self.words.values:
                raise MeasurementFileError("no_second_table", file=self.path, column="N3626")
            start = self._whole(3626)
            sides.append(self._points(start, start + last - first))
        elif (3626, self.axis) in self.words.values and self._whole(3626) != 0:
            findings.append(finding("second_table_not_simulated"))
        sums: list[FloatArray] = []
        for values in sides:
            run = np.concatenate(([0.0], np.cumsum(values)))
            if turns:
                if values[0] != values[-1]:
                    findings.append(finding("turn_ends_differ"))
                run = run[1:] - run[1]
                if run[-1] != 0:
                    findings.append(finding("turn_adds_up", sum=float(run[-1])))
            sums.append(run if turns else run - run[at - first + 1])
        before = at - first + 1
        if turns:
            if at != first or abs((last - first) * step - TURN_DEG) > 1e-6:
                raise MeasurementFileError("turn_not_spanned", place=self._at(3622))
            before = 0
        position: FloatArray = reference + step * (
            np.arange(sums[0].size, dtype=np.float64) - before
        )
        return np.round(position, 6), np.stack((sums[0], sums[-1]), axis=1)

    def _points(self, first: int, last: int) -> list[int]:
        values: list[int] = []
        for point in range(first, last + 1):
            word = self.words.values.get((FIRST_POINT + point, 0))
            if word is None:
                raise MeasurementFileError(
                    "table_point_missing",
                    point=point,
                    file=self.path,
                    column=f"N{FIRST_POINT + point}",
                )
            value = self._as_whole(word)
            if abs(value) > self.chosen.largest:
                raise MeasurementFileError(
                    "point_value_too_large",
                    value=value,
                    largest=self.chosen.largest,
                    file=self.path,
                    line=word.line,
                )
            values.append(value)
        return values

    def _kept(
        self,
        position: FloatArray,
        counted: FloatArray,
        extent: tuple[float, float] | None,
        *,
        turns: bool,
    ) -> slice:
        """Return the grid positions that are more than a way to the reference position."""
        if extent is not None:
            inside = np.flatnonzero((position >= extent[0] - 1e-3) & (position <= extent[1] + 1e-3))
            if inside.size >= 2:
                return slice(int(inside[0]), int(inside[-1]) + 1)
        flat = not bool(np.any(np.diff(counted[:2], axis=0)))
        if not turns and position.size > 2 and flat and self._whole(3620) == self._whole(3621):
            return slice(1, None)  # the number of the reference position alone, without a value
        return slice(None)

    def _backlash(self, findings: list[Message]) -> float | None:
        if (1851, self.axis) not in self.words.values:
            return None
        lost = self._whole(1851) * self.chosen.unit
        if self.chosen.bidirectional and lost != 0:
            findings.append(finding("backlash_beside_second_table"))
        return -lost

    def _axis_name(self, findings: list[Message]) -> str:
        """Return the axis by the file's comment, else by its number unless that was stated."""
        usual = AXIS_LETTERS[self.axis - 1] if 1 <= self.axis <= _NAMED_BY_NUMBER else ""
        if self.axis == 0:
            findings.append(finding("no_axis_number"))
        if self.chosen.axis_number is not None:
            usual = ""
        found = next(filter(None, map(_AXIS_COMMENT.match, self.words.comments)), None)
        if found is None:
            if usual:
                findings.append(finding("axis_by_number", number=self.axis, axis=usual))
            return usual
        if usual and usual != found["axis"]:
            findings.append(
                finding("comment_of_other_axis", axis=found["axis"], number=self.axis, usual=usual)
            )
        return found["axis"]
