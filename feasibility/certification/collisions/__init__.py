"""The judge of collisions: certified clearance of exact bodies along a motion."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
