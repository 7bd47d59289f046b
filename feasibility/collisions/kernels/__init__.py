"""Certified bounds on the distances of bodies, compiled: at configurations, and all along straight
joint segments. The search kernels call them by address.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
