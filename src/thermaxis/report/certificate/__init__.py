"""The certificate of a positioning run as PDF and HTML."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
