from .bspline import bspline as bspline
from .control_net_file import read_net as read_net
