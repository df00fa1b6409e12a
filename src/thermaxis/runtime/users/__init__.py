"""Users of the status server: names, roles, passwords, and log-ins that failed."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
