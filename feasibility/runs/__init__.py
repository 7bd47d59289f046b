"""Passes in as few motions as the known ones allow, where no single one runs them all."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
