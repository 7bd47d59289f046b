"""What an arm is: a Pinocchio model of its free joints, a tool, and real limits."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
