"""Joint boxes in which the arm collides wherever its tool is at a target: proofs by inner balls."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
