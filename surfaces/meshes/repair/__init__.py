"""Any triangles into a clean oriented 2-manifold, every repair reported."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
