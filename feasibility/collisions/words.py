"""What every answer, page and trajectory says about collisions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

SURFACE, TOOL = "surface", "tool"
"""What pairs call the surface, and the tool."""
UNCHECKED = "collisions are not checked"
CHECKABLE = {"self": "the arm itself", "surface": "the surface", "scene": "the scene"}


class Asked(Protocol):
    """What was asked for: a `Collision`, or the table of a case."""

    @property
    def checked(self) -> tuple[str, ...]:
        """Some of 'self', 'surface' and 'scene'."""

    @property
    def clearance(self) -> float:
        """m, every pair."""

    @property
    def tool_clearance(self) -> float:
        """m, the tool against the surface."""


def asked_for(self_: bool, surface: bool, scene: bool) -> tuple[str, ...]:
    """What is to be checked, in the words of JSON."""
    wanted = {"self": self_, "surface": surface, "scene": scene}
    return tuple(name for name in CHECKABLE if wanted[name])


def checked(asked: Asked | None) -> list[str]:
    """What is checked, in the words of JSON."""
    return [] if asked is None else list(asked.checked)


def listed_words(names: Sequence[str]) -> str:
    """The sentence that says what is checked.

    Example:
        >>> listed_words(["self", "surface", "scene"])
        'collisions are checked with the arm itself, the surface and the scene'
    """
    if not names:
        return UNCHECKED
    *most, last = [CHECKABLE[name] for name in names]
    return f"collisions are checked with {', '.join(most)}{' and ' if most else ''}{last}"


def checked_words(asked: Asked | None) -> str:
    """The sentence that says what is checked, and with which clearance.

    Example:
        >>> checked_words(None)
        'collisions are not checked'
        >>> from coverable import Collision
        >>> print(checked_words(Collision(surface=False, clearance=0.005)))
        collisions are checked with the arm itself, 5 mm apart
    """
    if asked is None or not asked.checked:
        return UNCHECKED
    sentence = f"{listed_words(asked.checked)}, {1e3 * asked.clearance:g} mm apart"
    if "surface" in asked.checked and asked.tool_clearance != asked.clearance:
        sentence += f" (the tool and the surface {1e3 * asked.tool_clearance:g} mm)"
    return sentence
