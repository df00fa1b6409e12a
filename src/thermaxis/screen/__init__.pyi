from ._assets import (
    CHART_SCRIPT as CHART_SCRIPT,
    Assets as Assets,
)
from ._server import (
    serve as serve,
)
from ._words import (
    LANGUAGES as LANGUAGES,
    Words as Words,
)
