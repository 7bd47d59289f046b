from .mesh_cells import MeshCells as MeshCells
