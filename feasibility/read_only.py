"""Results whose arrays nobody changes by accident."""

from __future__ import annotations

from dataclasses import fields

import numpy as np


class ReadOnlyArrays:
    """Base of frozen dataclasses: each array among the fields is copied and write-protected."""

    __slots__ = ()

    def __post_init__(self) -> None:
        """Replace the arrays by copies."""
        for item in fields(self):  # type: ignore[arg-type]
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                value = value.copy()
                value.flags.writeable = False
                object.__setattr__(self, item.name, value)
