"""Where values come from: OPC UA servers, and logs that are played."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
