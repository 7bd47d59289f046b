"""The complete search: a roadmap of certified motions, proofs of infeasibility, and causes."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
