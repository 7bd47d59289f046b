"""Entry and exit of a motion over a surface: along the approach direction, from and to home."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
