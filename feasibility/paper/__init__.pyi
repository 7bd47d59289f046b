from .greedy_check import greedy_check as greedy_check
from .tree_walk import tree_walk as tree_walk
