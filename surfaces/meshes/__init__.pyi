from .mesh_surface import MeshSurface as MeshSurface
from .mesh_surface import mesh as mesh
from .selection import cut_box as cut_box
from .selection import cut_plane as cut_plane
from .selection import faces_within_cone as faces_within_cone
from .selection import take_faces as take_faces
from .triangle_mesh import TriangleMesh as TriangleMesh
