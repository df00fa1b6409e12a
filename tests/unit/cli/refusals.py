"""Commands that must be refused: what is wrong and where, without the sentence."""

import pytest

from thermaxis.cli import execute
from thermaxis.errors import ThermaxisError


def refusal(*words: object) -> ThermaxisError:
    """Return the error with which a command ends."""
    with pytest.raises(ThermaxisError) as caught:
        execute([str(word) for word in words])
    return caught.value


def code_of(*words: object) -> str:
    return refusal(*words).code
