from ._publisher import (
    Publisher as Publisher,
    Servers as Servers,
)
from ._servers import (
    serve as serve,
)
