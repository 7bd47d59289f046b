"""Robots whose pictures are traps, made from a seed: mesh files, and what these name beside them.

Each maker writes files into a folder and gives the mesh's name, and a pattern of what must be said
of it, or nothing where the shape can be drawn and the trap must only not be touched.
"""

from __future__ import annotations

import io
import json
import os
import random
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

Maker = Callable[[random.Random, Path], tuple[str, str]]
"""Writes files, and gives the mesh's name and the words of the note (a pattern)."""

TRIANGLE = "0 0 0 1 0 0 0 1 0"
DRAWN = ""
"""No note: the shape can be drawn, and what lies beside it must only not be touched."""


def urdf(visuals: str) -> str:
    """An arm of two links with these visuals on its first."""
    return (
        f'<robot name="arm"><link name="base">{visuals}</link><link name="tip"/>'
        '<joint name="turn" type="revolute"><parent link="base"/><child link="tip"/>'
        '<origin xyz="0 0 1"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )


def visual(name: str, more: str = "") -> str:
    """One visual that names a mesh."""
    return f'<visual>{more}<geometry><mesh filename="{name}"/></geometry></visual>'


def trap(rng: random.Random, folder: Path, name: str) -> str:
    """A file beside the mesh that must not be opened; gives the name to write for it."""
    kind = rng.choice(("pipe", "sparse", "folder", "missing", "outside", "url"))
    if kind == "pipe":
        os.mkfifo(folder / name)
    elif kind == "sparse":
        (folder / name).touch()
        os.truncate(folder / name, 1 << 40)
    elif kind == "folder":
        (folder / name).mkdir()
    elif kind == "outside":
        return f"../../../../../../dev/{rng.choice(('zero', 'stdin', 'tty'))}"
    elif kind == "url":
        return f"http://127.0.0.1:9/{name}"
    return name


def write(folder: Path, name: str, content: str | bytes) -> str:
    """A new file; gives its name."""
    (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
    return name


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
    """A geometry, shown so many times."""
    return f"<instance_geometry url='#{name}'/>" * times


def referred(name: str, times: int = 1) -> str:
    """A node, shown so many times."""
    return f"<instance_node url='#{name}'/>" * times


def dae_tree(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Instances of instances: a few nodes that become billions."""
    levels, times = rng.choice(((20, 3), (9, 9), (40, 2), (60, 2), (5, 30)))
    nodes = [f"<node id='n0'>{shown()}</node>"]
    nodes += [f"<node id='n{k}'>{referred(f'n{k - 1}', times)}</node>" for k in range(1, levels)]
    if rng.random() < 0.5:
        rng.shuffle(nodes)
    text = collada(nodes="".join(nodes), scene=referred(f"n{levels - 1}"))
    return write(folder, "tree.dae", text), "with each instance counted"


def dae_wide(rng: random.Random, folder: Path) -> tuple[str, str]:
    """One shape, shown many times, or a large one a few hundred times."""
    triangles, times = rng.choice(((1, 20_000), (1, 90_000), (5_000, 300), (50_000, 60)))
    text = collada(geometry("two", triangles=triangles), scene=shown("two", times))
    return write(folder, "wide.dae", text), "with each instance counted"


def dae_circle(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Nodes that show themselves."""
    count = rng.choice((1, 2, 7, 50))
    nodes = "".join(
        f"<node id='n{k}'>{referred(f'n{(k + 1) % count}', rng.choice((1, 3)))}{shown()}</node>"
        for k in range(count)
    )
    return write(
        folder, "circle.dae", collada(nodes=nodes, scene=referred("n0"))
    ), "contains itself"


def dae_chain(rng: random.Random, folder: Path) -> tuple[str, str]:
    """A long chain of nodes, the last of them first in the file."""
    count = rng.choice((70, 190, 3_000))
    names = [f"<node id='n{k}'>{referred(f'n{k + 1}')}</node>" for k in range(count)]
    nodes = "".join((*names, f"<node id='n{count}'>{shown()}</node>"))
    text = collada(nodes=nodes, scene=referred("n0"))
    return write(folder, "chain.dae", text), "deep inside each other|refers to nodes more than"


def dae_zip(rng: random.Random, folder: Path) -> tuple[str, str]:
    """An archive that inflates, or XML with an archive in its last comment."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for k in range(rng.choice((1, 3))):
            blank = b" " * rng.choice((1 << 20, 64 << 20))
            archive.writestr(f"{k}.dae", collada(scene=shown()).encode() + blank)
    data = packed.getvalue()
    if rng.random() < 0.5:
        # The archive's own comment, of three bytes, ends the comment of the XML.
        data = collada(scene=shown()).encode() + b"<!--" + data[:-2] + struct.pack("<H", 3) + b"-->"
    return write(folder, "packed.dae", data), "is a zip archive; unpack it first"


def dae_entities(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Entities that grow, or that name a file."""
    bomb = "".join(f"<!ENTITY e{k} '{f'&e{k - 1};' * 10}'>" for k in range(1, 12))
    entity = rng.choice(
        (
            f"<!ENTITY e0 'x'>{bomb}",
            f"<!ENTITY e11 SYSTEM '{trap(rng, folder, 'entity.txt')}'>",
            "<!ENTITY % p SYSTEM 'file:///dev/zero'>%p;",
        )
    )
    text = collada(scene=shown(), more="<extra>&e11;</extra>")
    text = text.replace("<COLLADA", f"<!DOCTYPE COLLADA [{entity}]><COLLADA", 1)
    return write(folder, "entities.dae", text), "DOCTYPE"


def dae_polygons(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Polygons of more corners than there are indices, or of a number that is none."""
    size = rng.choice(("1000000000", "2147483647", "-3", "9" * 5000, "3 3 3 99999999", "1e9"))
    primitive = f"<polylist count='1'>@<vcount>{size}</vcount><p>0 1 2</p></polylist>"
    text = collada(geometry("two", primitive), scene=shown("two"))
    return write(folder, "polygons.dae", text), "more corners than are listed"


def dae_false_width(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Inputs that are not read make a corner look wider, and all of them fewer, than they are."""
    fake = rng.choice(
        (
            "<input semantic='NORMAL' source='#two-v' offset='99999'/>",
            "<extra><input semantic='VERTEX' source='#two-v' offset='99999'/></extra>",
            "<extra><triangles><input semantic='VERTEX' offset='99999'/></triangles></extra>",
        )
    )
    primitive = f"<triangles count='1'>@{fake}<p>{'0 1 2 ' * 20_000}</p></triangles>"
    text = collada(geometry("two", primitive), scene=shown("two", 400))
    return write(folder, "width.dae", text), "with each instance counted"


def dae_deep(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Elements inside each other, or too many beside each other."""
    depth = rng.choice((100, 20_000))
    deep = "<node>" * depth + shown() + "</node>" * depth
    scene = rng.choice((deep, "<node/>" * 400_000, "<extra>" * depth + "</extra>" * depth))
    return write(folder, "deep.dae", collada(scene=scene)), "XML elements|deep inside each other"


def dae_textures(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Pictures beside the file, for colour, glow and bumps."""
    image = trap(rng, folder, "image.png")
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
    text = collada(scene=bind, more=more).replace("<triangles ", "<triangles material='m' ")
    return write(folder, "painted.dae", text), DRAWN


def dae_broken(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Cut short, in another encoding, or of numbers that are none."""
    text = collada(scene=shown()).encode()
    broken = rng.choice(
        (
            text[: rng.randrange(len(text))],
            text.replace(b'version="1.0"', b'version="1.0" encoding="utf-7"'),
            text.replace(b"0 0 0 1 0 0 0 1 0", b"nan inf 1e99 1 0 0 0 1 0"),
            text.replace(b"<scene>", b"<scene/><scene>").replace(b"#s", b"#t"),
            text.replace(b"0 1 2", b"0 1 2000000000"),
            text.replace(b"0 1 2", b"0 1"),
            b"\0" * 5000,
            b"",
        )
    )
    return write(folder, "broken.dae", broken), r"broken\.dae: \w"


def glb(scene: object, numbers: bytes = b"", json_text: str = "") -> bytes:
    """A .glb of a scene, or of a text in its place."""
    text = (json_text or json.dumps(scene)).encode()
    text += b" " * (-len(text) % 4)
    numbers += b"\0" * (-len(numbers) % 4)
    size = 28 + len(text) + len(numbers)
    head = struct.pack("<4sIIII", b"glTF", 2, size, len(text), 0x4E4F534A)
    return head + text + struct.pack("<II", len(numbers), 0x004E4942) + numbers


def scene_of(triangles: int = 1, **changes: object) -> tuple[dict[str, object], bytes]:
    """A scene that shows one mesh of so many triangles once, and its numbers."""
    data = struct.pack("<9f", *map(float, TRIANGLE.split())) * triangles
    scene: dict[str, object] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3 * triangles, "type": "VEC3"}
        ],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "buffers": [{"byteLength": len(data)}],
    }
    return {**scene, **changes}, data


def glb_instances(rng: random.Random, folder: Path) -> tuple[str, str]:
    """One mesh in many nodes, or in many primitives."""
    triangles, times = rng.choice(((1, 50_000), (1, 150_000), (20_000, 300), (300, 9_000)))
    if rng.random() < 0.5:
        mesh = {"primitives": [{"attributes": {"POSITION": 0}}] * times}
        scene, data = scene_of(triangles, meshes=[mesh])
    else:
        nodes = [{"mesh": 0}] * times
        scene, data = scene_of(triangles, nodes=nodes, scenes=[{"nodes": [*range(times)]}])
    return write(folder, "many.glb", glb(scene, data)), r"more than|lists \d+"


def glb_nodes(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Nodes in a circle, or that share their children level by level."""
    levels = rng.choice((20, 60, 500))
    shared = [{"children": [k + 1, k + 1]} for k in range(levels)] + [{"mesh": 0}]
    circle = [{"children": [(k + 1) % levels], "mesh": 0} for k in range(levels)]
    scene, data = scene_of(nodes=rng.choice((shared, circle)))
    return write(folder, "nodes.glb", glb(scene, data)), "must form a tree"


def glb_numbers(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Lengths, counts and offsets that are not there."""
    scene, data = scene_of()
    table, key = rng.choice(
        (("accessors", "count"), ("bufferViews", "byteLength"), ("bufferViews", "byteOffset"),
         ("accessors", "byteOffset"), ("accessors", "bufferView"), ("bufferViews", "buffer"))
    )  # fmt: skip
    value = rng.choice((1 << 40, (1 << 40) - 1, 1 << 31, 1 << 63, -1, 10**400, 1e300, None, "9"))
    scene[table][0][key] = value  # type: ignore[index]
    if key == "byteLength":  # a longer view alone harms nobody: make somebody want it
        scene["accessors"][0]["count"] = 10**9  # type: ignore[index]
    return write(folder, "numbers.glb", glb(scene, data)), r"numbers\.glb: \w"


def glb_head(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Lengths in the head that are not there."""
    data = bytearray(glb(*scene_of()))
    place = rng.choice((8, 12, len(data) - 36 - 8))
    data[place : place + 4] = struct.pack("<I", rng.choice((0, 1 << 31, (1 << 32) - 1)))
    return write(folder, "head.glb", bytes(data)), r"head\.glb: \w"


def glb_text(rng: random.Random, folder: Path) -> tuple[str, str]:
    """JSON that is deep, long, or no scene."""
    texts = ["[" * 200_000, '{"a":' * 50_000, "[" + "0," * 4_000_000 + "0]", '{"scene": 1e999}']
    texts += ['{"nodes": ' + "9" * 5000 + "}", "null", '{"nodes": NaN}', '"\\ud800"', "[]"]
    return write(folder, "text.glb", glb(None, json_text=rng.choice(texts))), r"text\.glb: \w"


def glb_textures(rng: random.Random, folder: Path) -> tuple[str, str]:
    """A picture beside the file, or one inside that inflates to a billion pixels."""
    side = rng.choice((20_000, 60_000))
    rows = zlib.compress(bytes(side * (side // 8 + 1) // 50))
    chunks = ((b"IHDR", struct.pack(">IIBBBBB", side, side, 1, 0, 0, 0, 0)), (b"IDAT", rows))
    png = b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        for kind, body in (*chunks, (b"IEND", b""))
    )
    scene, data = scene_of(textures=[{"source": 0}])
    inside = rng.random() < 0.5
    scene["images"] = [{"bufferView": 1} if inside else {"uri": trap(rng, folder, "image.png")}]
    scene["bufferViews"] += [  # type: ignore[operator]
        {"buffer": 0, "byteOffset": len(data), "byteLength": len(png)}
    ]
    index = {"index": 0}
    scene["materials"] = [
        {"pbrMetallicRoughness": {"baseColorTexture": index}, "normalTexture": index}
    ]
    scene["meshes"][0]["primitives"][0]["material"] = 0  # type: ignore[index]
    return write(folder, "painted.glb", glb(scene, data + png)), DRAWN


def glb_outside(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Numbers in a file beside it."""
    scene, data = scene_of(buffers=[{"uri": trap(rng, folder, "numbers.bin"), "byteLength": 36}])
    return write(folder, "outside.glb", glb(scene, data)), "lies outside the file"


def obj_material(rng: random.Random, folder: Path) -> tuple[str, str]:
    """A file of materials beside it."""
    name = trap(rng, folder, "paint.mtl")
    text = f"mtllib {name}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl red\nf 1/1 2/1 3/1\n"
    return write(folder, "painted.obj", text), DRAWN


def obj_faces(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Faces of corners that are not there, too many corners, or lines without end."""
    faces = ["f 1 2 99999999999", "f 0 1 2", "f -9 1 2", "f " + "1 " * 70, "f " + "1 " * 900_000]
    faces += ["f 1 2", "f a b c", "v nan 0 0\nf 1 2 4", "v 1e999 0 0\nf 1 2 4", "x" * 3_000_000]
    text = f"v 0 0 0\nv 1 0 0\nv 0 1 0\n{rng.choice(faces)}\n"
    return write(folder, "faces.obj", text), r"faces\.obj: \w"


def ply_texture(rng: random.Random, folder: Path) -> tuple[str, str]:
    """A picture beside it."""
    name = trap(rng, folder, "paint.png")
    return write(folder, "painted.ply", ply(f"comment TextureFile {name}\n")), DRAWN


def ply(comment: str = "", vertices: str = "3", faces: str = "1", size: str = "3") -> str:
    """A text PLY of one triangle."""
    return (
        f"ply\nformat ascii 1.0\n{comment}element vertex {vertices}\nproperty float x\n"
        f"property float y\nproperty float z\nelement face {faces}\n"
        f"property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n{size} 0 1 2\n"
    )


def ply_counts(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Counts that are not there, or properties without end."""
    large = rng.choice(("4000000000", "9" * 30, "-1", "1e9", "4"))
    many = "element x 1000000\n" + "property char a\n" * 5_000
    choices: tuple[dict[str, str], ...] = (
        {"vertices": large}, {"faces": large}, {"size": large}, {"comment": many},
    )  # fmt: skip
    return write(folder, "counts.ply", ply(**rng.choice(choices))), r"counts\.ply: \w"


def stl_size(rng: random.Random, folder: Path) -> tuple[str, str]:
    """A count that is not there, or a file that is large by its size only."""
    name = rng.choice(("size.stl", "size.obj", "size.ply", "size.off", "size.dae", "size.glb"))
    if name == "size.stl" and rng.random() < 0.5:
        head = b"\0" * 80 + struct.pack("<I", rng.choice((1, 1 << 31, (1 << 32) - 1)))
        return write(folder, name, head), r"size\.stl: \w"
    write(folder, name, "")
    os.truncate(folder / name, rng.choice((100 << 20, 1 << 30, 1 << 40)))
    return name, "is larger than|bytes, over"


def just_drawn(rng: random.Random, folder: Path) -> tuple[str, str]:
    """As much as may be drawn, in one shape or in many."""
    kind = rng.choice(("shape", "shapes", "far apart", "polygons", "text", "glb", "stl"))
    if kind == "stl":
        return write(folder, "large.stl", stl(1_300_000)), DRAWN
    if kind == "glb":
        scene, data = scene_of(900_000)
        return write(folder, "large.glb", glb(scene, data)), DRAWN
    if kind == "text":
        rows = "".join(f"v {k} 0 0\nv {k} 1 0\nf -1 -2 -3\n" for k in range(1, 300_000))
        return write(folder, "large.obj", f"v 0 0 0\n{rows}"), DRAWN
    if kind == "polygons":
        triangles = 300_000
        primitive = (
            f"<polylist count='1'>@<vcount>{'3 ' * triangles}</vcount>"
            f"<p>{'0 1 2 ' * triangles}</p></polylist>"
        )
        shape, times = geometry("two", primitive), 1
    else:
        times = 1 if kind == "shape" else 19
        shape = geometry("two", triangles=950_000 // times)
    nodes = "".join(
        f"<node><translate>{k if kind == 'far apart' else 0} 0 0</translate>{shown('two')}</node>"
        for k in range(times)
    )
    return write(folder, "large.dae", collada(shape, scene=nodes)), DRAWN


def off_counts(rng: random.Random, folder: Path) -> tuple[str, str]:
    """Counts that are not there."""
    large = rng.choice(("4000000000 1 0", "3 4000000000 0", "-3 1 0", "3 1e9 0", "9" * 40 + " 1 0"))
    return write(folder, "counts.off", f"OFF\n{large}\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"), (
        r"counts\.off: \w"
    )


def special_file(rng: random.Random, folder: Path) -> tuple[str, str]:
    """The mesh itself is a pipe, a folder, a link out of the folder, or a link in a circle."""
    name = "mesh" + rng.choice((".stl", ".obj", ".ply", ".off", ".dae", ".glb"))
    kind = rng.choice(("pipe", "folder", "out", "circle"))
    if kind == "pipe":
        os.mkfifo(folder / name)
    elif kind == "folder":
        (folder / name).mkdir()
    else:
        (folder / name).symlink_to("/dev/zero" if kind == "out" else name)
    return name, "not drawn: "


def stl(triangles: int) -> bytes:
    """A binary STL of that many triangles, each beside the last."""
    facets = (
        struct.pack("<12fH", 0, 0, 1, k, 0, 0, k + 1, 0, 0, k, 1, 0, 0) for k in range(triangles)
    )
    return b"\0" * 80 + struct.pack("<I", triangles) + b"".join(facets)


MAKERS: tuple[Maker, ...] = (
    dae_tree, dae_wide, dae_circle, dae_chain, dae_zip, dae_entities,
    dae_polygons, dae_false_width, dae_deep, dae_textures, dae_broken,
    glb_instances, glb_nodes, glb_numbers, glb_head, glb_text,
    glb_textures, glb_outside, obj_material, obj_faces, ply_texture, ply_counts,
    stl_size, just_drawn, off_counts, special_file,
)  # fmt: skip


def make(maker: Maker, seed: int, folder: Path) -> tuple[str, str]:
    """Write one robot; gives the path of its URDF and the words of the note."""
    rng = random.Random(f"{maker.__name__} {seed}")
    folder.mkdir(parents=True)
    name, words = maker(rng, folder)
    return str(folder / write(folder, "arm.urdf", urdf(visual(name)))), words
