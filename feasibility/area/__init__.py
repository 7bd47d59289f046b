"""Certified area: tiles of the surface, all over which the tool of one motion gets."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
