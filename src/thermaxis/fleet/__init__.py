"""Many machines: what they ship, what is known of each, and what a night finds of it."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
