from .colours import Painted as Painted
from .colours import area_layers as area_layers
from .colours import painted_layers as painted_layers
from .colours import surface_layer as surface_layer
