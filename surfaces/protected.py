"""Protected: values whose arrays nobody changes."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Protected:
    """A value whose arrays nobody changes, and which pickles as a call of its constructor."""

    def __post_init__(self) -> None:
        """Copy and write-protect the arrays; those in tuples are protected in place."""
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                value = np.array(value)
                object.__setattr__(self, field.name, value)
            for array in value if isinstance(value, tuple) else (value,):
                if isinstance(array, np.ndarray):
                    array.flags.writeable = False

    def __reduce__(self) -> tuple[object, ...]:
        """What is derived is derived again, and arrays are protected again."""
        return (type(self), tuple(getattr(self, item.name) for item in fields(self) if item.init))
