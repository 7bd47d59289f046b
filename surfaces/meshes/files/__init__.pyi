from .mesh_file import metres_per_unit as metres_per_unit
from .mesh_file import read_mesh as read_mesh
from .mesh_file import refuse_unlikely_unit as refuse_unlikely_unit
from .mesh_file import with_likely_unit as with_likely_unit
