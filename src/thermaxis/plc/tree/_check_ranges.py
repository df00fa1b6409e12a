"""Check that no whole number overflows and no index leaves its array: with intervals.

Every variable of kind INT is followed as the interval of values that it can have, through every
path of one call. What lasts from call to call may begin with any value, but for a state that is an
index: it begins within its arrays, and must be there again at the end, as in

    place := place + 1;  IF place >= length THEN place := 0;

Conditions that compare whole numbers narrow the intervals in their branches; conditions kept in a
BOOL do not. What is refused may still be right; what is accepted is.
"""

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
from thermaxis.plc.tree._walk import ProgramError, Scope, expressions_of, placed, touched, walk

SMALLEST_INT, LARGEST_INT = -32768, 32767
"""Range of INT. [1]"""

_Span: TypeAlias = tuple[int, int]
_Spans: TypeAlias = dict[str, _Span]
_EVERY: _Span = (SMALLEST_INT, LARGEST_INT)
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
    for scope in scopes:
        _Ranges(scope).check()


@final
@dataclass(frozen=True, slots=True)
class _Ranges:
    """The intervals of one block."""

    scope: Scope
    """The block."""

    def check(self) -> None:
        """Check one call, from whatever the one before has left."""
        block = self.scope.block
        where = f"block {block.name}"
        whole = [v for v in self.scope.variables.values() if v.kind is Kind.INT]
        entry: _Spans = {v.name: _EVERY for v in whole}
        entry |= {v.name: _start(v) for v in block.constants if v.kind is Kind.INT}
        indices = self._indices()
        entry |= {i.index: (0, self._last(i)) for i in indices}
        end = self._run(block.body, entry, where)
        for element in indices:
            start = _start(self.scope.variables[element.index])
            self._require_inside(element, _joined(start, end[element.index]), where)

    def _indices(self) -> list[Element]:
        """Return the elements with a state as index, the longest arrays first."""
        states = {v.name for v in self.scope.block.states}
        found = [
            part
            for statement, _ in walk(self.scope.block.body, "")
            for part in touched(statement)
            if isinstance(part, Element) and part.index in states
        ]
        return sorted(found, key=self._last, reverse=True)

    def _last(self, element: Element) -> int:
        return self.scope.variables[element.array].length - 1

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
            self._require_inside(target, spans[target.index], where)
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
                kinds = {v.name: v.kind for v in self.scope.blocks[instance].outputs}
                return _EVERY if kinds[output] is Kind.INT else None
            case Element(array, index):
                self._require_inside(expression, spans[index], where)
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
        if low < SMALLEST_INT or high > LARGEST_INT:
            raise ProgramError(
                "whole_number_overflow",
                value=high if high > LARGEST_INT else low,
                place=Place(key=where),
            )
        return low, high

    def _require_inside(self, element: Element, span: _Span, where: str) -> None:
        low, high = span
        last = self._last(element)
        if low < 0 or high > last:
            raise ProgramError(
                "index_outside_array",
                index=element.index,
                lowest=low,
                highest=high,
                array=element.array,
                last=last,
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
