"""The JSON of a result file, every entry checked when it is read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from coverable_errors import shown
from feasibility.results.archive import Archive


class Fields:
    """A JSON object of the file whose entries are checked when they are read."""

    def __init__(self, archive: Archive, entries: Mapping[str, Any], path: str) -> None:
        """Read `entries`, which stand under `path` in the file."""
        self.archive, self.entries, self.path = archive, entries, path

    def get(self, key: str, kinds: type | tuple[type, ...], expected: str) -> Any:
        """The entry `key`, which must be of one of some types."""
        value = self.entries.get(key, self)  # self: a stand-in that is of no JSON type
        is_truth = isinstance(value, bool) and kinds is not bool
        if is_truth or not isinstance(value, kinds):
            found = "nothing" if value is self else shown(value)
            raise self.archive.error(f"meta.json: {self.path}{key} is {found}, not {expected}")
        return value

    def text(self, key: str) -> str:
        """A string."""
        return str(self.get(key, str, "text"))

    def table(self, key: str) -> Fields:
        """An object."""
        return Fields(self.archive, self.get(key, dict, "an object"), f"{self.path}{key}.")

    def flag(self, key: str) -> bool:
        """A truth value."""
        return bool(self.get(key, bool, "true or false"))

    def number(self, key: str) -> float:
        """A number."""
        return float(self.get(key, (int, float), "a number"))

    def cell(self, key: str, count: int) -> int:
        """The index of one of `count` cells."""
        value = int(self.get(key, int, "a cell"))
        if not 0 <= value < count:
            raise self.archive.error(f"meta.json: {self.path}{key} is no cell of {count}: {value}")
        return value

    def member(self, key: str, kind: Any) -> Any:
        """A member of a StrEnum."""
        value = self.text(key)
        if value not in list(kind):
            options = ", ".join(kind)
            raise self.archive.error(
                f"meta.json: {self.path}{key} is {shown(value)}, not one of {options}"
            )
        return kind(value)
