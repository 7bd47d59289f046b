from . import comparison as comparison
from . import division as division
from . import explanation as explanation
from . import path as path
from . import placement as placement
from . import study as study
from . import verdict as verdict
from . import verification as verification
