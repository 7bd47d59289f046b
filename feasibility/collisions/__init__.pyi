from .bodies import Bodies as Bodies
from .bodies import LeftOut as LeftOut
from .bodies import Pair as Pair
from .bodies import Soup as Soup
from .scene import HalfSpace as HalfSpace
from .scene import Obstacle as Obstacle
from .scene import ToolShape as ToolShape
from .settings import Collision as Collision
