from .directions import made_orthogonal as made_orthogonal
from .directions import unit_axis as unit_axis
from .poses import FURTHEST_BASE as FURTHEST_BASE
from .poses import FURTHEST_TCP as FURTHEST_TCP
from .poses import about_fixed_axes as about_fixed_axes
from .poses import checked_pose as checked_pose
from .poses import matrix_of as matrix_of
from .poses import rigid_matrix as rigid_matrix
