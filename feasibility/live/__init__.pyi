from .controls import Controls as Controls
from .showing import Live as Live
from .showing import live as live
