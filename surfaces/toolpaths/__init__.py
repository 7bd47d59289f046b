"""Poses as cells: a toolpath, or a set of points with normals, and the curves between them."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
