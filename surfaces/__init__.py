"""What is to be covered: surfaces, their pose and working side, their E-cells, and the curves
between them.
"""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
