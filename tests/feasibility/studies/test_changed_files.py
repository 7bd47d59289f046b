"""A stored verdict is for the files as they were, and for those that these name in turn."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

import pytest

from feasibility.cases import Case
from feasibility.placement import Pose
from feasibility.placement.study_tasks import StudyEvaluator
from feasibility.studies import Store, StudyTask, open_workers, run_tasks
from feasibility.version import version

XACRO = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
BEAM = "elsewhere/beam.obj"
LINKS = """
  <link name="l0"/>
  <link name="l1"><collision><geometry><mesh filename="beam.obj"/></geometry></collision></link>
  <link name="l2"/>
  <link name="l3"/>
"""
TRAVEL = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
SLIDES = "".join(
    f'<joint name="j{k}" type="prismatic"><parent link="l{k - 1}"/><child link="l{k}"/>'
    f'<axis xyz="{axis}"/>{TRAVEL}</joint>'
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
    collision = { self = false, surface = false, scene = [
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
    return tmp_path


def tables(folder: Path, kind: str, more: str = "") -> dict[str, object]:
    """A case with the gantry."""
    return Case.from_toml(CASE.format(kind) + more, folder).to_tables()


def verdict(folder: Path, case: dict[str, object]) -> tuple[str, bool]:
    """What a study says about a case, and whether that was computed."""
    computed: list[int] = []
    with Store(folder / "a.study") as store, open_workers(0) as workers:
        task = StudyTask(case, {})
        (row,) = run_tasks([task], workers, store, lambda done, total, text: computed.append(done))
    assert row.status == "done", row.result
    return str(row.result["verdict"]), bool(computed)


def test_a_mesh_of_a_urdf_that_changes_is_another_case(folder: Path) -> None:
    case = tables(folder, "urdf", COLLISION)
    assert verdict(folder, case) == ("feasible", True)
    assert verdict(folder, case) == ("feasible", False)
    beam(folder / BEAM, 5.0)
    assert verdict(folder, case) == ("infeasible", True)
    assert verdict(folder, case) == ("infeasible", False)
    beam(folder / BEAM, 0.1)
    assert verdict(folder, case) == ("feasible", False)  # as it was


def test_without_collisions_a_mesh_does_not_matter(folder: Path) -> None:
    case = tables(folder, "urdf")
    assert verdict(folder, case) == ("feasible", True)
    beam(folder / BEAM, 5.0)
    assert verdict(folder, case) == ("feasible", False)


def test_a_mesh_that_appears_is_another_case(folder: Path) -> None:
    case = tables(folder, "urdf", COLLISION)
    (folder / BEAM).rename(folder / "kept")
    without = StudyTask(case, {}).key
    (folder / "kept").rename(folder / BEAM)
    assert StudyTask(case, {}).key != without


def test_what_a_xacro_file_includes_changes_its_case(folder: Path) -> None:
    case = tables(folder, "xacro")
    assert verdict(folder, case) == ("feasible", True)
    assert verdict(folder, case) == ("feasible", False)
    shorter = (folder / "slides.xacro").read_text().replace('upper="1"', 'upper="0.12"')
    (folder / "slides.xacro").write_text(shorter)
    assert verdict(folder, case) == ("infeasible", True)
    assert verdict(folder, case) == ("infeasible", False)


def test_meshes_of_a_xacro_file_and_includes_of_an_srdf_count_too(folder: Path) -> None:
    inside = '<xacro:include filename="pairs.xacro"/>'
    (folder / "g.srdf.xacro").write_text(f'<robot name="g" {XACRO}>{inside}</robot>')
    (folder / "pairs.xacro").write_text(f"<robot {XACRO}/>")
    case = tables(folder, "xacro", COLLISION.replace("self", 'srdf = "g.srdf.xacro", self'))
    keys = [StudyTask(case, {}).key]
    beam(folder / BEAM, 5.0)
    keys.append(StudyTask(case, {}).key)
    (folder / "pairs.xacro").write_text(
        f'<robot {XACRO}><disable_collisions link1="l1" link2="l2" reason="User"/></robot>'
    )
    keys.append(StudyTask(case, {}).key)
    assert len(set(keys)) == 3
    assert StudyTask(case, {}).key == keys[-1]


def test_a_placement_is_tried_with_the_files_of_now(folder: Path) -> None:
    case = Case.from_toml(CASE.format("urdf") + COLLISION, folder)
    answers = []
    with Store(folder / "a.study") as store, open_workers(0) as workers:
        for length in (0.1, 5.0, 0.1):
            beam(folder / BEAM, length)
            evaluator = StudyEvaluator(case, workers, store)
            (trial,) = evaluator.check_all([Pose((0.0, 0.0, 0.1), (0.0, 0.0, 0.0))], causes=False)
            answers.append(str(trial.answer))
        assert len(store) == 2
    assert answers == ["feasible", "infeasible", "feasible"]


def test_files_that_no_others_hang_on_leave_the_key_as_it_always_was(folder: Path) -> None:
    """So stores go on being used: only what the case itself names is in it."""
    case = tables(folder, "urdf")
    identity = {
        "work": "feasibility.evaluate",
        "version": version(),
        "tables": case,
        "files": [hashlib.sha256((folder / "gantry.urdf").read_bytes()).hexdigest()],
    }
    text = json.dumps(identity, sort_keys=True, separators=(",", ":"))
    assert StudyTask(case, {}).key == hashlib.sha256(text.encode()).hexdigest()


@pytest.mark.parametrize("kind", ["urdf", "xacro"])
@pytest.mark.parametrize(
    "fault", ["gone", "pipe", "folder", "broken", "mesh is a pipe", "mesh is huge"]
)
def test_what_cannot_be_read_is_left_to_the_task(folder: Path, kind: str, fault: str) -> None:
    case = tables(folder, kind, COLLISION)
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
        (row,) = run_tasks([StudyTask(case, {})], workers)
    assert row.status == "failed"
    assert file.name in row.result["message"]
