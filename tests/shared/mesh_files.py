"""One good mesh file of each format, and of each way to write it: what readers must not stumble on.

All of them hold the cube of `mesh_writers` (`nodes.glb` holds it three times), in metres.
"""

from __future__ import annotations

import mesh_writers as w
import numpy as np

V, F = w.cube()
QUADS = [(0, 1, 3, 2), *F[2:]]  # one side as a square


def nested_scene() -> bytes:
    """The cube by three nodes: as it is, turned and shifted inside another, and mirrored."""
    half = np.sqrt(0.5)
    nodes = [
        {"mesh": 0},
        {"translation": [1, 0, 0], "children": [2]},
        {"mesh": 0, "rotation": [0, 0, half, half], "scale": [2, 2, 2]},
        {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1]},
        {"mesh": 0, "translation": [9, 9, 9]},  # of no scene
    ]
    return w.glb(*w.scene(V, F, nodes=nodes, scenes=[{"nodes": [0, 1, 3]}]))


GOOD: dict[str, bytes] = {
    "binary.stl": w.stl(V, F),
    "text.stl": w.text_stl(V, F),
    "cube.obj": w.obj(V, QUADS, more="mtllib a\no b\n"),
    "text.ply": w.ply(V, F, ""),
    "little.ply": w.ply(V, QUADS, "<"),
    "big.ply": w.ply(V, F, ">"),
    "cube.off": w.off(V, F),
    "cube.glb": w.glb(*w.scene(V, F)),
    "nodes.glb": nested_scene(),
}
"""File name -> its bytes."""
