from .margin_along import margin_layers as margin_layers
from .treated import Painted as Painted
from .treated import area_layers as area_layers
from .treated import painted_layers as painted_layers
from .treated import surface_layer as surface_layer
