from .axis import *
from .lathe import *
