from .everywhere import Overlapping as Overlapping
from .everywhere import overlapping_of as overlapping_of
