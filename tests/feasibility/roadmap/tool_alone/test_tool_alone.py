"""Cells over which the tool collides in every pose: proved, confirmed, refuted by no pose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from tool_scenes import CELLS, UR5, Over, bracket, planted_over, random_over

from feasibility import Answer, CauseKind, Evidence, Task, check
from feasibility.certification import verify_proof
from feasibility.collisions import Collision, Obstacle, ToolShape
from feasibility.cut_tree import CutTree, Leaf
from feasibility.reports.verdict import as_json
from feasibility.roadmap.tool_alone import pose_boxes
from robots.shapes import checked_triangles
from surfaces import cylinder

NOZZLE = ToolShape.cylinder(0.01, 0.1, position=(0.0, 0.0, -0.05))
CRATE = Obstacle.box("crate", (0.4, 0.4, 0.4), position=(0.5, 0.0, 0.3))
SCENES, POSES = range(20, 42), 30
TARGET = (0.5, 0.0, 0.32)


def over(
    *scene: Obstacle, cone_deg: float = 30.0, tool: ToolShape = NOZZLE, **asked: float
) -> Over:
    """The tool alone, without the links, among objects."""
    allow = tuple((name, one.name) for name in UR5.link_names for one in scene)
    collision = Collision(False, False, scene=scene, tool=(tool,), allow=allow, **asked)  # type: ignore[arg-type]
    return Over.cell(UR5, CELLS, Task(0.02, cone_deg, 0.001, collision=collision))


@pytest.mark.parametrize("seed", SCENES)
def test_what_is_claimed_is_confirmed_and_no_pose_is_clear(seed: int) -> None:
    scene = random_over(seed)
    claimed, clear = scene.claimed(), scene.clear_pose(POSES, np.random.default_rng(seed))
    assert claimed is None or not clear
    if claimed is not None or clear:
        assert scene.confirmed().confirmed == (claimed is not None)


def test_random_scenes_hold_both_answers() -> None:
    claims = [random_over(seed).claimed() is not None for seed in SCENES]
    assert 4 <= sum(claims) <= len(SCENES) - 4


@pytest.mark.parametrize("name", ["ur5", "puma560"])
def test_a_cell_with_a_known_pose_is_never_proved(name: str) -> None:
    scenes = [planted_over(name, seed) for seed in range(20)]
    known = [one for one in scenes if one is not None]
    assert len(known) >= 3
    for one in known:
        assert one.claimed() is None
        assert not one.confirmed().confirmed


@pytest.mark.parametrize("gap", [-0.002, 0.002])
@pytest.mark.parametrize("clearance", [0.0, 0.01])
def test_a_ball_beside_a_wall_is_proved_up_to_the_tolerance(gap: float, clearance: float) -> None:
    """The ball's middle is the tool point: its distance is the same in every pose."""
    radius = 0.05
    at = 0.5 + radius + clearance + gap
    wall = Obstacle.halfspace("wall", position=(at, 0.0, 0.0), rpy_deg=(0.0, -90.0, 0.0))
    scene = over(wall, cone_deg=180.0, tool=ToolShape.sphere(radius), clearance=clearance)
    claimed = scene.claimed()
    assert (claimed is not None) == (gap < -0.001)
    assert scene.confirmed().confirmed == (gap < -0.001)
    if claimed is not None:
        assert claimed.pairs == (("tool", "wall"),)
        assert claimed.distance == pytest.approx(clearance + gap)


@pytest.mark.parametrize("depth", [0.003, 0.0009])
def test_a_nozzle_beside_a_wall_cannot_lean_away_at_its_tip(depth: float) -> None:
    """The rim of the tip, 10 mm wide, overlaps the wall by `depth`, less 0.15 mm at 10 degrees.

    So it is free where the tolerance of 1 mm makes up for that, and only there.
    """
    wall = Obstacle.halfspace("wall", position=(0.51 - depth, 0, 0), rpy_deg=(0.0, -90.0, 0.0))
    scene = over(wall, cone_deg=10.0)
    assert (scene.claimed() is not None) == (depth > 0.00115)
    assert scene.confirmed().confirmed == (depth > 0.00115)


