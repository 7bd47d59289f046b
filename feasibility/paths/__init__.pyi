from .coverage import CoveragePath as CoveragePath
from .coverage import coverage_path as coverage_path
from .metrics import PathFigures as PathFigures
from .order import Order as Order
from .order import PathError as PathError
from .order import check_order as check_order
from .two_opt import improved as improved
