"""Mesh files that go wrong in all known ways: each gives its message, or its stated repair."""

import gzip
import io
import os
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import mesh_writers as w
import numpy as np
import pytest
from approved import refused
from mesh_patches import stacked
from mesh_writers import GOOD, nested_scene

from surfaces.meshes.mesh_notes import notes_of
from surfaces.meshes.sources import read_mesh

V, F = w.cube()
P, G = w.plate(3, 2)  # 12 vertices, 12 faces, 0.06 m^2
FLIPPED = F[:, ::-1]
NAN = np.where(np.arange(8)[:, None] == 5, np.nan, V)
WING = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, -0.1, 0], [0, 0, 0.1]])
NEAR = V[F].reshape(-1, 3) + np.random.default_rng(5).uniform(-2e-8, 2e-8, (36, 3))
SOUP = np.arange(36).reshape(-1, 3)
SECOND = V + np.array([0.5, 0, 0])
LIDS = np.flatnonzero(np.ptp(V[F][..., 2], axis=1) == 0.0)
TRAY = np.delete(F, [4, 5], axis=0)
WALL = V[[0, 1, 7, 6]], np.array([[0, 1, 2], [0, 2, 3]])
STAR = [(1, 0, 0), (-4, 1, 0), (0, 0.1, 0), (-4, 4, 0), (0, 2, 0), (2, 9, 0), (1.2, 2, 0),
        (9, 9, 0)]  # fmt: skip
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
XYZ = ("property float x", "property float y", "property float z")
LIST = "property list uchar int vertex_indices"
EMPTY_VERTICES = ("element vertex 0", *XYZ)
TEXT, OFF, GREAT = w.text_stl(V, F), w.off(V, F), 512 << 20


def sparse(head: bytes, size: int):
    def make(path: Path) -> None:
        path.write_bytes(head)
        os.truncate(path, size)

    return make


def zipped() -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("part.stl", bytes(16 << 20))
    return buffer.getvalue()


def head(*lines: str, kind: str = "ascii") -> bytes:
    return "\n".join(["ply", f"format {kind} 1.0", *lines, "end_header", ""]).encode()


def ply_faces(*polygons: str) -> bytes:
    first = head("element vertex 8", *XYZ, f"element face {len(polygons)}", LIST)
    return first + "\n".join([" ".join(map(str, row)) for row in V] + [*polygons, ""]).encode()


def scene(**more) -> bytes:
    return w.glb(*w.scene(V, F, **more))


def node(**keys) -> bytes:
    return scene(nodes=[{"mesh": 0, **keys}])


def within(part: str, number: int, **keys) -> bytes:
    """The cube's scene with some keys of one accessor, view or primitive replaced."""
    content, data = w.scene(V, F)
    parts = content["meshes"][0] if part == "primitives" else content
    parts[part][number].update(keys)
    return w.glb(content, data)


def instances(nodes: int, faces, primitives: int = 1) -> bytes:
    """One mesh that many nodes show: small on disk, large when made."""
    shown = {"nodes": [{"mesh": 0}] * nodes, "scenes": [{"nodes": list(range(nodes))}]}
    content, data = w.scene(V, faces, **shown)
    content["meshes"][0]["primitives"] *= primitives
    return w.glb(content, data)


def strip_scene(mode: int) -> bytes:
    """A square by a strip (5) of two triangles and one jump, or by a fan (6) without indices."""
    strip = mode == 5
    content, data = w.scene(SQUARE if strip else SQUARE[[0, 1, 3, 2]], [0, 1, 2, 3, 3] * strip)
    keys = {"attributes": {"POSITION": 0}, "mode": mode} | ({"indices": 1} if strip else {})
    content["meshes"][0]["primitives"] = [keys]
    return w.glb(content, data)


def with_points() -> bytes:
    content, data = w.scene(V, F)
    content["meshes"][0]["primitives"].append({"attributes": {"POSITION": 0}, "mode": 1})
    return w.glb(content, data)


