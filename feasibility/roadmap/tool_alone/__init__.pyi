from .balls_inside import balls_inside as balls_inside
from .balls_inside import is_convex as is_convex
from .distances import Distance as Distance
from .distances import distance_from as distance_from
from .pose_boxes import ToolAlone as ToolAlone
from .pose_boxes import ToolBlocked as ToolBlocked
