"""Where an arm is mounted: poses as they are given, its base, TCP, the tool's axes."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
