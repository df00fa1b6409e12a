"""What counts as a truth value on a machine."""


def flag_of(value: float | bool | None) -> bool | None:  # noqa: FBT001 - what a node holds
    """Return a node's number as a truth value."""
    return bool(value) if value in {0, 1} else None
