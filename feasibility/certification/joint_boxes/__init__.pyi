from .everywhere import Overlapping as Overlapping
