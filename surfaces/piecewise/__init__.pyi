from .cells import PieceCells as PieceCells
from .piecewise_surface import Piecewise as Piecewise
from .piecewise_surface import piecewise as piecewise
