"""Cases of a study: read once and placed, they are those read by themselves, with files of now."""

import os
from pathlib import Path

import numpy as np
import pytest
from bad_input import sheet
from mesh_patches import bent
from mesh_writers import off, stl_of

from coverable import Case, Pose, Store, open_workers, run_tasks
from feasibility.placement.trials import evaluator_of_study
from feasibility.studies.built_cases import cut_of
from feasibility.studies.run import StudyTask

XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
BEAM = "elsewhere/beam.obj"
LINKS = """
  <link name="l0"/>
  <link name="l1"><collision><geometry><mesh filename="beam.obj"/></geometry></collision></link>
  <link name="l2"/>
  <link name="l3"/>
"""
SLIDES = "".join(
    f'<joint name="j{k}" type="prismatic"><parent link="l{k - 1}"/><child link="l{k}"/>'
    f'<axis xyz="{axis}"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    for k, axis in ((1, "1 0 0"), (2, "0 1 0"), (3, "0 0 1"))
)
CASE = """
    robot.urdf = "gantry.{}"
    robot.approach_axis = [0, 0, -1]
    robot.package_dirs = ["elsewhere"]
    surface = {{ kind = "plane", u = [0, 0.2], v = [0, 0.2], cells = [2, 2], side = "outside" }}
    task = {{ standoff = 0.1, cone_deg = 10 }}
"""
COLLISION = """
    collision = { self = false, surface = false, srdf = "g.srdf.xacro", scene = [
        { kind = "box", name = "post", size = [8, 2, 2], position = [0, -3, 0] } ] }
"""


