"""Frames in a picture: world, base and TCP as triads, and a world that stands still."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
