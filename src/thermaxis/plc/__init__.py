"""The compensation as text for a PLC: one tree, printed as ST, SCL and C.

What the block does is `thermaxis.compensation.cycle`, in the number type of the target. It is
built once (`build_program`), as a tree of few kinds of statement (`_tree`), and every dialect
prints the same tree. `BlockInstance` executes it in Python with the target's rounding: it computes
the test vectors.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
