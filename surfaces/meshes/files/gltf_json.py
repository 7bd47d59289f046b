"""The JSON of an untrusted glTF scene, asked for one checked value at a time."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from surfaces.surface import SurfaceError


class Json:
    """An object of the scene, and where in it that stands."""

    def __init__(self, content: Any, where: str, index: int = -1) -> None:
        """Wrap decoded JSON.

        Raises:
            SurfaceError: it is not an object.
        """
        self.where = where
        self.index = index
        """Its place in its list; -1 for others."""
        if not isinstance(content, dict):
            raise self.error("must be a JSON object")
        self.content: dict[str, Any] = content

    def error(self, fault: str) -> SurfaceError:
        """What is wrong with this object."""
        return SurfaceError(f"{self.where} {fault}")

    def has(self, key: str) -> bool:
        """Whether the object has a value of this name."""
        return key in self.content

    def integer(self, key: str, low: int, high: int = 1 << 40, default: int | None = None) -> int:
        """A whole number in low .. high."""
        value = self.content.get(key, default)
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise self.error(f"must have a whole number {key!r} in {low} .. {high}")
        return value

    def string(self, key: str) -> str:
        """A text."""
        value = self.content.get(key)
        if not isinstance(value, str):
            raise self.error(f"must have a text {key!r}")
        return value

    def flag(self, key: str) -> bool:
        """A truth value, false where it is missing."""
        return self.content.get(key, False) is True

    def inner(self, key: str) -> Json:
        """An object within this one."""
        return Json(self.content.get(key), f"{self.where}, {key!r}")

    def values(self, key: str) -> list[Any]:
        """A list, empty where it is missing."""
        value = self.content.get(key, [])
        if not isinstance(value, list):
            raise self.error(f"must have a list {key!r}")
        return value

    def objects(self, key: str) -> Iterator[Json]:
        """The objects of a list."""
        for k, value in enumerate(self.values(key)):
            yield Json(value, f"{self.where}, {key}[{k}]", k)

    def strings(self, key: str) -> list[str]:
        """The texts of a list."""
        values = self.values(key)
        if not all(isinstance(value, str) for value in values):
            raise self.error(f"must have a list of texts {key!r}")
        return values

    def numbers(self, key: str, default: list[float]) -> list[float]:
        """As many numbers, within 1e12, as the default has."""
        values = self.content.get(key, default)
        if not isinstance(values, list) or len(values) != len(default):
            raise self.error(f"must have {len(default)} numbers {key!r}")
        for value in values:
            number = isinstance(value, (int, float)) and not isinstance(value, bool)
            if not number or not abs(value) <= 1e12:
                raise self.error(f"must have numbers {key!r} within 1e12")
        return [float(value) for value in values]

    def indices(self, key: str, count: int) -> list[int]:
        """Whole numbers in 0 .. count - 1."""
        values = self.values(key)
        for value in values:
            if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < count:
                raise self.error(f"must have whole numbers {key!r} in 0 .. {count - 1}")
        return values

    def item(self, key: str, holder: Json, name: str) -> Json:
        """The object of the list `key` that `holder` names by its number `name`."""
        values = self.values(key)
        if not holder.has(name):
            raise holder.error(f"has no {name!r}")
        k = holder.integer(name, 0)
        if k >= len(values):
            raise holder.error(f"names {key}[{k}], of {len(values)}")
        return Json(values[k], f"{key}[{k}]", k)
