"""Pictures of passes over a surface, numbered, with what they treat."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
