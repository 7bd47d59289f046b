from .offset_surfaces import offset_surface as offset_surface
from .places import OffsetSurface as OffsetSurface
from .places import PlacePaths as PlacePaths
from .places import Places as Places
from .places import second_derivative_of_unit as second_derivative_of_unit
