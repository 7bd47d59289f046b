"""The verifier of cut trees: is it proved that no single motion covers every cell?"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
