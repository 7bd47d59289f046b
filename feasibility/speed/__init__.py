"""Motions that hold a speed, or keep away from singularities, among all that are known."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
