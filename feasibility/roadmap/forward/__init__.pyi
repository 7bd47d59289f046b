from .run import OrderedRun as OrderedRun
from .run import changes_in_place as changes_in_place
from .run import run_in_order as run_in_order
