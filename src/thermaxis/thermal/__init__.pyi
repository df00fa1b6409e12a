from ._arrays import FloatArray as FloatArray
from .design import *
from .identification import *
from .images import *
from .log import *
from .modal import *
from .relearning import *
from .selection import *
from .test import *
from .transfer_function import *
from .verification import *
