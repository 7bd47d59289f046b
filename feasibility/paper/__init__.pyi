from .greedy import greedy_search as greedy_search
from .literal import LiteralSearch as LiteralSearch
from .starts import starts as starts
from .tree_and_graph import tree_walk as tree_walk
from .tree_replay import replay_stored as replay_stored
