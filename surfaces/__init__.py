"""What is to be covered: surfaces, their pose and working side, and their E-cells."""

from surfaces.cells import Cells
from surfaces.cone import cone
from surfaces.ellipsoid import ellipsoid
from surfaces.mesh import MeshSurface, mesh
from surfaces.net_file import read_net
from surfaces.parametric import cylinder, hyperboloid, plane, sphere
from surfaces.patch import Patch
from surfaces.piecewise import Piecewise, piecewise
from surfaces.revolution import revolution
from surfaces.spline import bspline
from surfaces.surface import Surface, SurfaceError
from surfaces.torus import torus

__all__ = [
    "Cells",
    "MeshSurface",
    "Patch",
    "Piecewise",
    "Surface",
    "SurfaceError",
    "bspline",
    "cone",
    "cylinder",
    "ellipsoid",
    "hyperboloid",
    "mesh",
    "piecewise",
    "plane",
    "read_net",
    "revolution",
    "sphere",
    "torus",
]
