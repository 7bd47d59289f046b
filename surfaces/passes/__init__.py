"""Parallel passes over a surface, at a stated distance: what a painter or a polisher runs."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
