"""Numbers of an NC program, rounded so that the motion never becomes wider than planned."""

import math

from thermaxis.controls._control import plain_number
from thermaxis.errors import ConfigurationError
from thermaxis.positioning import MoveBlock

LARGEST_REPETITIONS = 9999
"""Largest number of repetitions of one block; from memory for both languages. [1]"""
_FEED_DECIMALS = 3
_ROUND_OFF = 1e-6


def inward_positions(block: MoveBlock, decimals: int) -> tuple[float, ...]:
    """Return where the moves of a block end, at the decimals that a control reads.

    A stop is a target and has three decimals already; a turn is rounded towards its neighbour, so
    that no move ends beyond the plan's lowest or highest position.

    Parameters
    ----------
    block : MoveBlock
        The block.
    decimals : int
        Decimals of a position, at least 3. [1]

    Returns
    -------
    tuple of float
        One position for each move. [mm or deg]

    Raises
    ------
    ConfigurationError
        If the overrun is so short that a turn would fall on its stop.
    """
    scale = 10.0**decimals
    moves = block.moves
    rounded: list[float] = []
    for i, move in enumerate(moves):
        if move.is_stop or len(moves) == 1:
            rounded.append(round(move.position, decimals))
            continue
        neighbour = moves[i + 1] if i + 1 < len(moves) else moves[i - 1]
        count = move.position * scale
        if neighbour.position > move.position:
            inner = math.ceil(count - _ROUND_OFF) / scale
            kept = inner < neighbour.position
        else:
            inner = math.floor(count + _ROUND_OFF) / scale
            kept = inner > neighbour.position
        if not kept:
            raise ConfigurationError(
                f"the overrun is shorter than the {decimals} decimals that the control reads",
                where="overrun",
                remedy="Plan a wider overrun",
            )
        rounded.append(inner)
    return tuple(rounded)


def feed_word(feed: float, largest: float) -> str:
    """Return the feed as a control reads it.

    Parameters
    ----------
    feed : float
        Feed of the plan. [mm/min or deg/min]
    largest : float
        Largest feed that the control's word can hold. [mm/min or deg/min]

    Returns
    -------
    str
        At most three decimals, without zeros at the end.

    Raises
    ------
    ConfigurationError
        If it rounds to nothing or is beyond the word.
    """
    text = plain_number(feed, _FEED_DECIMALS).rstrip("0").rstrip(".")
    if not 0 < float(text) <= largest:
        raise ConfigurationError(
            f"the feed {feed:g} does not fit the control's F word, which is from 0.001 to"
            f" {largest:g}",
            where="feed",
            remedy="Plan another feed",
        )
    return text


def check_range(block: MoveBlock, largest: float) -> None:
    """Refuse positions and repetitions that a control's words cannot hold.

    Parameters
    ----------
    block : MoveBlock
        The block.
    largest : float
        Largest magnitude of a position. [mm or deg]

    Raises
    ------
    ConfigurationError
        If a position or the number of repetitions is beyond its word.
    """
    if any(abs(move.position) > largest for move in block.moves):
        raise ConfigurationError(
            f"a position is larger than the {largest:g} that the control's word can hold",
            where="targets",
        )
    if block.repetitions > LARGEST_REPETITIONS:
        raise ConfigurationError(
            f"{block.repetitions} repetitions of {block.name} are more than the"
            f" {LARGEST_REPETITIONS} that one call makes",
            where="cycles, --warm-up",
            remedy="Plan fewer",
        )
