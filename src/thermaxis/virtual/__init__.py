"""Virtual machines: physics of their own, to make runs whose truth is known."""

from lazy_loader import attach

from thermaxis.virtual import axis, lathe

__getattr__, __dir__, __all__ = attach(
    __name__, submod_attrs={"axis": dir(axis), "lathe": dir(lathe)}
)
