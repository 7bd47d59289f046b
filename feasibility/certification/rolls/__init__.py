"""The judge of the roll: bounds between exact configurations, along curves and over a surface."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
