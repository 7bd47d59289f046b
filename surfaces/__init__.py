"""What is to be covered: surfaces, their pose and working side, and their E-cells."""

from surfaces.cells import Cells
from surfaces.parametric import cylinder, hyperboloid, plane, sphere
from surfaces.patch import Patch
from surfaces.surface import Surface, SurfaceError

__all__ = [
    "Cells",
    "Patch",
    "Surface",
    "SurfaceError",
    "cylinder",
    "hyperboloid",
    "plane",
    "sphere",
]
