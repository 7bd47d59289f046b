from .balls_inside import balls_inside as balls_inside
from .distances import distance_from as distance_from
from .pose_boxes import Blocking as Blocking
from .pose_boxes import ToolAlone as ToolAlone
from .pose_boxes import tool_alone_of as tool_alone_of
