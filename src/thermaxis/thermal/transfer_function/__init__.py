"""Transfer functions: ARX and output error, their conversion, superposition and residuals."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
