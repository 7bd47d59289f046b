from .replay import Replay as Replay
from .replay import placements as placements
from .replay import replay as replay
