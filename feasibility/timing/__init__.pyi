from .limits_used import used as used
from .path_timing import trajectory as trajectory
from .sampled_trajectory import Trajectory as Trajectory
from .speed_limits import MotionLimits as MotionLimits
from .speed_limits import motion_limits as motion_limits
