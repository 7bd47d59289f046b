"""Drawing commands of the meshcat page, written as plain data.

The page understands a handful of commands, each a MessagePack map: put an object at a path of the
scene tree, place it, set a property, play an animation. They are written here directly, so that a
scene can be packed into a file without any server, and without random identifiers: the same scene
gives the same bytes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from coverable.arrays import Array, Mask
from coverable.errors import ArgumentError

Command = dict[str, Any]
Colour = tuple[float, float, float]
"""Red, green, blue, each 0 to 1."""

_EXTENSION = {"uint16": 0x14, "uint32": 0x16, "float32": 0x17}
_GRID = 2.0**16  # [1/m]: positions are rounded to 15 um, which lets them compress
_DOUBLE_SIDED = 2
_PING_PONG = 2202  # three.js: there and back
_REPEAT = 2201


def safe_name(text: str) -> str:
    """A name for the scene tree: no path separator and no markup.

    The page writes these names into its HTML as they are, and URDF files are not to be trusted.
    """
    return re.sub(r"[^\w .,:()+-]", "_", text)[:80].strip() or "_"


def hex_colour(colour: Colour) -> int:
    """A colour as the integer 0xrrggbb."""
    red, green, blue = (round(255 * min(max(part, 0.0), 1.0)) for part in colour)
    return (red << 16) | (green << 8) | blue


def mesh_object(
    path: str,
    vertices: ArrayLike,
    faces: ArrayLike,
    colour: Colour,
    *,
    opacity: float = 1.0,
    lit: bool = True,
    on_top: bool = False,
) -> Command:
    """Triangles of one colour, visible from both sides; normals are means over the faces around.

    Args:
        path: where in the scene tree.
        vertices: (V, 3) m.
        faces: (F, 3) indices of vertices.
        colour: of all triangles.
        opacity: 1 hides what is behind.
        lit: shaded by the lights; False shows the plain colour.
        on_top: seen through whatever is before it.
    """
    index = np.asarray(faces)
    small = len(np.asarray(vertices)) < 2**16
    data: dict[str, Any] = {
        "attributes": {"position": _positions(vertices)},
        "index": _array(index.reshape(-1), 1, "uint16" if small else "uint32"),
    }
    material = {
        "type": "MeshPhongMaterial" if lit else "MeshBasicMaterial",
        "color": hex_colour(colour),
        "side": _DOUBLE_SIDED,
        "opacity": opacity,
        "transparent": opacity < 1.0,
        "depthWrite": opacity >= 1.0,
    }
    if lit:
        material |= {"shininess": 25, "specular": 0x222222}
    if on_top:  # what is transparent is drawn last
        material |= {"transparent": True, "depthTest": False}
    return _object(path, "Mesh", data, material)


def segments(path: str, points: ArrayLike, colour: Colour, *, colours: Any = None) -> Command:
    """Line segments, one pixel wide on most machines.

    Args:
        path: where in the scene tree.
        points: (2 k, 3) m: the ends of k segments.
        colour: of all segments, unless `colours` says otherwise.
        colours: (2 k, 3) one colour for each point, 0 to 1.
    """
    data: dict[str, Any] = {"attributes": {"position": _positions(points)}}
    material = {
        "type": "LineBasicMaterial",
        "color": 0xFFFFFF if colours is not None else hex_colour(colour),
        "vertexColors": 2 if colours is not None else 0,
        "opacity": 1.0,
        "transparent": False,
    }
    if colours is not None:
        data["attributes"]["color"] = _array(np.asarray(colours), 3, "float32")
    return _object(path, "LineSegments", data, material)


def transform(path: str, matrix: Array) -> Command:
    """Place what is at `path` by a homogeneous (4, 4) matrix."""
    return {"type": "set_transform", "path": path, "matrix": matrix.T.reshape(-1).tolist()}


def set_property(path: str, name: str, value: Any) -> Command:
    """Set one property, such as `visible`, of what is at `path`."""
    return {"type": "set_property", "path": path, "property": name, "value": value}


def key_frames(path: str, name: str, times: Array, values: Array) -> dict[str, Any]:
    """How one property of one path changes with time.

    Args:
        path: of the group that moves.
        name: 'position' or 'scale' with values (k, 3), or 'quaternion' with values (k, 4) as x, y,
            z, w.
        times: (k,) s.
        values: one row per time.
    """
    kind = "quaternion" if name == "quaternion" else "vector3"
    return _clip(path, name, kind, times, _packed(values, "float32"))


def appearing(path: str, when: float, end: float) -> dict[str, Any]:
    """What is at `path` hidden until `when` (s), and shown from then to `end`."""
    return shown(path, np.array([0.0, when, max(end, when)]), np.array([False, True, True]))


def shown(path: str, times: Array, visible: Mask) -> dict[str, Any]:
    """What is at `path` shown or hidden, `visible` (k,), from each of the times (k,) s on."""
    return _clip(path, "visible", "bool", times, visible.tolist())


def _clip(path: str, name: str, kind: str, times: Array, values: Any) -> dict[str, Any]:
    """One track of key frames."""
    packed = _packed(times, "float32")
    keys = {"name": f".{name}", "type": kind, "times": packed, "values": values}
    return {"path": path, "clip": {"fps": 1, "name": "default", "tracks": [keys]}}


def animation(tracks: Sequence[dict[str, Any]], *, play: bool, there_and_back: bool) -> Command:
    """Play tracks together, for ever."""
    options = {
        "play": play,
        "repetitions": float("inf"),
        "loopMode": _PING_PONG if there_and_back else _REPEAT,
    }
    return {"type": "set_animation", "animations": list(tracks), "options": options, "path": ""}


def stream_of(commands: Iterable[Command]) -> bytes:
    """Commands as the bytes that the page reads, each behind its length in four bytes."""
    import umsgpack

    packed = map(umsgpack.packb, commands)
    return b"".join(len(one).to_bytes(4, "little") + one for one in packed)


def numbers_of(attribute: dict[str, Any]) -> Array:
    """The numbers of an attribute, flat, as floats: what `mesh` and `segments` have packed."""
    kind = attribute["type"].removesuffix("Array").lower()
    data = np.frombuffer(attribute["array"].data, np.dtype(kind).newbyteorder("<"))
    return data.astype(float)


def _object(path: str, kind: str, data: dict[str, Any], material: dict[str, Any]) -> Command:
    """The command that puts one object at `path`."""
    geometry = {"uuid": f"{path}#geometry", "type": "BufferGeometry", "data": data}
    surface = {"uuid": f"{path}#material", **material}
    placed = {
        "uuid": f"{path}#object",
        "type": kind,
        "geometry": geometry["uuid"],
        "material": surface["uuid"],
        "matrix": [1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0, 0, 0, 0, 0, 1.0],
    }
    scene = {
        "metadata": {"version": 4.5, "type": "Object"},
        "geometries": [geometry],
        "materials": [surface],
        "object": placed,
    }
    return {"type": "set_object", "path": path, "object": scene}


def _positions(points: ArrayLike) -> dict[str, Any]:
    """Points (k, 3) as a vertex attribute."""
    values = np.asarray(points, dtype=float)
    if not np.isfinite(values).all():
        raise ArgumentError("points to draw must be finite; got NaN or infinity")
    return _array(np.round(values * _GRID) / _GRID, 3, "float32")


def _array(values: NDArray[Any], size: int, dtype: str) -> dict[str, Any]:
    """An array as a vertex attribute with `size` numbers a vertex."""
    return {
        "itemSize": size,
        "type": f"{dtype.capitalize()}Array",
        "array": _packed(values, dtype),
        "normalized": False,
    }


def _packed(values: NDArray[Any], dtype: str) -> Any:
    """Numbers as the typed array that the page's MessagePack reader makes of them."""
    import umsgpack

    little = np.ascontiguousarray(values, dtype=np.dtype(dtype).newbyteorder("<"))
    return umsgpack.Ext(_EXTENSION[dtype], little.tobytes())
