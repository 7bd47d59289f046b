from .balls_inside import balls_inside as balls_inside
from .balls_inside import corners_of as corners_of
from .balls_inside import is_convex as is_convex
from .distances import Distance as Distance
from .distances import distance_from as distance_from
from .pose_boxes import Blocking as Blocking
from .pose_boxes import ToolAlone as ToolAlone
from .pose_boxes import tool_alone_of as tool_alone_of
