from .controller_interpolation import used as used
from .path_timing import trajectory as trajectory
from .speed_limits import MotionLimits as MotionLimits
from .speed_limits import motion_limits as motion_limits
from .trajectory import Trajectory as Trajectory