def with_library(path: Path) -> None:
    """Its material library is a pipe: whoever opens it waits for ever."""
    os.mkfifo(path.with_suffix(".mtl"))
    path.write_bytes(w.obj(V, F, more=f"mtllib {path.with_suffix('.mtl')}\nusemtl red\n"))


REFUSED = {
    # not a file, or not a mesh
    "missing.stl": lambda path: None, "folder.stl": lambda path: path.mkdir(),
    "pipe.stl": os.mkfifo, "empty.stl": b"", "archive.stl": zipped(),
    "packed.obj": gzip.compress(bytes(64 << 10), mtime=0), "part.step": b"ISO-10303-21;\nHEADER;",
    "page.stl": b"<!DOCTYPE html><html>",
    "pointer.ply": b"version https://git-lfs.github.com/spec/v1\n",
    "text.glb": b'{"asset": {"version": "2.0"}}', "part.3dm": b"3D Geometry File Format",
    "part": w.stl(V, F), "scene.stl": scene(), "points.stl": w.ply(V, F),
    "huge.obj": sparse(b"v 0 0 0\n", GREAT + 1), "a" * 200 + ".stl": b"\0" * 90,
    # STL
    "none.stl": w.stl(V, F[:0]), "cut.stl": w.stl(V, F)[:-7], "long.stl": w.stl(V, F) + b"\0" * 9,
    "lies.stl": w.stl(V, F, count=2**32 - 1), "short.stl": b"sol",
    "many.stl": sparse(b" " * 80 + struct.pack("<I", 2_000_001), 84 + 50 * 2_000_001),
    "nan.stl": w.stl(NAN, F), "infinite.stl": w.stl(np.where(V > 0.1, np.inf, V), F),
    "cut_text.stl": TEXT[:700], "no_end.stl": TEXT.rsplit(b"end", 1)[0],
    "word.stl": TEXT.replace(b"0.2", b"0.x", 1), "underscore.stl": TEXT.replace(b"0.2", b"0_2", 1),
    "two.stl": TEXT.replace(b"vertex 0.0 0.0 0.0\n", b"", 1),
    "four.stl": TEXT.replace(b"0.2", b"0.2 7", 1), "one_line.stl": b"solid " + b"a" * 70000,
    # OFF
    "negative.off": w.off(V, [*F, (0, 1, -1)]), "few.off": b"\n".join(OFF.split(b"\n")[:15]),
    "lies.off": w.off(V, F, counts="8 1000000 0"), "many.off": w.off(V, F, counts="8 2000001 0"),
    "points.off": w.off(V, F, counts="6000001 12 0"),
    "digits.off": w.off(V, F, counts="9" * 5000 + " 1 0"),
    "minus.off": w.off(V, F, counts="-8 12 0"), "four.off": w.off(V, F, head="4OFF"),
    "flat.off": w.off(V, F).replace(b"0.0 0.0 0.0", b"0.0 0.0", 1), "two.off": w.off(V, [(0, 1)]),
    "sides.off": w.off(V, [[0, 1, 3, 2] * 16 + [0]]),
    # OBJ
    "zero.obj": w.obj(V, [(0, 1, -1)]), "before.obj": b"v 0 0 0\nf -1 -2 -1\n",
    "spline.obj": b"v 0 0 0\ncstype bspline\n", "points.obj": w.obj(V, []) + b"p 1 2 3\n",
    "prose.obj": b"dear reader\n", "binary.obj": bytes(range(256)) * 20,
    "star.obj": w.obj(STAR, [range(8)]), "goes_on.obj": w.obj(V, F) + b"f 1 2 \\\n3\n",
    "edge.obj": w.obj(V, [(0, 1)]),
    # PLY
    "many.ply": head("element vertex 3", *XYZ, "element face 2000001", LIST),
    "lies.ply": head("element vertex 1000000", *XYZ, "element face 1", LIST,
                     kind="binary_little_endian"),
    "cut.ply": w.ply(V, F)[:-13], "cut_text.ply": w.ply(V, F, "")[:-30],
    "list.ply": w.ply(V, F).replace(b"\x07\x03", b"\x07\xff", 1),
    "flat.ply": w.ply(V, F).replace(b"double z", b"double w"),
    "no_list.ply": w.ply(V, F).replace(b"_indices", b"_numbers"),
    "real.ply": w.ply(V, F).replace(b"uchar int ", b"uchar float "),
    "cloud.ply": head("element vertex 1", *XYZ) + b"0 0 0\n",
    "strips.ply": head(*EMPTY_VERTICES, "element tristrips 1", LIST),
    "twice.ply": head(*EMPTY_VERTICES, *EMPTY_VERTICES, "element face 0", LIST),
    "flood.ply": head("element junk 9000000000", "property char c", *EMPTY_VERTICES,
                      "element face 1", LIST),
    "head.ply": b"ply\nformat ascii 1.0\n" + b"comment\n" * 1200,
    "headless.ply": b"ply\nformat ascii 1.0\n", "kind.ply": b"ply\nformat morse 1.0\nend_header\n",
    "type.ply": head("element vertex 1", "property real x"),
    "again.ply": head("element vertex 1", *XYZ, XYZ[0], "element face 1", LIST),
    "minus.ply": head("element vertex -1", *XYZ, "element face 1", LIST),
    "two.ply": ply_faces("2 0 1"), "row.ply": ply_faces("3 0 1"),
    "index.ply": w.ply(V, [*F, (0, 1, 2**31 - 1)]),
    # GLB
    "cut.glb": scene()[:-4], "tiny.glb": scene()[:16], "old.glb": w.glb(*w.scene(V, F), version=1),
    "json.glb": w.glb(b'{"asset": ', b""),
    "list.glb": w.glb(b"[1, 2]", b""), "numbers.glb": node(translation=[1, 2]),
    "no_scene.glb": scene().replace(b"JSON", b"BIN\0", 1),
    "no_numbers.glb": scene().replace(b"BIN\0", b"JSON", 1),
    "parts.glb": scene(nodes=[{}] * 100_001), "deep.glb": w.glb(b"[" * 200000, b""),
    "wordy.glb": w.glb(b"{}".ljust(9 << 20), b""),
    "bare.glb": w.glb({"asset": {"version": "2.0"}}, b""),
    "outside.glb": scene(buffers=[{"byteLength": 240, "uri": "../../etc/passwd"}]),
    "view.glb": within("bufferViews", 1, byteLength=10**9),
    "count.glb": within("accessors", 0, count=1000),
    "many.glb": within("accessors", 1, count=6_000_003),
    "offset.glb": within("accessors", 0, byteOffset=-4),
    "kind.glb": within("accessors", 0, type="VEC2"),
    "type.glb": within("accessors", 0, componentType=7),
    "real.glb": within("accessors", 1, componentType=5126),
    "sparse.glb": within("accessors", 0, sparse={}),
    "draco.glb": scene(extensionsRequired=["KHR_draco_mesh_compression"]),
    "circle.glb": node(children=[0]), "child.glb": node(children=[7]), "no_mesh.glb": node(mesh=3),
    "skin.glb": node(skin=0), "turn.glb": node(rotation=[1, 1, 1, 1]),
    "shear.glb": node(matrix=[1] * 16), "big.glb": node(scale=[10**400, 1, 1]),
    "dots.glb": within("primitives", 0, mode=0),
    "no_position.glb": within("primitives", 0, attributes={"COLOR_0": 0}),
    "bomb.glb": instances(2000, np.tile(F, (100, 1))),
    "empty_bomb.glb": instances(2000, F[:0], 2000),
    "index.glb": w.glb(*w.scene(V, [*F, (0, 1, 8)])), "nan.glb": w.glb(*w.scene(NAN, F)),
    # files in order, surfaces that are not
    "point.off": w.off(V * 0, F),
    "straight.off": w.off([(0.1 * k, 0.2 * k, 0.3 * k) for k in range(4)], [(0, 1, 2), (1, 3, 2)]),
    "three.off": w.off(WING, [(0, 4, 1), (0, 4, 2), (0, 4, 3)]),
    "wall.stl": w.stl(*stacked((V, F), WALL)), "moebius.stl": w.stl(*w.strip(twisted=True)),
    "millimetres.stl": w.stl(V * 1500, F), "twice_scaled.stl": w.stl(V * 1e-3, F),
    "far.off": w.off(0.1 * V + [1e6, 0, 0], F), "overflow.off": w.off(V * 1e308, F),
}  # fmt: skip

