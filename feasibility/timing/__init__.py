"""Time along a path, within the limits of joints, tool and controller."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
