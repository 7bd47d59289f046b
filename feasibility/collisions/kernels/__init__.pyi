from .clearance import blamed as blamed
from .clearance import clearance_gradient as clearance_gradient
from .clearance import segment_clear as segment_clear
from .memory import collision_buffer as collision_buffer
from .memory import configuration_bounds as configuration_bounds
from .packing import INFLUENCE as INFLUENCE
