from .result_file import ResultError as ResultError
from .result_file import load_result as load_result
from .result_file import plain as plain
from .result_file import save_result as save_result
from .trajectory_files import check_ending as check_ending
from .trajectory_files import load_trajectory as load_trajectory
from .trajectory_files import save_trajectory as save_trajectory