# The cube of 0.2 m, written in any way, and with anything that a repair has to take away again.
CUBES = {
    **{name: content for name, content in GOOD.items() if name != "nodes.glb"},
    "solid.stl": w.stl(V, F, head=b"solid but binary"),
    "off.stl": w.stl(V, F, head=b"OFF white part"), "upper.STL": TEXT.upper(),
    "dos.stl": TEXT.replace(b"\n", b"\r\n"), "marked.stl": b"\xef\xbb\xbf" + TEXT,
    "library.obj": with_library,
    "slashes.obj": w.obj(V, []) + b"vt 0 0\nvn 0 0 1\n" + b"".join(
        b"f %d/1/1 %d//1 %d\n" % (a + 1, b + 1, c - 8) for a, b, c in F),
    "tie.glb": with_points(), "normals.stl": w.stl(V, F, normals=np.tile([1.0, 0, 0], (12, 1))),
    "near.off": w.off(NEAR, SOUP), "unused.obj": w.obj([*V, (np.nan, 0, 0), (9e9, 0, 0)], F),
    "both_sides.off": w.off(V, [*F, *FLIPPED]),
    "collapsed.off": w.off(V, [*F, (0, 0, 1), (2, 2, 2)]),
    "mostly_flipped.stl": w.stl(V, [*FLIPPED[:9], *F[9:]]), "inside_out.stl": w.stl(V, FLIPPED),
    "fin.off": w.off([*V, (0, 0, 0.1)], [*F, (0, 1, 8)]),
}  # fmt: skip
CUBE = 6 * 0.2**2  # m^2
TWO = w.obj(SECOND, []) + b"".join(b"f %d %d %d\n" % tuple(f + 9) for f in F)
ARROW = [(0, 0, 0), (0.2, 0.1, 0), (0, 0.2, 0), (0.05, 0.1, 0)]  # fans about two corners overlap

