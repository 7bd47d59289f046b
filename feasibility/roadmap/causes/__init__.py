"""Causes: why cells are missed, by which constraint or by which cut, and by how much."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
