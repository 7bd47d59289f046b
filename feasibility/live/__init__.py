"""A page where one moves the part and turns limits, and the verdict follows."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
