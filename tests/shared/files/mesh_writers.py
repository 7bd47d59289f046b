"""Small mesh files of every format, written from plain arrays; and what a clean mesh must be."""

import json
import struct
from collections import defaultdict

import numpy as np
from mesh_patches import bent, box

from surfaces.meshes.normals import corner_normals
from surfaces.meshes.triangle_mesh import TriangleMesh


def cube(size=0.2):
    return box(size, size, size)


def plate(nu, nv, width=0.3, height=0.2):
    """A flat grid of nu x nv squares, each cut in two, that looks up."""
    return bent(lambda u, v: (width * u, height * v, 0 * u), nu, nv)


def hilly(nu=14, nv=11):
    return bent(lambda u, v: (0.3 * u, 0.2 * v, 0.03 * np.sin(6 * u) * np.cos(3 * v)), nu, nv)


def strip(twisted, count=24):
    """A band around a circle, with half a twist (Moebius) or none."""
    angle = 2 * np.pi * np.arange(count) / count
    half = angle / 2 if twisted else 0 * angle
    across = np.stack(
        [np.cos(half) * np.cos(angle), np.cos(half) * np.sin(angle), np.sin(half)], axis=1
    )
    middle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    vertices = np.concatenate([middle - 0.2 * across, middle + 0.2 * across]) * 0.3
    k = np.arange(count)
    a, b = k, (k + 1) % count
    c, d = a + count, b + count
    if twisted:
        b[-1], d[-1] = count, 0
    return vertices, np.concatenate([np.stack([a, c, d], 1), np.stack([a, d, b], 1)])


def chain_of_caps():
    """Two triangles, and on the edge that they share a fan of caps: faces with no area."""
    vertices = [[0, 0, 0], [0.2, 0, 0], [0.1, 0.1, 0], [0.1, -0.1, 0.03]]
    vertices += [[0.05, 0, 0], [0.1, 0, 0], [0.15, 0, 0]]
    upper = [[0, 4, 2], [4, 5, 2], [5, 6, 2], [6, 1, 2]]
    return vertices, [*upper, [0, 5, 4], [0, 6, 5], [0, 1, 6], [1, 0, 3]]


def bow_tie():
    return [[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [-0.1, 0, 0], [0, -0.1, 0]], [[0, 1, 2], [0, 3, 4]]


def stl(vertices, faces, count=None, normals=None, head=b"made by a test"):
    rows = np.zeros(len(faces), [("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    rows["v"] = np.asarray(vertices)[np.asarray(faces)] if len(faces) else 0
    if normals is not None:
        rows["n"] = normals
    total = len(faces) if count is None else count
    return head.ljust(80, b" ") + struct.pack("<I", total) + rows.tobytes()


def stl_of(triangles):
    """The same of triangles (F, 3, 3), each with corners of its own."""
    return stl(np.reshape(triangles, (-1, 3)), np.arange(3 * len(triangles)).reshape(-1, 3))


def text_stl(vertices, faces, name="part"):
    lines = [f"solid {name}"]
    for face in np.asarray(vertices)[np.asarray(faces)]:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += [f"vertex {x!r} {y!r} {z!r}" for x, y, z in face.tolist()]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, f"endsolid {name}", ""]).encode()


def off(vertices, polygons, head="OFF", counts=None):
    first = counts or f"{len(vertices)} {len(polygons)} 0"
    rows = [f"{x!r} {y!r} {z!r}" for x, y, z in np.asarray(vertices, float).tolist()]
    rows += [" ".join(map(str, [len(p), *p])) for p in polygons]
    return "\n".join([head, "# a comment", first, *rows, ""]).encode()


def obj(vertices, polygons, more=""):
    rows = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(vertices, float).tolist()]
    rows += ["f " + " ".join(str(k + 1) for k in p) for p in polygons]
    return (more + "\n".join([*rows, ""])).encode()


def ply(vertices, polygons, order="<", header=None):
    """Text where `order` is empty; with columns beside the ones that count."""
    kind = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    head = header or (
        f"ply\nformat {kind} 1.0\ncomment made by a test\n"
        f"element vertex {len(vertices)}\nproperty uchar red\nproperty double x\n"
        f"property double y\nproperty double z\nelement face {len(polygons)}\n"
        "property uchar flag\nproperty list uchar int vertex_indices\nend_header\n"
    )
    body = b""
    for x, y, z in np.asarray(vertices, float).tolist():
        if order:
            body += struct.pack(order + "B3d", 9, x, y, z)
        else:
            body += f"9 {x!r} {y!r} {z!r}\n".encode()
    for p in polygons:
        if order:
            body += struct.pack(f"{order}BB{len(p)}i", 7, len(p), *map(int, p))
        else:
            body += (" ".join(map(str, [7, len(p), *p])) + "\n").encode()
    return head.encode() + body


def scene(vertices, faces, **more):
    """The glTF scene of one mesh in one node, and its bytes."""
    points = np.asarray(vertices, "<f4").tobytes()
    data = points + np.asarray(faces, "<u4").tobytes()
    content = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": np.size(faces), "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": len(points)},
            {"buffer": 0, "byteOffset": len(points), "byteLength": len(data) - len(points)},
        ],
        "buffers": [{"byteLength": len(data)}],
    }  # fmt: skip
    return content | more, data


