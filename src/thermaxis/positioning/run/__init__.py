"""A measured run: targets, readings, order and times, with what the file says of them."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
