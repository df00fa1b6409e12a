"""The compensation as text for a PLC: a library that is the same for all, and a block per model.

What library and block do is `thermaxis.compensation.cycle`, in the number type of the target.
`Block` makes the texts of every dialect, `vectors_of` what they must say, `guide_text` how they
come into the machine.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
