from .every_pose import PoseCheck as PoseCheck
from .every_pose import never_clear as never_clear
from .everywhere import Overlapping as Overlapping
