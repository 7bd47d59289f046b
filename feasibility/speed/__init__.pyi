from .asking import check_asked as check_asked
from .deciding import TOO_SLOW as TOO_SLOW
from .deciding import at_rates as at_rates
from .largest import RateFigures as RateFigures
from .largest import rate_figures as rate_figures
from .of_paths import path_rates as path_rates
