"""What counts as a truth value on a machine."""


def flag_of(value: float | bool | None) -> bool | None:  # noqa: FBT001 - what a node holds
    """Return a node's number as a truth value.

    Parameters
    ----------
    value : float or bool, optional
        What the node holds.

    Returns
    -------
    bool or None
        None for everything but true, false, 0 and 1: a word of states has no truth value that
        could be relied on.
    """
    return bool(value) if value in {0, 1} else None
