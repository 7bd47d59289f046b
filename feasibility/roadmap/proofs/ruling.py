"""What branch and bound says of a cell."""

from enum import IntEnum


class Ruling(IntEnum):
    """The outcome of branch and bound."""

    OPEN = 0
    """Boxes are left: call again to go on."""
    PROVED = 1
    """No configuration holds the tool there."""
    REACHED = 2
    """A box's centre does."""
    UNKNOWN = 3
    """A box too thin to split could not be discarded."""
