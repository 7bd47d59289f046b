"""The error of this package."""

from __future__ import annotations

from coverable_errors import CoverableError


class MeshError(CoverableError):
    """A mesh file that cannot be read, and why."""
