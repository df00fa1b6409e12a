"""What is compared, without the charts of it."""

from typing import NamedTuple

from thermaxis.compensation import CompensationModel
from thermaxis.thermal import Verification


class ComparedModel(NamedTuple):
    """A model and its verification on the log that all of them are compared on."""

    name: str
    """Name by which it is shown."""
    model: CompensationModel
    result: Verification
    """Its verification on that log alone."""
