from .division import Apart as Apart
from .division import Division as Division
from .division import Plan as Plan
from .division import SubPatch as SubPatch
from .fewest_patches import divide as divide
from .reconfiguration import Reconfiguration as Reconfiguration
from .set_covering import set_cover as set_cover
from .set_covering import undominated as undominated
