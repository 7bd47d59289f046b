"""A file of named arrays and one JSON text: a zip of .npy members, read without trusting it.

`numpy.load` could read such a file too (it holds no pickles). It is not used, because it makes
room for what a header claims before it looks whether the data is there.
"""

from __future__ import annotations

import io
import json
import math
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from coverable_errors import CoverableError
from coverable_files import size
from feasibility.safe_files import FileError, read_regular, shown_path, write_whole

TEXT_MEMBER = "meta.json"
LARGEST_FILE = 512 << 20  # bytes, as it lies on the disk
LARGEST_CONTENT = 2 << 30  # bytes of all members, inflated
LARGEST_TEXT = 64 << 20  # bytes of the JSON member, inflated
MOST_MEMBERS = 64

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
        """Open a file and check its table of contents.

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
            raise ArchiveError(str(error)) from error
        try:
            self._file = zipfile.ZipFile(io.BytesIO(data))
            members = self._file.infolist()
        except (zipfile.BadZipFile, NotImplementedError, ValueError, OSError) as error:
            raise self.error(f"is not {what}: {error}") from error
        if len(members) > MOST_MEMBERS:
            raise self.error(f"holds {len(members)} members, more than {MOST_MEMBERS}; not {what}")
        total = sum(member.file_size for member in members)
        if total > LARGEST_CONTENT:
            raise self.error(f"would inflate to {size(total)}, more than {size(LARGEST_CONTENT)}")
        self._members: dict[str, zipfile.ZipInfo] = {}
        for member in members:
            if member.filename in self._members:
                raise self.error(f"holds {member.filename!r} twice")
            if member.flag_bits & 0x1:
                raise self.error(f"holds {member.filename!r} encrypted")
            if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                raise self.error(f"holds {member.filename!r} compressed in an unknown way")
            self._members[member.filename] = member

    def error(self, message: str) -> ArchiveError:
        """An error that names the file."""
        return ArchiveError(f"{self.name}: {message}")

    def _read(self, name: str, cap: int) -> bytes:
        """One member, inflated to at most `cap` bytes, whatever its header says."""
        member = self._members.get(name)
        if member is None:
            raise self.error(f"lacks {name!r}")
        if member.file_size > cap:
            raise self.error(f"{name!r} would inflate to {size(member.file_size)}; too large")
        try:
            with self._file.open(member) as stream:
                data = stream.read(cap + 1)
        except (zipfile.BadZipFile, zlib.error, NotImplementedError, EOFError, OSError) as error:
            raise self.error(f"{name!r} is damaged: {error}") from error
        except (ValueError, RuntimeError) as error:
            raise self.error(f"{name!r} cannot be read: {error}") from error
        if len(data) != member.file_size:
            raise self.error(f"{name!r} does not have the size that the file claims")
        return data

    def meta(self) -> dict[str, Any]:
        """The JSON object.

        Raises:
            ArchiveError: there is none.
        """

        def refuse(constant: str) -> None:
            raise ValueError(f"{constant} is no JSON number")

        try:
            meta = json.loads(self._read(TEXT_MEMBER, LARGEST_TEXT), parse_constant=refuse)
        except (ValueError, RecursionError) as error:
            if isinstance(error, ArchiveError):
                raise
            raise self.error(f"{TEXT_MEMBER!r} is not JSON: {error}") from error
        if not isinstance(meta, dict):
            raise self.error(f"{TEXT_MEMBER!r} is not a JSON object")
        return meta

    def array(self, name: str, dtype: Dtype, shape: tuple[int | None, ...]) -> NDArray[Any]:
        """One array of finite numbers.

        Args:
            name: without the ending.
            dtype: float64 or int64.
            shape: its lengths; None where any will do.

        Raises:
            ArchiveError: it is missing, damaged, or of another type or shape.
        """
        data = self._read(f"{name}.npy", LARGEST_CONTENT)
        stream = io.BytesIO(data)
        try:
            if np.lib.format.read_magic(stream) != (1, 0):
                raise ValueError("it is of an unknown version")
            found, fortran, kind = np.lib.format.read_array_header_1_0(stream)
        except (ValueError, RecursionError, MemoryError, TypeError) as error:
            raise self.error(f"{name!r} is no array: {error}") from error
        if kind != np.dtype(dtype) or fortran:
            raise self.error(f"{name!r} holds {kind}, not {np.dtype(dtype)} row by row")
        fits = len(found) == len(shape) and all(
            length >= 0 and wanted in (None, length)
            for length, wanted in zip(found, shape, strict=True)
        )
        if not fits:
            wanted = " x ".join("any" if length is None else str(length) for length in shape)
            raise self.error(f"{name!r} has the shape {found}, not {wanted}")
        body = data[stream.tell() :]
        if math.prod(found) * kind.itemsize != len(body):
            raise self.error(f"{name!r} holds {len(body)} bytes, which is not {found} of {kind}")
        array = np.frombuffer(body, dtype=kind).reshape(found)
        if dtype is np.float64 and not np.isfinite(array).all():
            raise self.error(f"{name!r} holds NaN or infinite values")
        return array
