"""Cases of surfaces from files, and the files: small meshes and a control net."""

from __future__ import annotations

import json
import struct

import numpy as np
from bad_cases import write

# ur5 over a small plate; the file lies beside the case
MESH = """
robot = { name = "ur5" }
task = { standoff = 0.02, cone_deg = 30 }
[surface]
kind = "mesh"
file = "part.stl"
side = "outside"
cells = 12
position = [0.4, -0.1, 0.3]
"""
NET = """
robot = { name = "ur5" }
task = { standoff = 0.02, cone_deg = 30 }
[surface]
kind = "bspline"
file = "net.json"
side = "outside"
cells = [3, 4]
position = [0.4, -0.1, 0.3]
"""
POINTS = [[[0.1 * i, 0.1 * j, 0.01 * i * j] for j in range(3)] for i in range(3)]


def sheet(width=0.2, height=0.2, count=5):
    """Triangles (F, 3, 3) m of a flat rectangle that looks up, from the origin on."""
    x, y = np.linspace(0.0, width, count + 1), np.linspace(0.0, height, count + 1)
    corner = np.array([[[(a, b, 0.0) for b in y] for a in x]])[0]
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    halves = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)], axis=2)
    return halves.reshape(-1, 3, 3)


def cube(size=0.2):
    """Triangles of a cube from the origin on, that look outwards."""
    low = np.array([[[0, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [1, 0, 0]]])
    top = low[:, ::-1] + [0, 0, 1]
    turns = [np.roll(np.eye(3, dtype=int), k, axis=1) for k in range(3)]
    return size * np.concatenate([side @ turn for turn in turns for side in (low, top)])


def write_stl(path, triangles):
    """A binary STL of triangles (F, 3, 3)."""
    rows = np.zeros(len(triangles), [("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    rows["v"] = triangles
    path.write_bytes(b"from a test".ljust(80) + struct.pack("<I", len(rows)) + rows.tobytes())
    return path


def mesh_case(folder, triangles=None, more=""):
    """The path of a case beside its mesh."""
    write_stl(folder / "part.stl", sheet() if triangles is None else triangles)
    return write(folder, MESH + more, "mesh.toml")


def net_case(folder, points=POINTS, more=""):
    """The path of a case beside its control net."""
    (folder / "net.json").write_text(json.dumps({"points": points, "degree": [2, 2]}))
    return write(folder, NET + more, "net.toml")
