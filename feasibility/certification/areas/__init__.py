"""The judge of certified areas: are tiles joined to a motion, and does each hold all over?"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
