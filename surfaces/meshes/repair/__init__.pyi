from .clean import clean as clean
from .orientation import one_fan_each as one_fan_each
from .remarks import remarks as remarks
from .weld import weld_distance as weld_distance
