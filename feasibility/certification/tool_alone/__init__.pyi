from .erosion import planes_around as planes_around
from .every_pose import PoseCheck as PoseCheck
from .every_pose import never_clear as never_clear
