"""The share of the surface that a certified motion treats, and what it leaves untreated."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
