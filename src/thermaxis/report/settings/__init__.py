"""Header, limits, budget and regions: what a user states for a report."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
