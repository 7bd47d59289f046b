from .cleaning import clean as clean
from .degenerate import weld_distance as weld_distance
from .mesh_notes import notes_of as notes_of
from .orientation import one_fan_each as one_fan_each
