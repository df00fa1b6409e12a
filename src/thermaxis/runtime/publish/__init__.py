"""Status server, metrics and history in a process of their own, beside the one that acts."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
