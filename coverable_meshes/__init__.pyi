from .mesh_file import read_raw as read_raw
from .raw_mesh import MeshError as MeshError
from .raw_mesh import RawMesh as RawMesh
from .raw_mesh import distinct as distinct
from .robot_files import MeshFiles as MeshFiles
from .robot_files import largest_file as largest_file
