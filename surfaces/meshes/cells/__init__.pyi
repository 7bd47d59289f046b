from .mesh_cells import MeshCells as MeshCells
from .subdivision import subdivide as subdivide
