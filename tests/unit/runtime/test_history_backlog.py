"""What waits keeps its order and its bound, and nothing goes without being counted."""

from collections.abc import Sequence

from hypothesis import given, settings, strategies as st

from thermaxis.runtime._backlog import Backlog, Loss
from thermaxis.runtime.history._columns import Column, Item, Layout, PackedEvent, Row

LAYOUT = Layout((), (Column("answers", "text"),))


def cycle(time_us: int = 0, size: int = 100) -> Row:
    return Row(LAYOUT, time_us, bytes(max(size - 8, 0)), (None,))


def event(time_us: int = 0, size: int = 10) -> PackedEvent:
    return PackedEvent(time_us, "state", "", "", "x" * size, "{}")


def times(items: Sequence[Item]) -> list[int]:
    return [item.utc_us for item in items]


def test_items_are_taken_in_the_order_in_which_they_came() -> None:
    backlog = Backlog[Item](10**6)
    for k in range(6):
        backlog.add(event(k) if k % 3 == 1 else cycle(k))
    assert times(backlog.take(4)) == times(backlog.take(4)) == [0, 1, 2, 3]  # until it is stored
    backlog.stored()
    assert times(backlog.take(4)) == [4, 5]
    backlog.stored()
    assert backlog.waiting == 0
    assert backlog.take(4) == ()


def test_the_oldest_cycles_go_first_and_events_stay() -> None:
    backlog = Backlog[Item](100_000)
    backlog.add(event(-1))
    for k in range(1000):
        backlog.add(cycle(k, 700))  # counts as its row and 300 bytes
    first, *kept = times(backlog.take(1000))
    assert first == -1
    assert kept == list(range(1000 - len(kept), 1000))
    assert 94 <= len(kept) <= 99
    assert backlog.unstated == Loss(1000 - len(kept), 0, 0, kept[0] - 1)
    assert backlog.lost.number == 1000 - len(kept)


def test_a_flood_of_events_takes_no_more_than_a_quarter_from_the_cycles() -> None:
    backlog = Backlog[Item](400_000)
    for k in range(5000):
        backlog.add(event(k) if k % 5 else cycle(k, 700))
    taken = backlog.take(10_000)
    events = [item for item in taken if isinstance(item, PackedEvent)]
    assert sum(isinstance(item, Row) for item in taken) > 250
    assert 100 < len(events) < 400
    assert events[-1].utc_us == 4999


def test_a_loss_is_told_once_and_what_is_lost_meanwhile_is_told_again() -> None:
    backlog = Backlog[Item](400_000)
    backlog.add_loss(Loss(7, 2, 10, 20))
    told = backlog.unstated
    backlog.add_loss(Loss(1, 0, 5, 5))
    backlog.stored(told)
    assert backlog.unstated[:2] == (1, 0)
    assert backlog.lost.number == 10


def test_what_is_added_after_the_end_counts_as_lost() -> None:
    backlog = Backlog[Item](400_000)
    backlog.add(cycle())
    backlog.take(1)
    backlog.add(cycle())
    backlog.give_up()
    backlog.add(cycle())
    backlog.add(event())
    assert (backlog.waiting, backlog.lost.number) == (0, 4)


def test_losses_add_up() -> None:
    first, second = Loss(1, 2, -5, 3), Loss(3, 4, -1, 9)
    assert first | second == Loss(4, 6, -5, 9)
    assert Loss() | second == second | Loss() == second


steps = st.lists(
    st.one_of(
        st.tuples(st.just("cycles"), st.integers(1, 400)),
        st.tuples(st.just("events"), st.integers(1, 100)),
        st.tuples(st.sampled_from(["stored", "put_back", "drop_taken"]), st.integers(1, 300)),
    ),
    max_size=30,
)


@settings(max_examples=40)
@given(steps)
def test_every_item_is_stored_once_or_lost_or_waits(moves: list[tuple[str, int]]) -> None:
    """Against a plain list that keeps everything."""
    backlog = Backlog[Item](100_000)
    added, stored = 0, list[int]()
    for move, count in moves:
        if move in {"cycles", "events"}:
            for _ in range(count):
                added += 1
                backlog.add(cycle(added, 500) if move == "cycles" else event(added))
        else:
            stored += times(backlog.take(count)) if move == "stored" else []
            backlog.take(count)
            getattr(backlog, move)()
        if not backlog._flying:
            assert sum(backlog._bytes.values()) <= 100_000
    waiting = times(backlog.take(10**6))
    backlog.stored()
    assert set(backlog._bytes.values()) == {0}
    assert stored == sorted(set(stored))
    assert waiting == sorted(set(waiting))
    assert not set(stored) & set(waiting)
    assert len(stored) + len(waiting) + backlog.lost.number == added
    gone = set(range(1, added + 1)) - set(stored) - set(waiting)
    assert backlog.unstated.number == len(gone)
    if gone:
        assert backlog.unstated[2:] == (min(gone), max(gone))
