"""Check that no whole number overflows and no index leaves its array: with intervals.

Every variable of kind INT is followed as the interval of values that it can have, through every
path and from call to call, until nothing grows any more. Conditions that compare whole numbers
narrow the intervals in their branches; conditions kept in a BOOL do not. So an index is accepted
where the program itself keeps it inside, as in

    place := place + 1;  IF place >= length THEN place := 0;

and a count where it is held or set back before it overflows. What is refused may still be right;
what is accepted is.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias, final

from thermaxis.codes import Place
from thermaxis.plc.tree._tree import (
    Assign,
    Count,
    Element,
    Expression,
    If,
    Kind,
    Name,
    Not,
    Operation,
    OutputOf,
    Statement,
    Truth,
    Two,
    Variable,
)
from thermaxis.plc.tree._walk import ProgramError, Scope, expressions_of, parts_of, placed, walk

SMALLEST_INT, LARGEST_INT = -32768, 32767
"""Range of INT. [1]"""

_Span: TypeAlias = tuple[int, int]
_Spans: TypeAlias = dict[str, _Span]
_EVERY: _Span = (SMALLEST_INT, LARGEST_INT)
_PATIENCE = 3
_LONGEST_SEARCH = 60
_OPPOSITE = {
    Operation.LESS: Operation.MORE_EQUAL,
    Operation.LESS_EQUAL: Operation.MORE,
    Operation.MORE: Operation.LESS_EQUAL,
    Operation.MORE_EQUAL: Operation.LESS,
}
_MIRRORED = {
    Operation.LESS: Operation.MORE,
    Operation.LESS_EQUAL: Operation.MORE_EQUAL,
    Operation.MORE: Operation.LESS,
    Operation.MORE_EQUAL: Operation.LESS_EQUAL,
    Operation.EQUAL: Operation.EQUAL,
}


def check_ranges(scopes: tuple[Scope, ...]) -> None:
    """Check the whole numbers of every block."""
    outputs: dict[str, _Spans] = {}
    for scope in scopes:
        outputs[scope.block.name] = _Ranges(scope, outputs).checked()


@final
@dataclass(slots=True)
class _Ranges:
    """The intervals of one block."""

    scope: Scope
    """The block."""
    outputs: Mapping[str, _Spans]
    """Intervals of the outputs of the blocks before, by block."""
    strict: bool = False
    """Whether what leaves its range is an error now: once nothing grows any more."""

    def checked(self) -> _Spans:
        """Check the block and return the intervals of its outputs."""
        block = self.scope.block
        where = f"block {block.name}"
        lasting = [v for v in (*block.outputs, *block.states) if v.kind is Kind.INT]
        entry = self._at_start()
        borders = self._borders()
        for turn in range(_LONGEST_SEARCH):
            end = self._run(block.body, entry, where)
            grown = dict(entry)
            for variable in lasting:
                name = variable.name
                wider = _joined(entry[name], end[name])
                grown[name] = wider if turn < _PATIENCE else _widened(entry[name], wider, borders)
            if grown == entry:
                break
            entry = grown
        else:
            entry |= {variable.name: _EVERY for variable in lasting}
        self.strict = True
        end = self._run(block.body, entry, where)
        return {v.name: _joined(_start(v), end[v.name]) for v in block.outputs if v.name in end}

    def _at_start(self) -> _Spans:
        block = self.scope.block
        spans = {v.name: _EVERY for v in block.inputs if v.kind is Kind.INT}
        spans |= {v.name: _EVERY for v in block.temporaries if v.kind is Kind.INT}
        own = (*block.outputs, *block.states, *block.constants)
        return spans | {v.name: _start(v) for v in own if v.kind is Kind.INT}

    def _borders(self) -> tuple[int, ...]:
        """Return the whole numbers at which an interval may stop to grow."""
        numbers = {SMALLEST_INT, LARGEST_INT, 0}
        for variable in self.scope.variables.values():
            numbers.add(variable.length)
        for constant in self.scope.block.constants:
            if constant.kind is Kind.INT:
                numbers.add(int(constant.start))
        for statement, _ in walk(self.scope.block.body, ""):
            for root in expressions_of(statement):
                numbers |= {part.value for part in parts_of(root) if isinstance(part, Count)}
        near = {number + step for number in numbers for step in (-1, 0, 1)}
        return tuple(sorted(n for n in near if SMALLEST_INT <= n <= LARGEST_INT))

    def _run(self, body: tuple[Statement, ...], before: _Spans, where: str) -> _Spans:
        spans = dict(before)
        for statement, place in placed(body, where):
            match statement:
                case Assign(target, value):
                    self._assign(target, value, spans, place)
                case If():
                    spans = self._choose(statement, spans, place)
                case _:
                    for root in expressions_of(statement):
                        self._evaluate(root, spans, place)
        return spans

    def _assign(self, target: Name | Element, value: Expression, spans: _Spans, where: str) -> None:
        span = self._evaluate(value, spans, where)
        if isinstance(target, Element):
            self._check_index(target, spans, where)
            if span is not None and target.array in spans:
                spans[target.array] = _joined(spans[target.array], span)
        elif span is not None:
            spans[target.name] = span

    def _choose(self, choice: If, before: _Spans, where: str) -> _Spans:
        rest: _Spans | None = before
        ends: list[_Spans] = []
        for number, (condition, body) in enumerate(choice.branches, 1):
            if rest is None:
                break
            self._evaluate(condition, rest, where)
            then = self._narrowed(condition, rest, truth=True)
            if then is not None:
                ends.append(self._run(body, then, f"{where}, branch {number}"))
            rest = self._narrowed(condition, rest, truth=False)
        if rest is not None:
            ends.append(self._run(choice.otherwise, rest, f"{where}, last branch"))
        first, *others = ends
        for other in others:
            first = _together(first, other)
        return first

    def _evaluate(self, expression: Expression, spans: _Spans, where: str) -> _Span | None:
        """Return the interval of a whole number, None of anything else; check what is in it."""
        match expression:
            case Name(name):
                return spans.get(name)
            case OutputOf(instance, output):
                return self.outputs[self.scope.blocks[instance].name].get(output)
            case Element(array):
                self._check_index(expression, spans, where)
                return spans.get(array)
            case Count(value):
                return value, value
            case Not(of):
                self._evaluate(of, spans, where)
            case Two(left, operation, right):
                a = self._evaluate(left, spans, where)
                b = self._evaluate(right, spans, where)
                if a is not None and b is not None:
                    return self._computed(a, operation, b, where)
            case _:
                pass
        return None

    def _computed(self, a: _Span, operation: Operation, b: _Span, where: str) -> _Span | None:
        if operation is Operation.ADD:
            ends = [a[0] + b[0], a[1] + b[1]]
        elif operation is Operation.SUBTRACT:
            ends = [a[0] - b[1], a[1] - b[0]]
        elif operation is Operation.MULTIPLY:
            ends = [x * y for x in a for y in b]
        else:
            return None
        low, high = min(ends), max(ends)
        if self.strict and (low < SMALLEST_INT or high > LARGEST_INT):
            raise ProgramError(
                "whole_number_overflow",
                value=high if high > LARGEST_INT else low,
                place=Place(key=where),
            )
        return max(low, SMALLEST_INT), min(high, LARGEST_INT)

    def _check_index(self, element: Element, spans: _Spans, where: str) -> None:
        low, high = spans[element.index]
        length = self.scope.variables[element.array].length
        if self.strict and (low < 0 or high >= length):
            raise ProgramError(
                "index_outside_array",
                index=element.index,
                lowest=low,
                highest=high,
                array=element.array,
                last=length - 1,
                place=Place(key=where),
            )

    def _narrowed(self, condition: Expression, spans: _Spans, *, truth: bool) -> _Spans | None:
        """Return the intervals where a condition holds, or does not; None where it cannot."""
        match condition:
            case Truth(value):
                return spans if value == truth else None
            case Not(of):
                return self._narrowed(of, spans, truth=not truth)
            case Two(_, Operation.AND | Operation.OR):
                return self._combined(condition, spans, truth=truth)
            case Two():
                return self._compared(condition, spans, truth=truth)
            case _:
                return spans

    def _combined(self, two: Two, spans: _Spans, *, truth: bool) -> _Spans | None:
        first = self._narrowed(two.left, spans, truth=truth)
        if truth == (two.operation is Operation.AND):
            return None if first is None else self._narrowed(two.right, first, truth=truth)
        second = self._narrowed(two.right, spans, truth=truth)
        if first is None or second is None:
            return second if first is None else first
        return _together(first, second)

    def _compared(self, two: Two, spans: _Spans, *, truth: bool) -> _Spans | None:
        a, b = self._term(two.left, spans), self._term(two.right, spans)
        operation = two.operation if truth else _OPPOSITE.get(two.operation)
        if a is None or b is None or operation not in _MIRRORED:
            return spans
        new_a = _kept_span(a, operation, b)
        new_b = _kept_span(b, _MIRRORED[operation], a)
        if new_a is None or new_b is None:
            return None
        narrowed = dict(spans)
        for side, span in ((two.left, new_a), (two.right, new_b)):
            if isinstance(side, Name):
                narrowed[side.name] = span
        return narrowed

    def _term(self, expression: Expression, spans: _Spans) -> _Span | None:
        match expression:
            case Name(name):
                return spans.get(name)
            case Count(value):
                return value, value
            case _:
                return None


def _start(variable: Variable) -> _Span:
    return int(variable.start), int(variable.start)


def _joined(a: _Span, b: _Span) -> _Span:
    return min(a[0], b[0]), max(a[1], b[1])


def _together(a: _Spans, b: _Spans) -> _Spans:
    return {name: _joined(span, b[name]) for name, span in a.items()}


def _widened(old: _Span, new: _Span, borders: tuple[int, ...]) -> _Span:
    """Return an interval that grew, extended to the next numbers of the program."""
    low, high = new
    if low < old[0]:
        low = max(n for n in borders if n <= low)
    if high > old[1]:
        high = min(n for n in borders if n >= high)
    return low, high


def _kept_span(a: _Span, operation: Operation, b: _Span) -> _Span | None:
    """Return what remains of one interval where it compares so with another; None for nothing."""
    low, high = a
    match operation:
        case Operation.LESS:
            high = min(high, b[1] - 1)
        case Operation.LESS_EQUAL:
            high = min(high, b[1])
        case Operation.MORE:
            low = max(low, b[0] + 1)
        case Operation.MORE_EQUAL:
            low = max(low, b[0])
        case _:
            low, high = max(low, b[0]), min(high, b[1])
    return (low, high) if low <= high else None
