from .curves_over_bends import over_bends as over_bends
from .curves_over_creases import over_creases as over_creases
from .mesh_cells import MeshCells as MeshCells
