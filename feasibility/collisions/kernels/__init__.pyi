from .clearance import blamed as blamed
from .clearance import clearance_gradient as clearance_gradient
from .clearance import collision_buffer as collision_buffer
from .clearance import configuration_bounds as configuration_bounds
from .clearance import segment_clear as segment_clear
from .packing import INFLUENCE as INFLUENCE
