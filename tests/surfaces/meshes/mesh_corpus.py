"""Mesh files that go wrong in every way we know of, made here so that nothing large is stored.

`REFUSED` must each raise one SurfaceError that holds the fragments listed. `REPAIRED` must each
give a clean mesh of the stated area and counts, with exactly the notes listed.
"""

import gzip
import io
import os
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import mesh_writers as w
import numpy as np

V, F = w.cube()
CUBE_AREA = 6 * 0.2**2
FLIPPED = F[:, ::-1]
NAN = np.where(np.arange(8)[:, None] == 5, np.nan, V)
WING = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, -0.1, 0], [0, 0, 0.1]])
P, G = w.plate(3, 2)  # 12 vertices, 12 faces, 0.06 m^2


class Refused(NamedTuple):
    file: str
    content: bytes | Callable[[Path], None]
    """Or what makes the file."""
    said: tuple[str, ...]


class Repaired(NamedTuple):
    file: str
    content: bytes | Callable[[Path], None]
    area: float
    faces: int
    vertices: int
    notes: tuple[str, ...] = ()
    """A fragment of each note, in order."""


def zipped() -> bytes:
    """An archive that inflates to 16 MB of zeros."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("part.stl", bytes(16 << 20))
    return buffer.getvalue()


def sparse(head: bytes, size: int) -> Callable[[Path], None]:
    """A file that is large by its size only."""

    def make(path: Path) -> None:
        path.write_bytes(head)
        os.truncate(path, size)

    return make


def ply_header(*lines: str, kind: str = "ascii") -> bytes:
    return "\n".join(["ply", f"format {kind} 1.0", *lines, "end_header", ""]).encode()


XYZ = ("property float x", "property float y", "property float z")
LIST = "property list uchar int vertex_indices"


def ply_faces(*polygons: str) -> bytes:
    """Text with the cube's vertices."""
    head = ply_header("element vertex 8", *XYZ, f"element face {len(polygons)}", LIST)
    return head + "\n".join([" ".join(map(str, row)) for row in V] + [*polygons, ""]).encode()


def cube_scene(change: Callable[[dict], object] = lambda content: None, **more) -> bytes:
    content, data = w.scene(V, F, **more)
    change(content)
    return w.glb(content, data)


def instances(count: int, faces: np.ndarray) -> bytes:
    """One mesh that many nodes show: small on disk, large when made."""
    nodes = [{"mesh": 0}] * count
    return w.glb(*w.scene(V, faces, nodes=nodes, scenes=[{"nodes": list(range(count))}]))


def empty_instances() -> bytes:
    """Many nodes that show many meshes of no triangles."""
    content, data = w.scene(V, F[:0], nodes=[{"mesh": 0}] * 2000)
    content["scenes"] = [{"nodes": list(range(2000))}]
    content["meshes"][0]["primitives"] *= 2000
    return w.glb(content, data)


def moved(shift, scale=1.0):
    return V * scale + np.asarray(shift)


def stacked(*parts):
    offsets = np.cumsum([0] + [len(v) for v, _ in parts])
    faces = [f + k for (_, f), k in zip(parts, offsets, strict=False)]
    return np.concatenate([v for v, _ in parts]), np.concatenate(faces)


def with_chain_of_caps():
    """Two triangles that share an edge, cut apart by caps on it: faces with no area.

    Three corners lie on that edge, fanned, so that caps lie behind caps.
    """
    vertices = [[0, 0, 0], [0.2, 0, 0], [0.1, 0.1, 0], [0.1, -0.1, 0.03]]
    vertices += [[0.05, 0, 0], [0.1, 0, 0], [0.15, 0, 0]]
    upper = [[0, 4, 2], [4, 5, 2], [5, 6, 2], [6, 1, 2]]
    return vertices, [*upper, [0, 5, 4], [0, 6, 5], [0, 1, 6], [1, 0, 3]]


CAPS_AREA = 0.01 + 0.1 * np.hypot(0.1, 0.03)
BOW_TIE = ([*WING[:3], [-0.1, 0, 0], [0, -0.1, 0]], [[0, 1, 2], [0, 3, 4]])
GHOST = "a" * 300

