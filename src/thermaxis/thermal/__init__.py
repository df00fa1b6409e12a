"""Thermal errors: logs, identification, verification; thermal fields. Numbers in, results out."""

from lazy_loader import attach

from thermaxis.thermal import (
    design,
    identification,
    images,
    log,
    modal,
    relearning,
    selection,
    test,
    transfer_function,
    verification,
)

_ROOMS = (
    log,
    modal,
    selection,
    transfer_function,
    verification,
    identification,
    relearning,
    images,
    test,
    design,
)
_NAMES = {room.__name__.rpartition(".")[2]: dir(room) for room in _ROOMS}
__getattr__, __dir__, __all__ = attach(__name__, submod_attrs={"_arrays": ["FloatArray"], **_NAMES})
del modal  # the estimator of this name is exported, not its folder
