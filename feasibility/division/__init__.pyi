from .divide import divide as divide
from .division import Division as Division
from .division import Plan as Plan
from .division import SubPatch as SubPatch
from .reconfiguration import Reconfiguration as Reconfiguration
from .set_cover import set_cover as set_cover
from .set_cover import undominated as undominated
