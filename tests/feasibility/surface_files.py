"""Cases of surfaces from files, and the files: small meshes and a control net."""

from __future__ import annotations

import json

import mesh_writers
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
    vertices, faces = mesh_writers.plate(count, count, width, height)
    return vertices[faces]


def cube(size=0.2):
    """Triangles of a cube from the origin on, that look outwards."""
    vertices, faces = mesh_writers.cube(size)
    return vertices[faces]


def write_stl(path, triangles):
    """A binary STL of triangles (F, 3, 3)."""
    path.write_bytes(mesh_writers.stl_of(triangles))
    return path


def mesh_case(folder, triangles=None, more=""):
    """The path of a case beside its mesh."""
    write_stl(folder / "part.stl", sheet() if triangles is None else triangles)
    return write(folder, MESH + more, "mesh.toml")


def net_case(folder, points=POINTS, more=""):
    """The path of a case beside its control net."""
    (folder / "net.json").write_text(json.dumps({"points": points, "degree": [2, 2]}))
    return write(folder, NET + more, "net.toml")
