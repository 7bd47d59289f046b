from .arcs import arc_angles as arc_angles
from .arcs import arc_at as arc_at
from .arcs import straight as straight
from .given import poses as poses
from .pose_cells import PoseCells as PoseCells
from .pose_file import read_poses as read_poses
from .pose_surface import PoseSurface as PoseSurface