def test_meshes_are_solids_with_dents_or_sheets() -> None:
    ell = bracket()
    solid = Obstacle("part", ell, _at(TARGET, (-0.025, -0.1, -0.05)))
    hollow = Obstacle("part", ell, _at(TARGET, (-0.125, -0.125, -0.05)))
    block = trimesh.creation.box((0.1, 0.1, 0.1))
    convex = Obstacle("part", checked_triangles(block.vertices, block.faces), _at(TARGET))
    for obstacle, swallows in ((solid, True), (hollow, False), (convex, True)):
        scene = over(obstacle, cone_deg=5.0)
        assert (scene.claimed() is not None) == swallows
        assert scene.clear_pose(100, np.random.default_rng(1)) != swallows
    assert over(convex, cone_deg=5.0).confirmed().confirmed


def _at(place: tuple[float, float, float], off: tuple[float, ...] = (0, 0, 0)) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = np.add(place, off)
    return matrix


def test_a_tool_wider_than_a_pipe_is_cut_by_it() -> None:
    """A disc of 120 mm in a pipe of 100 mm: the surface itself is in the way."""
    pipe = cylinder(0.05, (-170, 170), (-0.2, 0.2), "inside", (0.5, 0.0, 0.3))
    cells = pipe.cells(1, 1)
    for radius, blocked in ((0.06, True), (0.02, False)):
        disc = ToolShape.cylinder(radius, 0.03, position=(0.0, 0.0, -0.03))
        asked = Collision(False, tool=(disc,), allow=tuple((n, "surface") for n in UR5.link_names))
        scene = Over.cell(UR5, cells, Task(0.01, 2.0, 0.001, collision=asked))
        assert (scene.claimed() is not None) == blocked
        assert scene.confirmed().confirmed == blocked
        assert scene.clear_pose(100, np.random.default_rng(2)) != blocked


def test_what_is_left_out_proves_nothing() -> None:
    scene = over(CRATE)
    assert scene.claimed() is not None
    asked = scene.task.collision
    assert asked is not None
    without = replace(asked, allow=(*asked.allow, ("tool", "crate")))
    other = replace(scene, task=replace(scene.task, collision=without))
    assert other.claimed() is None
    assert other.confirmed() == (False, 0)


def test_no_more_boxes_than_are_granted(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = over(CRATE)
    monkeypatch.setattr(pose_boxes, "MOST_BOXES", 0)
    assert scene.claimed() is None


def test_a_crate_that_swallows_the_target_is_a_proof() -> None:
    asked = Collision(self_=False, surface=False, scene=(CRATE,), tool=(NOZZLE,))
    task = Task(0.02, 30, 0.001, collision=asked)
    verdict = check(UR5, CELLS, task)
    assert (verdict.answer, verdict.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)
    assert verdict.proof is not None
    assert verdict.proof.kind == "cell"
    assert "the tool collides there in every pose" in verdict.message
    (cause,) = verdict.causes
    assert (cause.kind, cause.proved) == (CauseKind.COLLISION, True)
    assert cause.pair is not None
    assert "crate" in cause.pair
    assert cause.clearance is not None
    assert cause.clearance < -0.05
    assert as_json(verdict)["uncovered"][0]["proved"] is True
    assert verify_proof(UR5, CELLS, task, verdict.proof).accepted
    # The same leaf is refused where the crate is not there, or far enough.
    for scene in ((), (replace(CRATE, placement=_at((0.5, 0.0, 1.5))),)):
        freed = replace(task, collision=replace(asked, scene=scene))
        assert not verify_proof(UR5, CELLS, freed, CutTree(Leaf(0))).accepted
