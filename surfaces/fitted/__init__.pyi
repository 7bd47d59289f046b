from .fitted_patch import FittedPatch as FittedPatch
from .formula import parametric as parametric
from .grid_file import read_grid as read_grid
from .point_grid import grid as grid
