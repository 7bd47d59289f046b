"""Cells cut into ever smaller tiles, with bounds on the offset points and normals over each."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
