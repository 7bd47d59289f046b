"""COLLADA files that are traps: instances, archives, entities, pictures, and lies about counts."""

from __future__ import annotations

import io
import random
import struct
import zipfile
from pathlib import Path

from hostile_parts import DRAWN, TRIANGLE, trap, write


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
