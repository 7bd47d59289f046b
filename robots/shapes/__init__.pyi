from .bodies import Polytope as Polytope
from .bodies import Solid as Solid
from .bodies import Triangles as Triangles
