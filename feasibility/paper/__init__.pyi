from .greedy_search import greedy_check as greedy_check
from .starts import starts as starts
from .tree_motion import tree_walk as tree_walk
