from .net import WorkingMesh as WorkingMesh
from .parallel import Passes as Passes
from .parallel import parallel_passes as parallel_passes
from .stretches import Pass as Pass
from .treated import ToolLines as ToolLines
from .treated import Treated as Treated
from .treated import treated_share as treated_share
from .triangulation import working_mesh as working_mesh
