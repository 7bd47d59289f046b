"""Motions over a toolpath in its order: forward only, with changes of posture in place."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
