"""Every file of the corpus gives its message or its stated repair; no other file does harm."""

import contextlib
import os
import subprocess
import sys
import tracemalloc
from pathlib import Path

import mesh_corpus as corpus
import mesh_writers as w
import numpy as np
import pytest
from scipy.spatial import cKDTree

from surfaces import SurfaceError
from surfaces.meshes import read_mesh
from surfaces.meshes.repair import notes_of

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize("entry", corpus.REFUSED, ids=lambda entry: entry.file[:40])
def test_refused(entry, tmp_path):
    path = corpus.write(tmp_path, entry)
    with pytest.raises(SurfaceError) as caught:
        read_mesh(path)
    message = str(caught.value)
    short = entry.file if len(entry.file) <= 100 else f"{entry.file[:100]}..."
    for fragment in (repr(short), *entry.said):
        assert fragment in message
    assert "\n" not in message
    assert len(message) < 700
    assert str(tmp_path) not in message


@pytest.mark.parametrize("entry", corpus.REPAIRED, ids=lambda entry: entry.file)
def test_repaired(entry, tmp_path):
    mesh = read_mesh(corpus.write(tmp_path, entry))
    w.assert_clean(mesh)
    assert (len(mesh.faces), len(mesh.vertices)) == (entry.faces, entry.vertices)
    assert mesh.area == pytest.approx(entry.area, rel=2e-6)
    assert len(notes_of(mesh)) == len(entry.notes), notes_of(mesh)
    for fragment, note in zip(entry.notes, notes_of(mesh), strict=True):
        assert fragment in note


def test_the_whole_corpus_in_two_gigabytes(tmp_path):
    """A process that is refused more memory reads every file, and ends as it should."""
    for entry in (*corpus.REFUSED, *corpus.REPAIRED):
        corpus.write(tmp_path, entry)
    script = f"""
import resource
resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))
from pathlib import Path
from surfaces.meshes import read_mesh
from surfaces import SurfaceError
for path in sorted(Path({str(tmp_path)!r}).iterdir()):
    try:
        read_mesh(path)
        print("mesh", path.name)
    except SurfaceError:
        print("refused", path.name)
"""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", script],
        capture_output=True,
        text=True,
        env=environment,
        cwd=tmp_path,
        check=False,
    )
    assert done.stderr == ""
    found = set(done.stdout.splitlines())
    expected = {f"refused {entry.file}" for entry in corpus.REFUSED if entry.file != "missing.stl"}
    expected |= {f"mesh {entry.file}" for entry in corpus.REPAIRED} | {"refused library.mtl"}
    assert found == expected


def test_no_other_file_is_opened(tmp_path, monkeypatch):
    """Whatever a file names: libraries, textures, buffers."""
    entries = [e for e in (*corpus.REFUSED, *corpus.REPAIRED) if e.file.endswith(("obj", "glb"))]
    paths = [corpus.write(tmp_path, entry) for entry in entries]
    opened = []

    def watch(event, arguments):
        if watching and event == "open":
            opened.append(str(arguments[0]))

    watching = True
    sys.addaudithook(watch)
    for path in paths:
        with contextlib.suppress(SurfaceError):
            read_mesh(path)
    watching = False
    ours = {str(path) for path in paths}
    assert ours <= set(opened)
    strange = [name for name in opened if name not in ours and not name.isdigit()]
    assert [name for name in strange if not name.endswith((".py", ".pyc", ".so"))] == []


GOOD = {
    "binary.stl": w.stl(corpus.V, corpus.F),
    "text.stl": w.text_stl(corpus.V, corpus.F),
    "cube.obj": w.obj(corpus.V, [(0, 1, 3, 2), *corpus.F[2:]], more="mtllib a\no b\n"),
    "text.ply": w.ply(corpus.V, corpus.F, ""),
    "binary.ply": w.ply(corpus.V, [(0, 1, 3, 2), *corpus.F[2:]], "<"),
    "uniform.ply": w.ply(corpus.V, corpus.F, ">"),
    "cube.off": w.off(corpus.V, corpus.F),
    "cube.glb": corpus.cube_scene(),
    "nodes.glb": corpus.nested_scene(),
}
GENTLE = b'0123456789 -.\n\0\xff/eaf{}[]",'


