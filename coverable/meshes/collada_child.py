"""The process that reads the .dae files of one robot; started by `collada`, never imported by it.

trimesh and pycollada trust what they read: they unzip without a cap, and make every instance of an
instance anew, so that 3 kB can fill the memory. So they run without environment, with caps on
memory and processor time, and from the moment they see a file on without a free file descriptor:
whatever textures and materials a file names, nothing can be opened.

The standard input holds the job as a line of JSON, and then the files. What leaves is for each file
a line of JSON, of a fault or of its parts, and after it their arrays, little-endian: (V, 3) float64
vertices and (F, 3) int64 faces of each.
"""

from __future__ import annotations

import io
import json
import logging
import os
import resource
import sys
from collections.abc import Iterator
from typing import Any

# trimesh does without them here, and to load them takes longer than all else.
NEEDLESS = ("networkx", "scipy")

# All that trimesh and pycollada import late is imported for this one.
SMALL = b"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset/>
<library_effects><effect id="e"><profile_COMMON><technique sid="t"><phong><diffuse>
<color>1 0 0 1</color></diffuse></phong></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh><source id="s"><float_array id="a" count="9">
0 0 0 1 0 0 0 1 0</float_array><technique_common><accessor source="#a" count="3" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source><vertices id="v"><input semantic="POSITION" source="#s"/>
</vertices><polylist count="1" material="m"><input semantic="VERTEX" source="#v" offset="0"/>
<vcount>3</vcount><p>0 1 2</p></polylist></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="o"><node id="n"><instance_geometry url="#g"><bind_material>
<technique_common><instance_material symbol="m" target="#m"/></technique_common></bind_material>
</instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#o"/></scene></COLLADA>"""


class Refused(Exception):
    """What is wrong with a file."""


def parts_of(data: bytes, most: int) -> Iterator[tuple[Any, Any, list[float] | None]]:
    """Vertices, faces and colour (red, green, blue, opacity in 0 .. 1) of each part of a file.

    Args:
        data: the file.
        most: triangles, all instances together.

    Raises:
        Refused: they are more.
        Exception: the file is damaged.
    """
    import trimesh

    triangles = 0
    # From memory: trimesh cannot know where other files would lie.
    for part in trimesh.load_scene(io.BytesIO(data), file_type="dae").dump():
        if isinstance(part, trimesh.Trimesh):
            triangles += len(part.faces)
            if triangles > most:
                raise Refused(f"has more than {most:,} triangles; thin the mesh")
            yield part.vertices, part.faces, colour_of(part.visual)


def colour_of(visual: Any) -> list[float] | None:
    """The colour that a part of trimesh brings along."""
    if visual.kind == "texture":
        rgba = visual.material.main_color
    elif visual.kind in ("vertex", "face"):
        rgba = visual.main_color
    else:
        return None
    return [float(value) / 255.0 for value in rgba]


def answer(data: bytes, most: int) -> bytes:
    """What is written about one file."""
    import numpy as np

    parts, arrays = [], []
    fault = ""
    try:
        for vertices, faces, rgba in parts_of(data, most):
            parts.append([len(vertices), len(faces), rgba])
            arrays += [np.asarray(vertices, "<f8").tobytes(), np.asarray(faces, "<i8").tobytes()]
    except Refused as error:
        fault = str(error)
    except (MemoryError, SystemError):  # the latter from within lxml or NumPy, out of memory too
        fault = "takes too much memory to read; thin the mesh"
    except Exception as error:  # noqa: BLE001 - of any library
        fault = f"cannot be read as a mesh: {error!r}"
    said = {"fault": fault} if fault else {"parts": parts}
    return b"".join([json.dumps(said).encode(), b"\n", *([] if fault else arrays)])


def main() -> None:
    """Do the job on the standard input."""
    given = sys.stdin.buffer
    job = json.loads(given.readline())
    sys.path[:0] = job["library"]
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # each more reserves memory
    logging.disable()  # trimesh prints tracebacks about textures
    without: Any = dict.fromkeys(NEEDLESS)
    sys.modules.update(without)  # as if they were not installed
    answer(SMALL, 1)
    written = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    resource.setrlimit(resource.RLIMIT_NOFILE, (0, 0))
    for size in job["sizes"]:
        written.write(answer(given.read(size), job["most"]))
        written.flush()
    os._exit(0)


if __name__ == "__main__":
    main()
