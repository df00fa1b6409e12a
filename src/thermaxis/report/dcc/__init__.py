"""The certificate of a positioning run as PTB's Digital Calibration Certificate."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
