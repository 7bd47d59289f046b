"""The fewest patches that cover a surface, and the joint moves between them."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
