"""Robots whose pictures are traps, made from a seed: mesh files, and what these name beside them.

Each maker writes files into a folder and says what the drawing must say: words of a note, or
nothing where the shape can be drawn and the trap must only not be touched.
"""

from __future__ import annotations

import os
import random
import struct
from pathlib import Path

import hostile_collada as dae
import hostile_glb as glbs
from hostile_collada import collada, geometry, shown
from hostile_glb import glb, scene_of
from hostile_parts import DRAWN, Maker, trap, urdf, visual, write


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
    dae.dae_tree, dae.dae_wide, dae.dae_circle, dae.dae_chain, dae.dae_zip, dae.dae_entities,
    dae.dae_polygons, dae.dae_false_width, dae.dae_deep, dae.dae_textures, dae.dae_broken,
    glbs.glb_instances, glbs.glb_nodes, glbs.glb_numbers, glbs.glb_head, glbs.glb_text,
    glbs.glb_textures, glbs.glb_outside, obj_material, obj_faces, ply_texture, ply_counts,
    stl_size, just_drawn, off_counts, special_file,
)  # fmt: skip


def make(maker: Maker, seed: int, folder: Path) -> tuple[str, str]:
    """Write one robot; gives the path of its URDF and the words of the note."""
    rng = random.Random(f"{maker.__name__} {seed}")
    folder.mkdir(parents=True)
    name, words = maker(rng, folder)
    return str(folder / write(folder, "arm.urdf", urdf(visual(name)))), words
