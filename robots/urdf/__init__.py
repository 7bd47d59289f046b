"""The check that every URDF passes before a native parser sees it: one tree, or one error
with all its faults.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
