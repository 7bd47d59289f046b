"""What the arm may hit: the bodies of links, tool, scene and surface, the pairs that are checked,
and certified bounds on their distances for the search.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
