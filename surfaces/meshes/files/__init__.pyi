from .read_mesh import metres_per_unit as metres_per_unit
from .read_mesh import read_mesh as read_mesh
