from .landing import UNKNOWN as UNKNOWN
from .landing import UNREACHED as UNREACHED
from .landing import land as land
from .lemma import HOLDS as HOLDS
from .memory import Tile as Tile
from .memory import tile_memory as tile_memory