def beam(path: Path, length: float) -> None:
    """A mesh that reaches that far along -y, m."""
    corners = f"v 0 0 0\nv 0.1 0 0\nv 0 {-length} 0\nv 0 0 0.1\n"
    path.write_text(corners + "f 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A gantry, as URDF and as xacro, whose beam does not reach the post."""
    (tmp_path / "elsewhere").mkdir()
    beam(tmp_path / BEAM, 0.1)
    (tmp_path / "gantry.urdf").write_text(f'<robot name="g">{LINKS}{SLIDES}</robot>')
    include = '<xacro:include filename="slides.xacro"/>'
    (tmp_path / "gantry.xacro").write_text(f'<robot name="g" {XACRO}>{LINKS}{include}</robot>')
    (tmp_path / "slides.xacro").write_text(f"<robot {XACRO}>{SLIDES}</robot>")
    inside = '<xacro:include filename="pairs.xacro"/>'
    (tmp_path / "g.srdf.xacro").write_text(f'<robot name="g" {XACRO}>{inside}</robot>')
    (tmp_path / "pairs.xacro").write_text(f"<robot {XACRO}/>")
    return tmp_path


def verdict(folder: Path, case: Case) -> tuple[str, bool]:
    """What a study says about a case, and whether that was computed."""
    computed: list[int] = []
    with Store(folder / "a.study") as store, open_workers(0) as workers:
        task = StudyTask(case.to_tables(), {})
        (row,) = run_tasks([task], workers, store, lambda done, total, text: computed.append(done))
    assert row.status == "done", row.result
    return str(row.result["verdict"]), bool(computed)


def test_a_stored_verdict_is_for_the_files_as_they_were(folder: Path) -> None:
    """A mesh that a URDF names, in a study and for `place`."""
    case = Case.from_toml(CASE.format("urdf") + COLLISION, folder)
    for length, answer, anew in ((0.1, "feasible", True), (0.1, "feasible", False),
                                 (5.0, "infeasible", True), (5.0, "infeasible", False),
                                 (0.1, "feasible", False)):  # fmt: skip
        beam(folder / BEAM, length)
        assert verdict(folder, case) == (answer, anew)
        with Store(folder / "place.study") as store, open_workers(0) as workers:
            evaluator = evaluator_of_study(case, 4, workers, store)
            (trial,) = evaluator([Pose((0.0, 0.0, 0.1), (0.0, 0.0, 0.0))], True)
            assert str(trial.answer) == answer
    # Without collisions the mesh does not matter.
    plain = Case.from_toml(CASE.format("urdf"), folder)
    assert verdict(folder, plain) == ("feasible", True)
    beam(folder / BEAM, 5.0)
    assert verdict(folder, plain) == ("feasible", False)


def test_all_files_of_a_case_and_what_they_include_are_part_of_its_key(folder: Path) -> None:
    """Surface, scene and tool as meshes; arm and SRDF as xacro files that include others."""
    meshes = ["surface.stl", "scene.stl", "tool.stl"]
    for name in meshes:
        (folder / name).write_bytes(stl_of(sheet()))
    surface, scene, tool = (f'"{folder / name}"' for name in meshes)
    more = ["surface.u=", "surface.v=", "surface.kind=mesh", f"surface.file={surface}"]
    more += ["surface.scale=1", "surface.cells=2"]
    more += [f'collision.scene=[{{ name = "a", kind = "mesh", file = {scene}, scale = 1 }}]']
    more += [f'collision.tool=[{{ kind = "mesh", file = {tool}, scale = 1 }}]']
    case = Case.from_toml(CASE.format("xacro") + COLLISION, folder, overrides=more)
    keys = [StudyTask(case.to_tables(), {}).key]
    none = '<disable_collisions link1="l1" link2="l2" reason="User"/>'
    for file, text in (
        (folder / "slides.xacro", f"<robot {XACRO}>{SLIDES.replace('1 0 0', '1 1 0')}</robot>"),
        (folder / "pairs.xacro", f"<robot {XACRO}>{none}</robot>"),
        (folder / BEAM, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
    ):
        file.write_text(text)
        keys.append(StudyTask(case.to_tables(), {}).key)
        assert StudyTask(case.to_tables(), {}).key == keys[-1]
    for name in meshes:
        (folder / name).write_bytes(stl_of(sheet(0.3)))
        keys.append(StudyTask(case.to_tables(), {}).key)
    (folder / BEAM).unlink()
    keys.append(StudyTask(case.to_tables(), {}).key)
    assert len(set(keys)) == 8


@pytest.mark.parametrize("kind", ["urdf", "xacro"])
@pytest.mark.parametrize("fault", ["gone", "pipe", "folder", "broken", "mesh pipe", "mesh huge"])
def test_what_cannot_be_read_is_left_to_the_task(folder: Path, kind: str, fault: str) -> None:
    case = Case.from_toml(CASE.format(kind) + COLLISION, folder)
    file = folder / (BEAM if fault.startswith("mesh") else f"gantry.{kind}")
    text = file.read_text()
    file.unlink()
    if fault.endswith("pipe"):
        os.mkfifo(file)
    elif fault == "folder":
        file.mkdir()
    elif fault.endswith("huge"):
        file.touch()
        os.truncate(file, 1 << 38)
    elif fault == "broken":
        file.write_text(text[:50])
    with open_workers(0) as workers:
        (row,) = run_tasks([StudyTask(case.to_tables(), {})], workers)
    assert row.status == "failed"
    assert file.name in row.result["message"]


def test_a_mesh_cut_once_and_placed_is_the_mesh_cut_in_place(tmp_path) -> None:
    """To the last bit: so a study says what `check` says."""
    saddle = bent(lambda u, v: (0.2 * u, 0.2 * v, 4e-3 * u * v), 2, 2)
    (tmp_path / "a.off").write_bytes(off(*saddle))
    rng = np.random.default_rng(2)
    for k, cells in enumerate((5, 5, '"auto"')):
        position, rpy = rng.normal(size=3).tolist(), rng.uniform(-180, 180, size=3).tolist()
        text = f"""
            robot.name = "ur5"
            surface = {{ kind = "mesh", file = "a.off", scale = 1.0, side = "outside",
                cells = {cells}, position = {position}, rpy_deg = {rpy} }}
            task = {{ standoff = 0.01, cone_deg = 30, footprint = [0.2, 0.15] }}
        """.replace("\n                cells", " cells")
        case = Case.from_toml(text, tmp_path)
        placed, fresh = cut_of(case), case.surface.cut(case.task.disc)
        for owner in (lambda c: c, lambda c: c.surface, lambda c: c.curves):
            for name in ("centres", "normals", "areas", "pairs", "rotation", "position", "first",
                         "cubics", "derivative_bounds", "deviations"):  # fmt: skip
                if hasattr(owner(fresh), name):
                    ours, theirs = getattr(owner(placed), name), getattr(owner(fresh), name)
                    assert np.array_equal(ours, theirs), (k, name)
