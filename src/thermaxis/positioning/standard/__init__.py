"""The figures of ISO 230-2 and its predecessors, and the differences of adjacent positions."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
