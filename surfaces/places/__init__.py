"""A surface and its offset as places that a tool can follow: nearest ones, and paths between."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
