"""Do bodies overlap in every pose of the tool over a cell, or all over boxes of joint values?"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
