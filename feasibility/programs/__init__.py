"""Timed motions as programs of robot controllers: URScript, RAPID, KRL, FANUC's TP, INFORM."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
