from .standing_world import GROUP as GROUP
from .standing_world import carried as carried
from .standing_world import in_world as in_world
from .standing_world import root_in_world as root_in_world
from .standing_world import world_tracks as world_tracks
from .triads import triad as triad
from .triads import triads as triads
