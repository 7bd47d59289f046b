"""From a verdict to a motion: the order of the cells, and the configuration over each."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
