from .bspline import SplinePatch as SplinePatch
from .bspline import bspline as bspline
from .control_net_file import read_net as read_net
from .nurbs import SplineMap as SplineMap
from .nurbs_checks import MOST_POINTS as MOST_POINTS
from .nurbs_checks import regularity_faults as regularity_faults