def mutated(data, rng):
    """A few bytes replaced, taken out, put in, repeated or cut off; digits more often than not."""
    data = bytearray(data)
    for _ in range(rng.integers(1, 5)):
        k = int(rng.integers(len(data) + 1))
        byte = GENTLE[rng.integers(len(GENTLE))] if rng.random() < 0.7 else int(rng.integers(256))
        kind = rng.integers(10)
        if kind < 6 and k < len(data):
            data[k] = byte
        elif kind == 6:
            del data[k : k + int(rng.integers(1, 9))]
        elif kind == 7:
            data.insert(k, byte)
        elif kind == 8:
            data[k:k] = data[k : k + int(rng.integers(1, 40))]
        else:
            del data[len(data) - int(rng.integers(len(data) // 4 + 1)) :]
        if not data:
            break
    return bytes(data)


@pytest.mark.parametrize("name", GOOD)
def test_damaged_files_are_refused_or_give_a_clean_mesh(name, tmp_path):
    """`make campaign NAME=larger_samples` has more."""
    assert_damaged_are_refused_or_clean(name, tmp_path, 150)


def assert_damaged_are_refused_or_clean(name, tmp_path, count):
    """Copies of a good file with some bytes changed, left out or there twice."""
    rng = np.random.default_rng(sum(name.encode()))
    path = tmp_path / name
    path.write_bytes(GOOD[name])
    w.assert_clean(read_mesh(path))
    outcomes = {True: 0, False: 0}
    tracemalloc.start()
    for _ in range(count):
        path.write_bytes(mutated(GOOD[name], rng))
        try:
            mesh = read_mesh(path, scale=float(rng.choice([1.0, 1e-3])))
        except SurfaceError as error:
            outcomes[False] += repr(name) in str(error)
        else:
            w.assert_clean(mesh)
            outcomes[True] += 1
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 32 << 20
    assert sum(outcomes.values()) == count
    assert min(outcomes.values()) > count // 50


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "obj", "ply", "off", "glb"])
def test_trimesh_writes_what_we_read(kind, tmp_path):
    """A second opinion on each format, on a surface with holes in it."""
    import trimesh

    other = trimesh.creation.icosphere(3, radius=0.4)
    other.update_faces(np.arange(len(other.faces)) % 50 != 0)
    other.remove_unreferenced_vertices()
    data = other.export(file_type=kind)
    path = tmp_path / f"part.{kind[:3]}"
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    mesh = read_mesh(path)
    w.assert_clean(mesh)
    ours = mesh.vertices[mesh.faces]
    assert len(ours) == len(other.faces)
    # Single precision where the format has no better, and the digits that trimesh writes.
    assert np.abs(ours - other.triangles).max() < 1e-7
    assert mesh.area == pytest.approx(other.area, rel=1e-6)


@pytest.mark.parametrize("order", ["", "<", ">"])
def test_trimesh_reads_the_ply_we_write(order, tmp_path):
    """Ours and trimesh's readers agree on rows with other columns, and on byte orders."""
    import trimesh

    path = tmp_path / "part.ply"
    path.write_bytes(w.ply(corpus.P, corpus.G, order))
    mesh = read_mesh(path)
    with path.open("rb") as stream:
        other = trimesh.load_mesh(stream, file_type="ply", process=False)
    assert np.array_equal(mesh.vertices[mesh.faces], other.vertices[other.faces])


def test_trimesh_places_the_nodes_as_we_do(tmp_path):
    import trimesh

    path = tmp_path / "nodes.glb"
    path.write_bytes(corpus.nested_scene())
    mesh = read_mesh(path)
    with path.open("rb") as stream:
        other = trimesh.load_scene(stream, file_type="glb").to_mesh()
    ours, theirs = (m.vertices[m.faces].mean(axis=1) for m in (mesh, other))
    assert len(ours) == len(theirs)
    for some, others in ((ours, theirs), (theirs, ours)):
        assert cKDTree(some).query(others)[0].max() < 1e-6
    # Mirrored or not, every cube faces outwards.
    assert not any("inwards" in note for note in notes_of(mesh))


def test_a_scale_that_is_given_is_believed(tmp_path):
    path = tmp_path / "part.stl"
    path.write_bytes(w.stl(corpus.V * 1500, corpus.F))
    assert read_mesh(path, scale=1.0).extent == pytest.approx([300.0] * 3)
    assert read_mesh(path, scale=0.001).extent == pytest.approx([0.3] * 3)
    assert read_mesh(path, scale=1e-6).extent == pytest.approx([3e-4] * 3)


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan"), float("inf"), True, "1", 1e-300])
def test_a_scale_that_is_none_is_refused(scale, tmp_path):
    path = tmp_path / "part.stl"
    path.write_bytes(w.stl(corpus.V, corpus.F))
    with pytest.raises(SurfaceError, match=r"'part.stl': scale must be a number in 1e-09 .. "):
        read_mesh(path, scale=scale)


def test_a_name_with_a_nul_byte():
    with pytest.raises(SurfaceError, match="cannot be opened"):
        read_mesh("part\0.stl")


def test_reading_twice_gives_the_same_bits(tmp_path):
    for entry in corpus.REPAIRED:
        path = corpus.write(tmp_path, entry)
        first, second = read_mesh(path), read_mesh(path)
        assert first.vertices.tobytes() == second.vertices.tobytes()
        assert first.faces.tobytes() == second.faces.tobytes()
        assert notes_of(first) == notes_of(second)
