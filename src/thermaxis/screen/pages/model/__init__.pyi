from ._facts import (
    Json as Json,
)
