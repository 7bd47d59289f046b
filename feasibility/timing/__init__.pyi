from .path_timing import move_refusal as move_refusal
from .path_timing import timed_moves as timed_moves
from .path_timing import trajectory as trajectory
from .sampled_trajectory import Trajectory as Trajectory
from .sampled_trajectory import at_times as at_times
from .speed_limits import MotionLimits as MotionLimits
from .speed_limits import motion_limits as motion_limits
from .tool_between_samples import used as used
