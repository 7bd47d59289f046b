"""Answers as text, JSON, CSV and HTML; one module for each kind of answer."""

from lazy_loader import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
