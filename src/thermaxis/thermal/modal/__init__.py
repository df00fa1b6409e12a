"""The modal estimator: sums of first-order lags, averaged over their time constants."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
