"""A file of named arrays and one JSON text: a zip of .npy members, read without trusting it.

`numpy.load` without pickles reads it: numpy 2 refuses a header that claims more than there is
before it makes room. The inflated size of the members is read from the zip first.
"""

from __future__ import annotations

import io
import json
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from coverable.errors import CoverableError, shown
from coverable.files import size
from feasibility.read_files import FileError, read_regular, shown_path
from feasibility.safe_files import write_whole

TEXT_MEMBER = "meta.json"
LARGEST_FILE = 512 << 20  # bytes, as it lies on the disk
LARGEST_CONTENT = 2 << 30  # bytes of all members, inflated
LARGEST_TEXT = 64 << 20  # bytes of the JSON member, inflated
MOST_MEMBERS = 64
MOST = 1e300  # of numbers: in degrees they are finite, too
DAMAGED = (
    zipfile.BadZipFile, zlib.error, ValueError, RuntimeError, EOFError, OSError, MemoryError,
    tokenize.TokenError, SyntaxError, TypeError,
)  # fmt: skip
"""What numpy and zipfile raise for a file that is none; NotImplementedError is a RuntimeError.

numpy reads the header of an array as Python 2 would have written it, token by token."""

Dtype = type[np.float64] | type[np.int64]


class ArchiveError(CoverableError):
    """A file that does not hold what it should."""


def write_archive(path: str | Path, meta: Mapping[str, Any], arrays: Mapping[str, NDArray]) -> None:
    """Write a JSON object and arrays (float64 or int64) as one compressed file.

    Raises:
        FileError: the file cannot be written.
    """
    text = json.dumps(meta, allow_nan=False, indent=1)

    def write(stream: IO[bytes]) -> None:
        with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as file:
            # A fixed date: the same verdict gives the same bytes.
            _add(file, TEXT_MEMBER, text.encode())
            for name, array in arrays.items():
                buffer = io.BytesIO()
                plain = np.ascontiguousarray(array)
                np.lib.format.write_array(buffer, plain, version=(1, 0), allow_pickle=False)
                _add(file, f"{name}.npy", buffer.getvalue())

    write_whole(path, write)


def _add(file: zipfile.ZipFile, name: str, data: bytes) -> None:
    """Add one member with a fixed date."""
    info = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
    info.compress_type = zipfile.ZIP_DEFLATED
    info.external_attr = 0o644 << 16
    file.writestr(info, data)


class Archive:
    """An untrusted file that `write_archive` may have written, opened for reading."""

    def __init__(self, path: str | Path, what: str) -> None:
        """Open a file; no more of it is read than its table of contents.

        Args:
            path: the file.
            what: what it should be, for messages.

        Raises:
            ArchiveError: it cannot be read, is too large, or is no such file.
        """
        self.name = shown_path(path)
        try:
            data = read_regular(path, LARGEST_FILE, what)
        except FileError as error:
            raise ArchiveError(error.faults, error.source) from error
        if not data.startswith(b"PK\x03\x04"):  # numpy would suggest to trust what it cannot read
            raise self.error(f"is not {what}")
        try:
            found = np.load(io.BytesIO(data), allow_pickle=False)
        except DAMAGED as error:
            raise self.error(f"is not {what}: {error}") from error
        self._file = found
        members = found.zip.infolist()
        if len(members) > MOST_MEMBERS:
            raise self.error(f"holds {len(members)} members, more than {MOST_MEMBERS}; not {what}")
        if len({member.filename for member in members}) < len(members):
            raise self.error("holds a member twice")
        total = sum(member.file_size for member in members)
        text = sum(member.file_size for member in members if member.filename == TEXT_MEMBER)
        if total > LARGEST_CONTENT or text > LARGEST_TEXT:
            raise self.error(
                f"would inflate to {size(total)}, {size(text)} of it text; at most "
                f"{size(LARGEST_CONTENT)} and {size(LARGEST_TEXT)} are read"
            )

    def __contains__(self, name: str) -> bool:
        """Is there an array of that name?"""
        return f"{name}.npy" in self._file

    def error(self, message: str) -> ArchiveError:
        """An error that names the file."""
        return ArchiveError(message, self.name)

    def _read(self, name: str) -> Any:
        """One member: an array, or the bytes of anything else."""
        try:
            return self._file[name]
        except KeyError as error:
            raise self.error(f"lacks {name!r}") from error
        except DAMAGED as error:
            raise self.error(f"{name!r} is damaged: {error}") from error

    def meta(self) -> dict[str, Any]:
        """The JSON object.

        Raises:
            ArchiveError: there is none.
        """

        def refuse(constant: str) -> None:
            raise ValueError(f"{constant} is no JSON number")

        data = self._read(TEXT_MEMBER)
        try:
            meta = json.loads(data, parse_constant=refuse)
        except (ValueError, TypeError, RecursionError) as error:
            raise self.error(f"{TEXT_MEMBER!r} is not JSON: {error}") from error
        if not isinstance(meta, dict):
            raise self.error(f"{TEXT_MEMBER!r} is not a JSON object")
        return meta

    def array(self, name: str, dtype: Dtype, shape: tuple[int | None, ...]) -> NDArray[Any]:
        """One array of finite numbers, write-protected.

        Args:
            name: without the ending.
            dtype: float64 or int64.
            shape: its lengths; None where any will do.

        Raises:
            ArchiveError: it is missing, damaged, or of another type or shape.
        """
        array = self._read(f"{name}.npy")
        if not isinstance(array, np.ndarray):
            raise self.error(f"{name!r} is no array")
        if array.dtype != dtype:
            raise self.error(f"{name!r} holds {array.dtype}, not {np.dtype(dtype)}")
        fits = array.ndim == len(shape) and all(
            wanted in (None, length) for length, wanted in zip(array.shape, shape, strict=True)
        )
        if not fits:
            wanted = " x ".join("any" if length is None else str(length) for length in shape)
            raise self.error(f"{name!r} has the shape {array.shape}, not {wanted}")
        if dtype is np.float64 and not (np.abs(array) <= MOST).all():
            raise self.error(f"{name!r} holds NaN, or values that are too large")
        array.flags.writeable = False
        return array


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
        """A finite number."""
        value = self.get(key, (int, float), "a number")
        if abs(value) > MOST:
            raise self.archive.error(f"meta.json: {self.path}{key} is no number up to {MOST:g}")
        return float(value)

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
