"""The paper's method, readable beside the paper: J-cells, Algorithm 1, Algorithm 2, tree T,
graph G.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