REFUSED = (
    # not a file, or not a mesh
    Refused("missing.stl", lambda path: None, ("there is no such file", "STL, OBJ, PLY, OFF")),
    Refused("folder.stl", lambda path: path.mkdir(), ("is a folder",)),
    Refused("pipe.stl", os.mkfifo, ("not a regular file",)),
    Refused("empty.stl", b"", ("is empty", "expected a mesh")),
    Refused("archive.stl", zipped, ("zip archive", "unpack it")),
    Refused("packed.obj", gzip.compress(bytes(64 << 10)), ("gzip", "unpack it")),
    Refused("part.step", b"ISO-10303-21;\nHEADER;", ("STEP", "export it as STL")),
    Refused("page.stl", b"<!DOCTYPE html><html>", ("web page",)),
    Refused("pointer.ply", b"version https://git-lfs.github.com/spec/v1\n", ("git lfs pull",)),
    Refused("text.glb", b'{"asset": {"version": "2.0"}}', ("glTF as text", ".glb")),
    Refused("part.3dm", b"3D Geometry File Format", ("ends in '.3dm'", "STL, OBJ")),
    Refused("part", w.stl(V, F), ("has no extension",)),
    Refused("scene.stl", cube_scene(), ("is GLB by its first bytes",)),
    Refused("points.stl", w.ply(V, F), ("is PLY by its first bytes",)),
    Refused("huge.obj", sparse(b"v 0 0 0\n", (512 << 20) + 1), ("larger than 512 MB", "thin")),
    Refused(f"{GHOST[:200]}.stl", b"\0" * 90, ("is no STL",)),
    # STL
    Refused("none.stl", w.stl(V, F[:0]), ("holds no faces",)),
    Refused("cut.stl", w.stl(V, F)[:-7], ("binary STL of 12 faces", "684 bytes", "has 677")),
    Refused("long.stl", w.stl(V, F) + b"\0" * 9, ("684 bytes", "has 693")),
    Refused("lies.stl", w.stl(V, F, count=2**32 - 1), ("4,294,967,295 faces",)),
    Refused("short.stl", b"solid"[:3], ("too short for a binary STL",)),
    Refused(
        "five_million.stl",
        sparse(b" " * 80 + struct.pack("<I", 5_000_000), 84 + 50 * 5_000_000),
        ("has 5,000,000 faces", "2,000,000", "thin it first", "Decimat"),
    ),
    Refused("nan.stl", w.stl(NAN, F), ("not finite", "[nan, nan, nan]")),
    Refused("infinite.stl", w.stl(np.where(V > 0.1, np.inf, V), F), ("7 vertices", "not finite")),
    Refused("cut_text.stl", w.text_stl(V, F)[:700], ("line",)),
    Refused("no_end.stl", w.text_stl(V, F).rsplit(b"end", 1)[0], ("without 'endsolid'",)),
    Refused("word.stl", w.text_stl(V, F).replace(b"0.2", b"0.x", 1), ("line 5", "numbers", "0.x")),
    Refused("underscore.stl", w.text_stl(V, F).replace(b"0.2", b"0_2", 1), ("line 5", "0_2")),
    Refused(
        "two.stl",
        w.text_stl(V, F).replace(b"vertex 0.0 0.0 0.0\n", b"", 1),
        ("line 6", "'vertex'", "'endloop'"),
    ),
    Refused("four.stl", w.text_stl(V, F).replace(b"0.2", b"0.2 7", 1), ("vertex x y z",)),
    Refused("one_line.stl", b"solid " + b"a" * 70000, ("line 1", "longer than 65536")),
    # OFF
    Refused("negative.off", w.off(V, [*F, (0, 1, -1)]), ("face 12", "[0, 1, -1]")),
    Refused("few.off", b"\n".join(w.off(V, F).split(b"\n")[:15]), ("before face 4 of 12",)),
    Refused("lies.off", w.off(V, F, counts="8 1000000 0"), ("1000000 faces", "cannot hold")),
    Refused("five_million.off", w.off(V, F, counts="8 5000000 0"), ("has 5,000,000 faces",)),
    Refused("points.off", w.off(V, F, counts="99000000 12 0"), ("has 99,000,000 vertices",)),
    Refused("digits.off", w.off(V, F, counts="9" * 5000 + " 1 0"), ("line 3", "whole number")),
    Refused("minus.off", w.off(V, F, counts="-8 12 0"), ("negative counts",)),
    Refused("four.off", w.off(V, F, head="4OFF"), ("line 1", "'4OFF'")),
    Refused("two.off", w.off(V, [(0, 1)]), ("3 .. 64 corners",)),
    # OBJ
    Refused("zero.obj", w.obj(V, [(0, 1, -1)]), ("line 9", "vertex 0", "counts from 1")),
    Refused("before.obj", b"v 0 0 0\nf -1 -2 -1\n", ("line 2", "vertex -2")),
    Refused("spline.obj", b"v 0 0 0\ncstype bspline\n", ("line 2", "curved patch")),
    Refused("points.obj", w.obj(V, []) + b"p 1 2 3\n", ("holds no faces",)),
    Refused("prose.obj", b"dear reader\n", ("line 1", "'dear'")),
    Refused("binary.obj", bytes(range(256)) * 20, ("line",)),
    Refused(
        "star.obj",
        w.obj(
            [
                (1, 0, 0),
                (-4, 1, 0),
                (0, 0.1, 0),
                (-4, 4, 0),
                (0, 2, 0),
                (2, 9, 0),
                (1.2, 2, 0),
                (9, 9, 0),
            ],
            [range(8)],
        ),
        ("not convex",),
    ),
    Refused("goes_on.obj", w.obj(V, F) + b"f 1 2 \\\n3\n", ("line 21", "goes on")),
    # PLY
    Refused(
        "five_million.ply",
        ply_header("element vertex 3", *XYZ, "element face 5000000", LIST),
        ("has 5,000,000 faces", "thin it first"),
    ),
    Refused(
        "lies.ply",
        ply_header(
            "element vertex 1000000", *XYZ, "element face 1", LIST, kind="binary_little_endian"
        ),
        ("1,000,000 of 'vertex'", "cannot hold"),
    ),
    Refused("cut.ply", w.ply(V, F)[:-7], ("12 of 'face'", "cut short")),
    Refused("cut_text.ply", w.ply(V, F, "")[:-30], ("ends after line",)),
    Refused(
        "list.ply", w.ply(V, F).replace(b"\x07\x03", b"\x07\xff", 1), ("12 of 'face'", "cut short")
    ),
    Refused("flat.ply", w.ply(V, F).replace(b"double z", b"double w"), ("need x, y and z",)),
    Refused("no_list.ply", w.ply(V, F).replace(b"_indices", b"_numbers"), ("vertex_indices",)),
    Refused("real.ply", w.ply(V, F).replace(b"uchar int ", b"uchar float "), ("whole numbers",)),
    Refused("cloud.ply", ply_header("element vertex 1", *XYZ) + b"0 0 0\n", ("holds no faces",)),
    Refused(
        "strips.ply", ply_header("element vertex 0", *XYZ, "element tristrips 1", LIST), ("strips",)
    ),
    Refused(
        "twice.ply",
        ply_header("element vertex 0", *XYZ, "element vertex 0", *XYZ, "element face 0", LIST),
        ("twice",),
    ),
    Refused(
        "flood.ply",
        ply_header(
            "element junk 9000000000",
            "property char c",
            "element vertex 0",
            *XYZ,
            "element face 1",
            LIST,
        ),
        ("9,000,000,000 of 'junk'",),
    ),
    Refused("head.ply", b"ply\nformat ascii 1.0\n" + b"comment\n" * 1200, ("line 1001", "header")),
    Refused("headless.ply", b"ply\nformat ascii 1.0\n", ("inside the header",)),
    Refused("kind.ply", b"ply\nformat morse 1.0\nend_header\n", ("line 2", "format ascii")),
    Refused("two.ply", ply_faces("2 0 1"), ("2 corners",)),
    Refused("row.ply", ply_faces("3 0 1"), ("too short",)),
    Refused("index.ply", w.ply(V, [*F, (0, 1, 2**31 - 1)]), ("face 12", "2147483647")),
    # GLB
    Refused("cut.glb", cube_scene()[:-4], ("its header gives", "cut short")),
    Refused("tiny.glb", cube_scene()[:16], ("too short",)),
    Refused("old.glb", w.glb(*w.scene(V, F), version=1), ("version 2",)),
    Refused("json.glb", w.glb(b'{"asset": ', b""), ("no valid JSON",)),
    Refused("list.glb", w.glb(b"[1, 2]", b""), ("must be a JSON object",)),
    Refused("deep.glb", w.glb(b"[" * 200000, b""), ("no valid JSON",)),
    Refused("wordy.glb", w.glb(b"{}".ljust(9 << 20), b""), ("9,437,184 bytes",)),
    Refused("bare.glb", w.glb({"asset": {"version": "2.0"}}, b""), ("holds no faces",)),
    Refused(
        "outside.glb",
        cube_scene(buffers=[{"byteLength": 240, "uri": "../../etc/passwd"}]),
        ("buffers[0]", "outside the file"),
    ),
    Refused(
        "view.glb",
        cube_scene(lambda s: s["bufferViews"][1].update(byteLength=10**9)),
        ("accessors[1]", "is damaged"),
    ),
    Refused(
        "count.glb",
        cube_scene(lambda s: s["accessors"][0].update(count=1000)),
        ("accessors[0]", "12000 bytes"),
    ),
    Refused(
        "five_million.glb",
        cube_scene(lambda s: s["accessors"][1].update(count=15_000_000)),
        ("has 5,000,000 faces",),
    ),
    Refused(
        "offset.glb", cube_scene(lambda s: s["accessors"][0].update(byteOffset=-4)), ("byteOffset",)
    ),
    Refused("kind.glb", cube_scene(lambda s: s["accessors"][0].update(type="VEC2")), ("VEC3",)),
    Refused(
        "type.glb",
        cube_scene(lambda s: s["accessors"][0].update(componentType=7)),
        ("component type",),
    ),
    Refused(
        "real.glb",
        cube_scene(lambda s: s["accessors"][1].update(componentType=5126)),
        ("not whole numbers",),
    ),
    Refused("sparse.glb", cube_scene(lambda s: s["accessors"][0].update(sparse={})), ("sparse",)),
    Refused(
        "draco.glb",
        cube_scene(extensionsRequired=["KHR_draco_mesh_compression"]),
        ("KHR_draco_mesh_compression", "without compression"),
    ),
    Refused("circle.glb", cube_scene(nodes=[{"mesh": 0, "children": [0]}]), ("reached twice",)),
    Refused("child.glb", cube_scene(nodes=[{"mesh": 0, "children": [7]}]), ("children",)),
    Refused("no_mesh.glb", cube_scene(nodes=[{"mesh": 3}]), ("meshes[3]",)),
    Refused("skin.glb", cube_scene(nodes=[{"mesh": 0, "skin": 0}]), ("skeleton",)),
    Refused("turn.glb", cube_scene(nodes=[{"mesh": 0, "rotation": [1, 1, 1, 1]}]), ("quaternion",)),
    Refused("shear.glb", cube_scene(nodes=[{"mesh": 0, "matrix": [1] * 16}]), ("last row",)),
    Refused(
        "big.glb",
        cube_scene(nodes=[{"mesh": 0, "scale": [10**400, 1, 1]}]),
        ("nodes[0].scale[0]", "within 1e12"),
    ),
    Refused(
        "dots.glb",
        cube_scene(lambda s: s["meshes"][0]["primitives"][0].update(mode=0)),
        ("holds no faces", "points and lines"),
    ),
    Refused(
        "no_position.glb",
        cube_scene(lambda s: s["meshes"][0]["primitives"][0].update(attributes={"COLOR_0": 0})),
        ("has no 'POSITION'",),
    ),
    Refused("bomb.glb", instances(2000, np.tile(F, (100, 1))), ("faces, more than",)),
    Refused("empty_bomb.glb", empty_instances, ("more than 10000 meshes",)),
    Refused("index.glb", w.glb(*w.scene(V, [*F, (0, 1, 8)])), ("face 12", "[0, 1, 8]")),
    Refused("nan.glb", w.glb(*w.scene(NAN, F)), ("not finite",)),
    # files in order, surfaces that are not
    Refused("point.off", w.off(V * 0, F), ("0 m across", "no surface")),
    Refused(
        "straight.off",
        w.off([(0.1 * k, 0.2 * k, 0.3 * k) for k in range(4)], [(0, 1, 2), (1, 3, 2)]),
        ("no face with an area is left", "2 faces thinner"),
    ),
    Refused(
        "three.off",
        w.off(WING, [(0, 4, 1), (0, 4, 2), (0, 4, 3)]),
        ("1 edge with more than two faces", "(0, 0, 0) m to (0, 0, 0.1) m", "has 3", "inner walls"),
    ),
    Refused(
        "wall.stl",
        w.stl(*stacked((V, F), (V[[0, 1, 7, 6]], np.array([[0, 1, 2], [0, 2, 3]])))),
        ("4 edges with more than two faces",),
    ),
    Refused("moebius.stl", w.stl(*w.strip(twisted=True)), ("48 faces", "only one side", "Moebius")),
    Refused("millimetres.stl", w.stl(V * 1500, F), ("300 m wide", "scale = 0.001", "0.3 m")),
    Refused("twice_scaled.stl", w.stl(V * 1e-3, F), ("0.0002 m wide", "scale = 1000")),
    Refused("far.off", w.off(moved((1e6, 0, 0), 0.1), F), ("from its origin", "move it")),
    Refused("overflow.off", w.off(V * 1e308, F), ("within 1e9 m",)),
)