def glb(content, data, version=2, extra=0):
    text = content if isinstance(content, bytes) else json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    length = 28 + len(text) + len(data) + extra
    head = struct.pack("<4sIIII", b"glTF", version, length, len(text), 0x4E4F534A)
    return head + text + struct.pack("<II", len(data), 0x004E4942) + data


# One good file of each format, and of each way to write it: the cube in metres (in nodes.glb three
# times).

V, F = cube()
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
    return glb(*scene(V, F, nodes=nodes, scenes=[{"nodes": [0, 1, 3]}]))


GOOD: dict[str, bytes] = {
    "binary.stl": stl(V, F), "text.stl": text_stl(V, F),
    "cube.obj": obj(V, QUADS, more="mtllib a\no b\n"), "text.ply": ply(V, F, ""),
    "little.ply": ply(V, QUADS, "<"), "big.ply": ply(V, F, ">"), "cube.off": off(V, F),
    "cube.glb": glb(*scene(V, F)), "nodes.glb": nested_scene(),
}  # fmt: skip
"""File name -> its bytes."""


def assert_clean(mesh):
    """Everything that a `TriangleMesh` promises, by way of dictionaries."""
    assert isinstance(mesh, TriangleMesh)
    v, f, edges = mesh.vertices, mesh.faces, mesh.edges
    assert len(f)
    assert (v.dtype, f.dtype) == (float, np.int64)
    assert np.isfinite(v).all()
    assert sorted(set(f.ravel().tolist())) == list(range(len(v)))
    directed, spokes = {}, defaultdict(list)
    for k, (a, b, c) in enumerate(f.tolist()):
        assert len({a, b, c}) == 3
        for tail, tip, other in ((a, b, c), (b, c, a), (c, a, b)):
            assert (tail, tip) not in directed  # so an edge has two faces at most, that agree
            directed[tail, tip] = k
            spokes[tail].append((tip, other))
    shared = {e for e in directed if e[::-1] in directed and directed[e] < directed[e[::-1]]}
    assert set(map(tuple, edges.vertices.tolist())) == shared
    assert len(edges.vertices) == len(shared)
    sides = [[directed[a, b], directed[b, a]] for a, b in edges.vertices.tolist()]
    assert edges.faces.tolist() == sides
    apart = np.linalg.norm(v[edges.vertices[:, 0]] - v[edges.vertices[:, 1]], axis=1)
    np.testing.assert_allclose(edges.lengths, apart, rtol=1e-12, atol=1e-15)
    lonely = {e: k for e, k in directed.items() if e[::-1] not in directed}
    border = map(tuple, edges.border_vertices.tolist())
    assert dict(zip(border, edges.border_faces.tolist(), strict=True)) == lonely
    for own in spokes.values():  # one fan: from spoke to spoke, all are met
        following = dict(own)
        starts = set(following) - set(following.values()) or {next(iter(following))}
        assert len(starts) == 1
        spoke, met = starts.pop(), 0
        while spoke in following and met < len(own):
            spoke, met = following[spoke], met + 1
        assert met == len(own)
    a, b, c = (v[f[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    size = np.linalg.norm(cross, axis=1)
    assert (size > 0).all()
    assert np.abs(mesh.face_normals - cross / size[:, None]).max() < 1e-12
    assert np.abs(mesh.face_areas - size / 2).max() <= 1e-12 * size.max()
    assert np.abs(np.linalg.norm(corner_normals(mesh), axis=2) - 1).max() < 1e-12
    assert not any(x.flags.writeable for x in (v, f, mesh.face_normals, mesh.face_areas))