# File -> content, m^2, faces, vertices.
OTHERS = {
    "nodes.glb": (nested_scene(), 6 * CUBE, 36, 24),
    "one.stl": (w.stl(V, F[:1]), 0.02, 1, 3),
    "quads.ply": (w.ply(P, [(0, 3, 4, 1), (3, 6, 7, 4)]), 0.02, 4, 6),
    "mixed.ply": (w.ply(P, [(0, 3, 4, 1), (3, 6, 7), (3, 7, 4)]), 0.02, 4, 6),
    "arrow.off": (w.off(ARROW, [range(4)]), 0.015, 2, 4),
    "objects.obj": (b"o a\n" + w.obj(V, F) + b"o b\n" + TWO, 2 * CUBE, 24, 16),
    "solids.stl": (TEXT + w.text_stl(SECOND, F), 2 * CUBE, 24, 16),
    "strip.glb": (strip_scene(5), 1.0, 2, 4),
    "fan.glb": (strip_scene(6), 1.0, 2, 4),
    "caps.off": (w.off(*w.chain_of_caps()), 0.01 + 0.1 * np.hypot(0.1, 0.03), 8, 7),
    "needle.off": (w.off([*P, (0.15, -1e-8, 0)], [*G, (0, 12, 9)]), 0.06, 12, 12),
    "mostly_up.off": (w.off(P, [*G[:3, ::-1], *G[3:]]), 0.06, 12, 12),
    "bow_tie.off": (w.off(*w.bow_tie()), 0.01, 2, 6),
    "pieces.stl": (w.stl(*stacked((V, F), (SECOND, TRAY))), CUBE * 11 / 6, 22, 16),
    "ring.stl": (w.stl(*w.strip(twisted=False)), 0.864 * np.sin(np.pi / 12), 48, 48),
    "wide.stl": (w.stl(V * 32, F), CUBE * 32**2, 12, 8),
    "tube.off": (w.off(V, np.delete(F, LIDS, axis=0)), CUBE * 2 / 3, 8, 8),
}
TAKEN = {name: (content, CUBE, 12, 8) for name, content in CUBES.items()} | OTHERS
CONTENTS = REFUSED | {name: each[0] for name, each in TAKEN.items()}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """All of them, and nothing else."""
    folder = tmp_path_factory.mktemp("meshes")
    for name, content in CONTENTS.items():
        path = folder / name
        path.write_bytes(content) if isinstance(content, bytes) else content(path)
    return folder


