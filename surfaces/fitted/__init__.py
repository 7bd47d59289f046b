"""Spline surfaces fitted to what users have: a formula of their own, or a grid of points."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
