from .run import Run as Run
from .run import changes_in_place as changes_in_place
from .run import run_in_order as run_in_order
