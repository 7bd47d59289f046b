from .errors import MeshError as MeshError
from .mesh_file import read_raw as read_raw
from .raw_mesh import RawMesh as RawMesh
from .robot_files import FilePart as FilePart
from .robot_files import MeshFiles as MeshFiles
