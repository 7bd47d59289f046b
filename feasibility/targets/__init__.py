"""The task applied to a surface: where tool point, axis and reference direction have to be, along
the curves between cell centres and all over the parts of a surface.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
