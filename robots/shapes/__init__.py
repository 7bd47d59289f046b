"""The shapes of an arm's links: exact ones for the judge, convex outer ones for the search, and
which pairs of links can meet at all.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
