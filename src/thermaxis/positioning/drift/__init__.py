"""The thermal drift of a run, separated from the levels of its targets."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
