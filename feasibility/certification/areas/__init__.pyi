from .joined import joined as joined
from .tile_lemma import tiles_hold as tiles_hold