NEAR = V[F].reshape(-1, 3) + np.random.default_rng(5).uniform(-2e-8, 2e-8, (36, 3))
SOUP = np.arange(36).reshape(-1, 3)
TRAY = np.delete(F, [4, 5], axis=0)
SECOND = moved((0.5, 0, 0))
Y_UP = "y axis points up"


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
    return cube_scene(nodes=nodes, scenes=[{"nodes": [0, 1, 3]}])


def strip_scene(mode: int) -> bytes:
    """A square by a strip (5) or fan (6) of two triangles, and one jump."""
    order = [0, 1, 2, 3, 3] if mode == 5 else [0, 1, 3, 2, 2]
    content, data = w.scene(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]), order)
    content["meshes"][0]["primitives"][0]["mode"] = mode
    return w.glb(content, data)


def with_library(path: Path) -> None:
    """Its material library is a pipe: whoever opens it waits for ever."""
    os.mkfifo(path.with_suffix(".mtl"))
    path.write_bytes(w.obj(V, F, more=f"mtllib {path.with_suffix('.mtl')}\nusemtl red\n"))


REPAIRED = (
    Repaired("cube.stl", w.stl(V, F), CUBE_AREA, 12, 8),
    Repaired("solid.stl", w.stl(V, F, head=b"solid but binary"), CUBE_AREA, 12, 8),
    Repaired("off.stl", w.stl(V, F, head=b"OFF white part"), CUBE_AREA, 12, 8),
    Repaired("text.stl", w.text_stl(V, F), CUBE_AREA, 12, 8),
    Repaired("upper.STL", w.text_stl(V, F).upper(), CUBE_AREA, 12, 8),
    Repaired("dos.stl", w.text_stl(V, F).replace(b"\n", b"\r\n"), CUBE_AREA, 12, 8),
    Repaired("marked.stl", b"\xef\xbb\xbf" + w.text_stl(V, F), CUBE_AREA, 12, 8),
    Repaired("cube.off", w.off(V, F), CUBE_AREA, 12, 8),
    Repaired("cube.obj", w.obj(V, F), CUBE_AREA, 12, 8),
    Repaired("small.ply", w.ply(V, F, "<"), CUBE_AREA, 12, 8),
    Repaired("great.ply", w.ply(V, F, ">"), CUBE_AREA, 12, 8),
    Repaired("text.ply", w.ply(V, F, ""), CUBE_AREA, 12, 8),
    Repaired("cube.glb", cube_scene(), CUBE_AREA, 12, 8, (Y_UP,)),
    Repaired("one.stl", w.stl(V, F[:1]), 0.02, 1, 3),
    Repaired("library.obj", with_library, CUBE_AREA, 12, 8),
    Repaired(
        "slashes.obj",
        w.obj(V, [])
        + b"vt 0 0\nvn 0 0 1\n"
        + "".join(f"f {a + 1}/1/1 {b + 1}//1 {c - 8}\n" for a, b, c in F).encode(),
        CUBE_AREA,
        12,
        8,
    ),
    Repaired(
        "quads.ply",
        w.ply(P, [(0, 3, 4, 1), (3, 6, 7, 4)]),
        0.02,
        4,
        6,
        ("2 faces with more than three corners", "6 vertices"),
    ),
    Repaired(
        "mixed.ply",
        w.ply(P, [(0, 3, 4, 1), (3, 6, 7), (3, 7, 4)]),
        0.02,
        4,
        6,
        ("1 face was cut", "6 vertices"),
    ),
    # An arrow head, whose fans about two of its four corners would overlap.
    Repaired(
        "arrow.off",
        w.off([(0, 0, 0), (0.2, 0.1, 0), (0, 0.2, 0), (0.05, 0.1, 0)], [range(4)]),
        0.015,
        2,
        4,
        ("1 face was cut",),
    ),
    Repaired(
        "objects.obj",
        b"o a\n"
        + w.obj(V, F)
        + b"o b\n"
        + w.obj(SECOND, [])
        + b"".join(b"f %d %d %d\n" % tuple(f + 9) for f in F),
        2 * CUBE_AREA,
        24,
        16,
        ("2 objects", "2 separate pieces (12 faces"),
    ),
    Repaired(
        "solids.stl",
        w.text_stl(V, F) + w.text_stl(SECOND, F),
        2 * CUBE_AREA,
        24,
        16,
        ("2 solids", "2 separate pieces"),
    ),
    Repaired(
        "nodes.glb", nested_scene(), 6 * CUBE_AREA, 36, 24, (Y_UP, "3 meshes", "3 separate pieces")
    ),
    Repaired("strip.glb", strip_scene(5), 1.0, 2, 4, (Y_UP,)),
    Repaired("fan.glb", strip_scene(6), 1.0, 2, 4, (Y_UP,)),
    Repaired(
        "tie.glb",
        cube_scene(
            lambda s: s["meshes"][0]["primitives"].append(
                {"attributes": {"POSITION": 0}, "mode": 1}
            )
        ),
        CUBE_AREA,
        12,
        8,
        (Y_UP, "points and lines (1 of the scene's meshes)"),
    ),
    Repaired(
        "normals.stl",
        w.stl(V, F, normals=np.tile([1.0, 0, 0], (12, 1))),
        CUBE_AREA,
        12,
        8,
        ("2 of 12 faces contradict",),
    ),
    Repaired(
        "near.off",
        w.off(NEAR, SOUP),
        CUBE_AREA,
        12,
        8,
        ("28 vertices that repeated others were joined to them, 28 of them not equal",),
    ),
    Repaired(
        "unused.obj",
        w.obj([*V, (np.nan, 0, 0), (9e9, 0, 0)], F),
        CUBE_AREA,
        12,
        8,
        ("2 vertices that no face uses",),
    ),
    Repaired(
        "both_sides.off",
        w.off(V, [*F, *FLIPPED]),
        CUBE_AREA,
        12,
        8,
        (f"12 faces ({CUBE_AREA:.4g} m^2) that repeated others dropped",),
    ),
    Repaired(
        "collapsed.off",
        w.off(V, [*F, (0, 0, 1), (2, 2, 2)]),
        CUBE_AREA,
        12,
        8,
        ("2 faces with two corners in one place",),
    ),
    Repaired(
        "mostly_flipped.stl",
        w.stl(V, [*FLIPPED[:9], *F[9:]]),
        CUBE_AREA,
        12,
        8,
        ("3 faces turned over", "inwards"),
    ),
    Repaired(
        "inside_out.stl",
        w.stl(V, FLIPPED),
        CUBE_AREA,
        12,
        8,
        ("1 closed piece of the mesh faces inwards",),
    ),
    Repaired("caps.off", w.off(*with_chain_of_caps()), CAPS_AREA, 8, 7, ("without area",)),
    Repaired(
        "needle.off",
        w.off([*P, (0.15, -1e-8, 0)], [*G, (0, 12, 9)]),
        0.06,
        12,
        12,
        ("1 face thinner than",),
    ),
    Repaired(
        "fin.off",
        w.off([*V, (0, 0, 0.1)], [*F, (0, 1, 8)]),
        CUBE_AREA,
        12,
        8,
        ("1 face thinner than 3.5e-07 m dropped from edges with more than two",),
    ),
    Repaired(
        "bow_tie.off",
        w.off(*BOW_TIE),
        0.01,
        2,
        6,
        ("1 vertex added where pieces touch", "2 separate pieces"),
    ),
    Repaired(
        "pieces.stl",
        w.stl(*stacked((V, F), (SECOND, TRAY))),
        CUBE_AREA * 11 / 6,
        22,
        16,
        ("2 separate pieces (12 faces, 0.24 m^2; 10 faces, 0.2 m^2)",),
    ),
    Repaired(
        "ring.stl",
        w.stl(*w.strip(twisted=False)),
        24 * np.sin(np.pi / 12) * 0.5 * 0.09 * (1.2**2 - 0.8**2),
        48,
        48,
        ("1 hole",),
    ),
    Repaired("wide.stl", w.stl(V * 32, F), CUBE_AREA * 32**2, 12, 8, ("6.4 m wide",)),
)


def write(folder: Path, entry: Refused | Repaired) -> Path:
    """Make the file of an entry."""
    path = folder / entry.file
    content = entry.content
    if isinstance(content, bytes):
        path.write_bytes(content)
        return path
    made = content() if content in (zipped, empty_instances) else content(path)
    if isinstance(made, bytes):
        path.write_bytes(made)
    return path
