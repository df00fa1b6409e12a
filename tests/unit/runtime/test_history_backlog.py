"""What waits keeps its order and its bound, and nothing goes without being counted."""

from hypothesis import given, strategies as st

from thermaxis.runtime.history import Backlog
from thermaxis.runtime.history._backlog import NO_LOSS, Loss, PackedEvent
from thermaxis.runtime.history._columns import Column, Layout, Row

LAYOUT = Layout((), (Column("answers", "text"),))


def cycle(time_us: int = 0, size: int = 100) -> Row:
    return Row(LAYOUT, time_us, bytes(max(size - 8, 0)), (None,))


def event(time_us: int = 0, size: int = 10) -> PackedEvent:
    return PackedEvent(time_us, "state", "", "", "x" * size, "{}")


def test_items_are_taken_in_the_order_in_which_they_came() -> None:
    backlog = Backlog(10**6)
    for k in range(6):
        backlog.add_event(event(k)) if k % 3 == 1 else backlog.add_cycle(cycle(k))
    assert [item.content.utc_us for item in backlog.take(4)] == [0, 1, 2, 3]
    assert [item.content.utc_us for item in backlog.take(4)] == [0, 1, 2, 3]  # until it is stored
    backlog.stored()
    assert [item.content.utc_us for item in backlog.take(4)] == [4, 5]
    assert backlog.arrived.is_set()
    backlog.stored()
    assert backlog.waiting == 0
    assert not backlog.arrived.is_set()
    assert backlog.empty.is_set()
    assert backlog.take(4) == ()


def test_the_oldest_cycles_go_first_and_their_span_is_told() -> None:
    backlog = Backlog(100_000)
    for k in range(1000):
        backlog.add_cycle(cycle(k, 700))
    kept = [item.content.utc_us for item in backlog.take(1000)]
    assert kept == list(range(1000 - len(kept), 1000))
    assert len(kept) == 100  # a cycle counts as its row and 300 bytes
    assert backlog.take_loss() == Loss(900, 0, 0, 899)
    assert backlog.take_loss() == NO_LOSS
    assert backlog.lost == 900


def test_a_flood_of_events_takes_no_more_than_a_quarter_from_the_cycles() -> None:
    backlog = Backlog(400_000)
    for k in range(100):
        backlog.add_cycle(cycle(k, 700))
    for k in range(5000):
        backlog.add_event(event(k))
    taken = backlog.take(10_000)
    assert sum(isinstance(item.content, Row) for item in taken) == 100
    assert sum(item.size for item in taken) <= 200_000
    assert [i.content.utc_us for i in taken if isinstance(i.content, PackedEvent)][-1] == 4999


def test_the_event_of_a_loss_that_is_lost_itself_leaves_the_loss_to_be_told_again() -> None:
    backlog = Backlog(400_000)
    told = Loss(7, 2, 10, 20)
    backlog.add_event(event(30), told)
    for k in range(5000):
        backlog.add_event(event(100 + k))
    loss = backlog.take_loss()
    assert (loss.cycles, loss.first_us) == (7, 10)
    assert loss.events == 2 + backlog.lost


def test_what_is_added_after_the_end_counts_as_lost() -> None:
    backlog = Backlog(400_000)
    backlog.add_cycle(cycle())
    backlog.take(1)
    backlog.add_cycle(cycle())
    backlog.give_up()
    backlog.add_cycle(cycle())
    backlog.add_event(event())
    assert (backlog.waiting, backlog.lost) == (0, 4)


def test_losses_add_up() -> None:
    first, second = Loss(1, 2, -5, 3), Loss(3, 4, -1, 9)
    assert first | second == Loss(4, 6, -5, 9)
    assert NO_LOSS | second == second | NO_LOSS == second
    assert not NO_LOSS


steps = st.lists(
    st.one_of(
        st.tuples(st.just("cycles"), st.integers(1, 400)),
        st.tuples(st.just("events"), st.integers(1, 100)),
        st.tuples(st.just("take"), st.integers(1, 300)),
        st.tuples(st.sampled_from(["stored", "put_back", "half", "drop_taken"]), st.just(0)),
    ),
    max_size=40,
)


@given(steps)
def test_every_item_is_stored_once_or_lost_or_waits(moves: list[tuple[str, int]]) -> None:
    """Against a plain list that keeps everything."""
    backlog = Backlog(100_000)
    added = 0
    stored: list[int] = []
    for move, count in moves:
        taken = backlog.take(300) if move not in {"cycles", "events"} else ()
        for _ in range(count if move in {"cycles", "events"} else 0):
            added += 1
            backlog.add_cycle(cycle(added, 500)) if move == "cycles" else backlog.add_event(
                event(added)
            )
        times = [item.content.utc_us for item in taken]
        if move == "stored":
            backlog.stored()
            stored += times
        elif move == "put_back":
            backlog.put_back()
        elif move == "half" and taken:
            half = len(taken) // 2
            backlog.put_back(taken[half].seq)
            stored += times[: half + 1]
        elif move == "drop_taken":
            backlog.drop_taken()
    waiting: list[int] = []
    while taken := backlog.take(100):
        waiting += [item.content.utc_us for item in taken]
        backlog.stored()
    assert stored == sorted(set(stored))
    assert waiting == sorted(set(waiting))
    assert not set(stored) & set(waiting)
    assert len(stored) + len(waiting) + backlog.lost == added
    loss = backlog.take_loss()
    assert loss.cycles + loss.events == backlog.lost
    gone = set(range(1, added + 1)) - set(stored) - set(waiting)
    if gone:
        assert (loss.first_us, loss.last_us) == (min(gone), max(gone))
    assert not backlog.arrived.is_set()


@given(st.lists(st.integers(0, 3000), max_size=300), st.integers(100_000, 300_000))
def test_the_bound_is_never_passed(sizes: list[int], bound: int) -> None:
    backlog = Backlog(bound)
    for size in sizes:
        backlog.add_event(event(0, size)) if size % 5 == 0 else backlog.add_cycle(cycle(0, size))
        assert backlog._bytes <= bound
    taken = backlog.take(10_000)
    assert sum(item.size for item in taken) == backlog._bytes
    backlog.stored()
    assert backlog._bytes == backlog._event_bytes == 0
