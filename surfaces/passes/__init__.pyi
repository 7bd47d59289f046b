from .passes import Pass as Pass
from .passes import Passes as Passes
from .passes import parallel_passes as parallel_passes
