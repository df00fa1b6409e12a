"""Thermal tests of ISO 230-3: what was measured to what a report states."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