def test_what_is_refused_is_said_in_one_line_without_the_folder(folder, approved):
    said = []
    for name in REFUSED:
        message = refused(read_mesh, folder / name)
        assert message.startswith(repr(name if len(name) <= 100 else f"{name[:100]}...") + ": ")
        assert "\n" not in message
        assert len(message) < 700
        assert str(folder) not in message
        said.append(message)
    approved("mesh files refused", "\n".join(said))


@pytest.mark.parametrize("name", TAKEN)
def test_what_is_repaired_is_a_clean_mesh_of_the_same_area(name, folder):
    _, area, faces, vertices = TAKEN[name]
    mesh, again = read_mesh(folder / name), read_mesh(folder / name)
    w.assert_clean(mesh)
    assert (len(mesh.faces), len(mesh.vertices)) == (faces, vertices)
    assert mesh.area == pytest.approx(area, rel=2e-6)
    assert mesh.vertices.tobytes() == again.vertices.tobytes()
    assert mesh.faces.tobytes() == again.faces.tobytes()
    assert notes_of(mesh) == notes_of(again)


def test_what_is_repaired_is_said(folder, approved):
    notes = {name: notes_of(read_mesh(folder / name)) for name in TAKEN}
    told = [f"{name}: {' | '.join(each)}" for name, each in notes.items() if each]
    approved("mesh files repaired", "\n".join(told))


ALONE = """
import resource, sys
from pathlib import Path
resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))
from surfaces.meshes.sources import read_mesh
from coverable import SurfaceError
read_mesh(sys.argv[1] + "/cube.glb")  # which loads the libraries
opened = []
sys.addaudithook(lambda event, facts: opened.append(facts[0]) if event == "open" else None)
for path in sorted(Path(sys.argv[1]).iterdir()):
    opened.clear()
    try:
        read_mesh(path)
        print("mesh", path.name)
    except SurfaceError:
        print("refused", path.name)
    others = {str(one) for one in opened if not isinstance(one, int)} - {str(path)}
    if any(not one.endswith((".py", ".pyc", ".so")) for one in others):
        print(path.name, "opens", others)
"""


def test_all_of_them_in_two_gigabytes_without_another_file(folder):
    """A process that is refused more memory reads every file, ends as it should, opens no other."""
    root = str(Path(__file__).parents[2])
    done = subprocess.run(
        [sys.executable, "-c", ALONE, folder], capture_output=True, text=True, check=False,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": root},
    )  # fmt: skip
    assert done.stderr == ""
    expected = {f"refused {name}" for name in REFUSED if name != "missing.stl"}
    expected |= {f"mesh {name}" for name in TAKEN} | {"refused library.mtl"}
    assert set(done.stdout.splitlines()) == expected
