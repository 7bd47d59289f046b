"""Each quantity that a verifier of proofs takes off is made absurdly large: nothing is proved."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from bounds import LARGE, grown
from capsule_arms import at, bodies_of, capsule_links, pair, planar_arm
from hard_scenes import PLATE, UR5, over
from proof_cases import elbow_case

from coverable import Collision, Obstacle, Task, ToolShape, plane, sphere
from feasibility.certification.collisions.every_pose import never_clear
from feasibility.certification.collisions.everywhere import Overlapping
from feasibility.certification.cut_proofs import linear_models
from feasibility.certification.cut_proofs.box_exclusion import contract, separated
from feasibility.certification.cut_proofs.linear_models import Boxes, models_of, target_parts
from feasibility.certification.cut_proofs.proof_verification import verify_on
from feasibility.collisions.asked_bodies import gather
from robots.kinematics import Kinematics
from robots.shapes.bodies import Solid
from robots.urdf.link_shapes import Sphere

DOME = sphere(0.3, (0, 25), (0, 360), side="outside", position=(0.5, 0, 0.1))


def test_a_cut_over_parts_of_the_surface():
    """What points and normals may be off by; normals move targets by the standoff."""
    robot, _, task, tree = elbow_case()
    cells = plane((0.99, 1.01), (-0.25, 0.25), "inside", (0, 0, 0.05)).cells(1, 5)
    task, parts = replace(task, standoff=0.05), cells.surface.parts(2.5e-4, 0.08)

    def accepted(parts=parts, task=task):
        return verify_on(robot, cells, task, tree, parts, most=3000).accepted

    assert accepted()
    assert not accepted(task=replace(task, tolerance=LARGE))
    for column in (0, 1):
        assert not accepted(replace(parts, radius=grown(parts.radius, column)))


@pytest.mark.parametrize("roll", [{}, {"roll_deg": (-20, 20), "roll_reference": (1, 0, 0)}])
def test_boxes_of_joints(roll):
    """Every term of the radii, and every radius of what separates and contracts boxes."""
    task, cells = Task(0.02, 20, **roll), DOME.cells(1, 1)
    parts = target_parts(DOME.parts(0.01, 0.05), cells, task)
    q = np.append(np.full(6, 0.3), [0.0, 0.0])
    fed = linear_models.Allowed(task.effective_tolerance, task.cone_chord, 0.2, task.roll)

    def model(parts=parts, allowed=fed, half=0.01):
        none = np.zeros(1, dtype=np.int64)
        boxes = Boxes(q[None] - half, q[None] + half, none, none)
        return models_of(Kinematics(UR5), boxes, parts, allowed)

    def proved(made):
        low, high = contract(made, np.ones((1, 1, made.residual.shape[1])))
        return separated(made, made.residual)[0], bool((low > high).any())

    least = model().radius[0]
    assert (least < 1.0).all()
    away = replace(model(), residual=np.full(model().residual.shape, 10.0))
    assert proved(away) == (True, True)
    for column in range(len(least)):
        assert proved(replace(away, radius=grown(away.radius, column))) == (False, False)
    for k, name in enumerate(("position", "axis")):
        assert model(allowed=fed._replace(**{name: LARGE})).radius[0, k] >= 0.2 * LARGE
        assert model(replace(parts, radius=grown(parts.radius, k))).radius[0, k] >= 0.2 * LARGE
        assert model(half=np.pi).radius[0, k] > 1.0 + least[k]


def test_a_tool_in_every_pose():
    """How far the tool point may be from its target."""
    point, down = np.array([0.5, 0, 0.3]), np.array([0, 0, -1.0])
    tool = ToolShape.box((0.02, 0.02, 0.1), position=(0, 0, -0.05))
    bodies = over(Obstacle.sphere("ball", 0.3, point), tool=tool).bodies
    for tolerance, confirmed in ((1e-3, True), (LARGE, False)):
        found = never_clear(UR5, bodies, 0.2, tolerance, point, down, most=300)
        assert found.confirmed == confirmed


@pytest.mark.parametrize(("wide", "confirmed"), [(0.08, True), (0.034, False)])
def test_the_corners_of_a_box_of_tilts_count(wide, confirmed):
    """A ball 300 mm from the tool point, among five; at a tilt between two of them it is clear."""
    point, up, cone = np.array([0.5, 0, 0.3]), np.array([0, 0, 1.0]), 0.2
    tilts = [(0.0, 0.0), *((u, v) for u in (-0.1, 0.1) for v in (-0.1, 0.1))]
    places = [point - 0.3 * pin.exp3(np.array([*tilt, 0.0])) @ up for tilt in tilts]
    scene = (Obstacle.sphere(f"ball{k}", wide if k else 0.01, at) for k, at in enumerate(places))
    bodies = over(*scene, tool=ToolShape.sphere(0.002, position=(0, 0, -0.3))).bodies
    assert never_clear(UR5, bodies, cone, 1e-6, point, up, most=20_000).confirmed == confirmed


def test_a_tool_in_a_sheet():
    """How far the sheet may be from the surface."""
    targets = Task(0.02, 10).targets(PLATE.cells(1, 1))
    asked = Collision(self_=False, clearance=0.0, tool=(ToolShape.sphere(0.05),))
    bodies = gather(UR5, PLATE, asked, 0.02)

    def confirmed(bodies):
        at = targets.points[0], targets.approaches[0]
        return never_clear(UR5, bodies, 0.1, 1e-3, *at, most=300).confirmed

    assert confirmed(bodies)
    soups = tuple(replace(soup, deviation=LARGE) for soup in bodies.soups)
    assert not confirmed(replace(bodies, soups=soups))


@pytest.mark.parametrize("seen_from", ["base", "tool"])
def test_boxes_in_which_bodies_overlap(seen_from):
    """How far each joint moves a point, seen from the base or the tool; how far the tool may be."""
    robot, q = planar_arm((0.5, 0.4, 0.3)), np.array([0.2, 0.3, 0.2])
    point, _ = Kinematics(robot).tool(q)
    ball = Solid("tool", 3, at(0.3 if seen_from == "base" else 0.15), Sphere(0.05))
    scene = [Obstacle("ball", Sphere(0.2), at(*point))]
    bodies = bodies_of([*capsule_links((0.5, 0.4, 0.3), 0.03), ball], scene, [pair("tool", "ball")])
    target = point + (LARGE if seen_from == "base" else 0.0)

    def overlap(half, off=1e-3):
        box = (q - half)[None], (q + half)[None], target[None], np.array([off])
        return Overlapping(robot, bodies).deepest(*box).ratio[0] < 1.0

    half = np.full(3, 0.01 if seen_from == "base" else 0.1)
    assert overlap(half)
    for j in range(3):
        assert not overlap(np.where(np.arange(3) == j, LARGE, half))
    assert overlap(half, off=LARGE) == (seen_from == "base")
