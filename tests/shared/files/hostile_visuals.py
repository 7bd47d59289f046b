"""Robots whose pictures are traps: mesh files, and what these name beside them.

What any mesh file may have wrong stands in tests/surfaces/test_mesh_files.py; here are .dae files,
which only robots have, and what grows, goes in circles or leads to other files.
"""

import io
import os
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import mesh_writers as w
import numpy as np

TRIANGLE = "0 0 0 1 0 0 0 1 0"
CORNERS = np.array(TRIANGLE.split(), float).reshape(3, 3)
DRAWN = ""
"""No note: the shape can be drawn, and what lies beside it must only not be touched."""
BESIDE = "beside.png"
"""A pipe beside each mesh: whoever opens it waits for ever."""


def urdf(visuals: str) -> str:
    """An arm of two links with these visuals on its first."""
    return (
        f'<robot name="arm"><link name="base">{visuals}</link><link name="tip"/>'
        '<joint name="turn" type="revolute"><parent link="base"/><child link="tip"/>'
        '<origin xyz="0 0 1"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )


def visual(name: str, more: str = "") -> str:
    return f'<visual>{more}<geometry><mesh filename="{name}"/></geometry></visual>'


def write(folder: Path, name: str, content: str | bytes) -> str:
    (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
    return name


def stl(triangles: int) -> bytes:
    beside = np.arange(triangles)[:, None, None] * [1.0, 0, 0]
    return w.stl_of(beside + CORNERS)


def collada(shapes: str = "", nodes: str = "", scene: str = "", more: str = "") -> str:
    """A .dae with one triangle called "one"."""
    return (
        '<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" '
        'version="1.4.1"><asset><unit meter="1"/></asset>'
        f"{more}<library_geometries>{geometry('one')}{shapes}</library_geometries>"
        f"<library_nodes>{nodes}</library_nodes><library_visual_scenes><visual_scene id='s'>"
        f"<node id='top'>{scene}</node></visual_scene></library_visual_scenes>"
        "<scene><instance_visual_scene url='#s'/></scene></COLLADA>"
    )


def geometry(name: str, primitive: str = "", triangles: int = 1) -> str:
    """A geometry of one triangle, listed many times, or with a primitive of one's own."""
    vertex = f"<input semantic='VERTEX' source='#{name}-v' offset='0'/>"
    own = primitive.replace("@", vertex) or (
        f"<triangles count='{triangles}'>{vertex}<p>{'0 1 2 ' * triangles}</p></triangles>"
    )
    return (
        f"<geometry id='{name}'><mesh><source id='{name}-p'><float_array id='{name}-a' count='9'>"
        f"{TRIANGLE}</float_array><technique_common><accessor source='#{name}-a' count='3' "
        "stride='3'><param name='X' type='float'/><param name='Y' type='float'/>"
        "<param name='Z' type='float'/></accessor></technique_common></source>"
        f"<vertices id='{name}-v'><input semantic='POSITION' source='#{name}-p'/></vertices>"
        f"{own}</mesh></geometry>"
    )


def shown(name: str = "one", times: int = 1) -> str:
    return f"<instance_geometry url='#{name}'/>" * times


def referred(name: str, times: int = 1) -> str:
    """A node, shown so many times."""
    return f"<instance_node url='#{name}'/>" * times


def tree(levels: int, times: int) -> str:
    """Instances of instances: a few nodes that become billions."""
    nodes = [f"<node id='n0'>{shown()}</node>"]
    nodes += [f"<node id='n{k}'>{referred(f'n{k - 1}', times)}</node>" for k in range(1, levels)]
    return collada(nodes="".join(nodes), scene=referred(f"n{levels - 1}"))


def circle(count: int) -> str:
    each = (f"<node id='n{k}'>{referred(f'n{(k + 1) % count}')}</node>" for k in range(count))
    return collada(nodes="".join(each), scene=referred("n0"))


def chain(count: int) -> str:
    """A long chain of nodes, the last of them first in the file."""
    nodes = [f"<node id='n{k}'>{referred(f'n{k + 1}')}</node>" for k in range(count)]
    nodes += [f"<node id='n{count}'>{shown()}</node>"]
    return collada(nodes="".join(nodes), scene=referred("n0"))


def zipped() -> bytes:
    """An archive that inflates."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("0.dae", GOOD.encode() + b" " * (16 << 20))
    return packed.getvalue()


def entities(entity: str) -> str:
    """A .dae with a DOCTYPE."""
    text = collada(scene=shown(), more="<extra>&e11;</extra>")
    return text.replace("<COLLADA", f"<!DOCTYPE COLLADA [{entity}]><COLLADA", 1)


def polygons(sizes: str) -> str:
    """Polygons of more corners than there are indices."""
    primitive = f"<polylist count='1'>@<vcount>{sizes}</vcount><p>0 1 2</p></polylist>"
    return collada(geometry("two", primitive), scene=shown("two"))


def painted_dae(image: str) -> str:
    """A picture beside the file, for colour, glow and bumps."""
    texture = "<texture texture='t' texcoord='UV'/>"
    slots = "".join(
        f"<{slot}>{texture}</{slot}>" for slot in ("emission", "ambient", "diffuse", "transparent")
    )
    more = (
        f"<library_images><image id='i'><init_from>{image}</init_from></image></library_images>"
        "<library_effects><effect id='e'><profile_COMMON><newparam sid='f'><surface type='2D'>"
        "<init_from>i</init_from></surface></newparam><newparam sid='t'><sampler2D><source>f"
        f"</source></sampler2D></newparam><technique sid='c'><phong>{slots}</phong>"
        f"<extra><technique profile='FCOLLADA'><bump>{texture}</bump></technique></extra>"
        "</technique></profile_COMMON></effect></library_effects><library_materials>"
        "<material id='m'><instance_effect url='#e'/></material></library_materials>"
    )
    bind = (
        "<instance_geometry url='#one'><bind_material><technique_common><instance_material "
        "symbol='m' target='#m'/></technique_common></bind_material></instance_geometry>"
    )
    return collada(scene=bind, more=more).replace("<triangles ", "<triangles material='m' ")


def glb(triangles: int = 1, **changes: object) -> bytes:
    """A .glb that shows one mesh of so many triangles once."""
    return w.glb(*w.scene(CORNERS, np.tile([[0, 1, 2]], (triangles, 1)), **changes))


def painted_glb(inside: bool) -> bytes:
    """A picture beside the file, or one inside that inflates to a billion pixels."""
    side = 60_000
    rows = zlib.compress(bytes(side * (side // 8 + 1) // 50))
    head = struct.pack(">IIBBBBB", side, side, 1, 0, 0, 0, 0)
    png = b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        for kind, body in ((b"IHDR", head), (b"IDAT", rows), (b"IEND", b""))
    )
    scene, data = w.scene(CORNERS, [[0, 1, 2]], textures=[{"source": 0}])
    index = {"index": 0}
    look = {"pbrMetallicRoughness": {"baseColorTexture": index}, "normalTexture": index}
    scene |= {"images": [{"bufferView": 2} if inside else {"uri": BESIDE}], "materials": [look]}
    scene["bufferViews"] += [{"buffer": 0, "byteOffset": len(data), "byteLength": len(png)}]
    scene["buffers"][0]["byteLength"] += len(png)
    scene["meshes"][0]["primitives"][0]["material"] = 0
    return w.glb(scene, data + png)


GOOD = collada(scene=shown())
BOMB = "".join(f"<!ENTITY e{k} '{f'&e{k - 1};' * 10}'>" for k in range(1, 12))
PLY = (
    "ply\nformat ascii 1.0\n{}element vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
)
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
RED = "vt 0 0\nusemtl red\nf 1/1 2/1 3/1\n"
NOTHING_ELSE = r"mesh\.\w+: \w"
ENDLESS, MANY = "takes too (long|much)|cannot be read", "has more than 1,500,000 triangles"
LEVELS = [{"children": [k + 1, k + 1]} for k in range(60)] + [{"mesh": 0}]

# Name -> how the file ends, what it holds, and the words of the note (a pattern).
TRAPS: dict[str, tuple[str, str | bytes, str]] = {
    "tree": ("dae", tree(20, 3), ENDLESS),
    "wide": ("dae", collada(geometry("two", "", 5_000), scene=shown("two", 301)), MANY),
    "circle": ("dae", circle(7), "cannot be read"),
    "chain": ("dae", chain(190), DRAWN),
    "archive": ("dae", zipped(), "is a zip archive; unpack it first"),
    "entities": ("dae", entities(f"<!ENTITY e0 'x'>{BOMB}"), "cannot be read"),
    "entity beside it": ("dae", entities(f"<!ENTITY e11 SYSTEM '{BESIDE}'>"), "cannot be read"),
    "polygons": ("dae", polygons("1000000000"), ENDLESS),
    "painted": ("dae", painted_dae(BESIDE), DRAWN),
    "cut short": ("dae", GOOD[: len(GOOD) // 2], NOTHING_ELSE),
    "no numbers": ("dae", GOOD.replace(TRIANGLE, "nan inf 1e99 1 0 0 0 1 0"), NOTHING_ELSE),
    "no such corner": ("dae", GOOD.replace("0 1 2", "0 1 2000000000"), NOTHING_ELSE),
    "two corners": ("dae", GOOD.replace("0 1 2", "0 1"), NOTHING_ELSE),
    "zeros": ("dae", b"\0" * 5000, NOTHING_ELSE),
    "primitives": (
        "glb",
        glb(300, meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}] * 9_000}]),
        r"more than|lists \d+",
    ),
    "shared nodes": ("glb", glb(nodes=LEVELS), "must form a tree"),
    "deep JSON": ("glb", w.glb(b'{"a":' * 50_000, b""), NOTHING_ELSE),
    "picture beside it": ("glb", painted_glb(inside=False), DRAWN),
    "picture inside": ("glb", painted_glb(inside=True), DRAWN),
    "numbers elsewhere": (
        "glb", glb(buffers=[{"uri": BESIDE, "byteLength": 48}]), "lies outside the file"
    ),
    "materials": ("obj", f"mtllib {BESIDE}\n{OBJ}{RED}", DRAWN),
    "endless face": ("obj", f"{OBJ}f {'1 ' * 900_000}\n", NOTHING_ELSE),
    "texture": ("ply", PLY.format(f"comment TextureFile {BESIDE}\n"), DRAWN),
    "properties": (
        "ply", PLY.format("element x 1000000\n" + "property char a\n" * 5_000), NOTHING_ELSE
    ),
    "large": ("stl", b"", "is larger than|bytes, over"),
    "large text": ("obj", b"", "is larger than|bytes, over"),
}  # fmt: skip
# As much as may be drawn, in one shape or in many.
LARGE: dict[str, tuple[str, Callable[[], str | bytes]]] = {
    "one shape": ("dae", lambda: collada(geometry("two", "", 950_000), scene=shown("two"))),
    "19 shapes": ("dae", lambda: collada(geometry("two", "", 50_000), scene=shown("two", 19))),
    "text": ("obj", lambda: "v 1 0 0\nv 2 0 0\nv 1 1 0\nf -1 -2 -3\n" * 290_000),
    "numbers": ("stl", lambda: stl(1_300_000)),
}


def make(name: str, folder: Path) -> tuple[Path, str]:
    ending, content, words = TRAPS[name] if name in TRAPS else (*LARGE[name], DRAWN)
    folder.mkdir(parents=True)
    os.mkfifo(folder / BESIDE)
    mesh = folder / f"mesh.{ending}"
    write(folder, mesh.name, content() if callable(content) else content)
    if content == b"":
        os.truncate(mesh, 1 << 40)  # large by its size only
    return folder / write(folder, "arm.urdf", urdf(visual(mesh.name))), words
