"""Cells over which the tool collides in every pose that would cover them: the arm is not needed."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
