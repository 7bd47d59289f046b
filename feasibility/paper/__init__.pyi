from .greedy_search import greedy_check as greedy_check
from .tree_motion import tree_walk as tree_walk
