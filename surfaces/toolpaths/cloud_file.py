"""Points with normals as PCL writes them (.pcd): the targets of a study of REACH."""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array
from coverable.errors import number_in, shown
from surfaces.surface import SurfaceError
from surfaces.toolpaths.given import MOST_POSES

WANTED = ("x", "y", "z", "normal_x", "normal_y", "normal_z")
KINDS = {("F", "4"): "<f4", ("F", "8"): "<f8"} | {
    (sign, size): f"<{sign.lower()}{size}" for sign in "IU" for size in "1248"
}
MOST_LINES, MOST_FIELDS = 30, 64  # of the header


def cloud_poses(data: bytes) -> dict[str, Array]:
    """Points and normals (N, 3), in the unit of the file.

    Raises:
        SurfaceError: it is no such file, its points have no normals, or it is compressed.
    """
    head, start = _header(data)
    names = head.get("FIELDS", [])
    counts = head.get("COUNT") or ["1"] * len(names)
    sizes, types = head.get("SIZE", []), head.get("TYPE", [])
    count = int(number) if (number := head.get("POINTS", [""])[0]).isdecimal() else 0
    if not len(names) == len(sizes) == len(types) == len(counts) <= MOST_FIELDS:
        raise SurfaceError("FIELDS, SIZE, TYPE and COUNT of the header do not fit together")
    if any(names.count(name) != 1 or counts[names.index(name)] != "1" for name in WANTED):
        raise SurfaceError(f"must have the fields {', '.join(WANTED)}, each once: write normals")
    if not 0 < count <= MOST_POSES:
        raise SurfaceError(f"must hold 1 to {MOST_POSES:,} points")
    columns = np.repeat(names, [_small(word) for word in counts])
    kinds = np.repeat([_kind(*each) for each in zip(types, sizes, strict=True)],
                      [_small(word) for word in counts])  # fmt: skip
    at = [columns.tolist().index(name) for name in WANTED]
    if head.get("DATA") == ["ascii"]:
        rows = [line.split() for line in data[start:].decode("ascii", "replace").splitlines()]
        rows = [row for row in rows if row]
        if len(rows) != count or any(len(row) != len(columns) for row in rows):
            raise SurfaceError(f"must hold {count} lines of {len(columns)} numbers, as it says")
        table = np.array([[number_in(row[k]) for k in at] for row in rows])
    elif head.get("DATA") == ["binary"]:
        row = np.dtype([(str(number), kind) for number, kind in enumerate(kinds)])
        if len(data) - start < count * row.itemsize:
            raise SurfaceError("is cut short: its header says that there are more points")
        found = np.frombuffer(data, row, count, start)
        table = np.stack([found[str(k)].astype(float) for k in at], axis=1)
    else:
        raise SurfaceError("must be ascii or binary; pcl_convert_pcd_ascii_binary makes it so")
    if not np.isfinite(table).all():
        raise SurfaceError("holds points that are not finite; remove them")
    return {"points": table[:, :3], "normals": table[:, 3:]}


def _header(data: bytes) -> tuple[dict[str, list[str]], int]:
    """The words of the header by their first, and where it ends."""
    found, start = dict[str, list[str]](), 0
    for _ in range(MOST_LINES):
        end = data.find(b"\n", start, start + 4096)
        if end < 0:
            break
        words = data[start:end].decode("ascii", "replace").split()
        start = end + 1
        if words and not words[0].startswith("#"):
            found[words[0]] = words[1:]
        if words[:1] == ["DATA"]:
            return found, start
    raise SurfaceError("is no point cloud (.pcd): its header has no line DATA")


def _small(word: str) -> int:
    """How many numbers a field has."""
    if not (word.isdecimal() and len(word) < 4):
        raise SurfaceError(f"COUNT of the header has {shown(word[:20])}")
    return int(word)


def _kind(sign: str, size: str) -> str:
    """NumPy's name of a type."""
    if (sign, size) not in KINDS:
        raise SurfaceError(f"the header has the type {shown(f'{sign}{size}'[:20])}")
    return KINDS[sign, size]
