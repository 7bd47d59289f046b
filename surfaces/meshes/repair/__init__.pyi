from .cleaning import clean as clean
from .mesh_notes import remarks as remarks
from .orientation import one_fan_each as one_fan_each
from .weld import weld_distance as weld_distance
