"""Odd objects of a scene: what is taken can be used by all libraries, the rest is refused."""

import math

import numpy as np
import pytest
from capsule_arms import box_mesh
from samples import sampled, seeds

from coverable import Obstacle, ToolShape, load_robot
from feasibility.certification.collisions.collision_replay import collision_replay
from feasibility.collisions.problem_bodies import Bodies, Pair, at_rest, scene_solids, tool_solids
from robots.shapes.bodies import Solid, Triangles
from robots.shapes.links import outer_bodies
from robots.urdf.link_shapes import Sphere

UR5, SMALL, LARGE = load_robot("ur5"), 1e-6, 1e4
SHAPES = [
    ("box", ([SMALL, LARGE, 0.1],)), ("sphere", (LARGE,)), ("cylinder", (LARGE, SMALL)),
    ("cylinder", (SMALL, LARGE)), ("capsule", (SMALL, SMALL)),
    ("halfspace", ((LARGE, -LARGE, LARGE), (1e6, 0, 180))),
]  # fmt: skip


def use(obstacle, tool=()):
    """Everything that libraries make of it, and the judge with a ball beside it: all is finite."""
    (thing,) = scene_solids([obstacle], UR5)
    seen = at_rest(thing, 2.0)
    for found in [b.vertices for b in seen] if isinstance(seen, list) else [seen.triangles]:
        assert len(found)
        assert np.isfinite(found).all()
    for body in (body for solid in tool_solids(tool, UR5) for body in outer_bodies(solid)):
        assert 1 <= len(body.vertices) <= 64
        assert np.isfinite(body.vertices).all()
    solids = (*tool_solids(tool, UR5), Solid("ball", UR5.n, np.eye(4), Sphere(0.05)))
    pairs = tuple(Pair(owner, "thing", 0.01) for owner in {solid.owner for solid in solids})
    asked = Bodies(solids, (), (), (thing,), pairs)
    found = collision_replay(UR5, asked, np.array([np.zeros(6), np.full(6, 0.2)]))
    assert math.isfinite(found.min_clearance)


@pytest.mark.parametrize(("kind", "sizes"), SHAPES)
def test_shapes_at_the_edge_of_what_is_taken_can_be_used(kind, sizes):
    tool = () if kind == "halfspace" else (getattr(ToolShape, kind)(*sizes),)
    use(getattr(Obstacle, kind)("thing", *sizes), tool)


@sampled("seed", seeds(6, all=400))
def test_sheets_and_tangles_can_be_used(seed):
    """Open, inverted, doubled, thin, flat, or any triangles of a few points at any scale."""
    rng, cube = np.random.default_rng(seed), box_mesh((1.0, 1.0, 1.0))
    vertices, faces = cube.vertices, cube.faces
    match seed % 6:
        case 0:
            faces = faces[: rng.integers(1, 12)]
        case 1:
            some = rng.random(12) < 0.5
            faces = np.where(some[:, None], faces[:, ::-1], faces)
        case 2:
            faces = np.concatenate([faces, faces[:3]])
        case 3:
            vertices = rng.normal(size=(8, 3))
            faces = np.array([rng.permutation(8)[:3] for _ in range(30)])
        case 4:
            vertices = vertices * [1.0, 1.0, rng.choice([1e-5, 0.0])]
        case 5:
            vertices = vertices * [1.0, 1e-4, 1e-4]
    made = Triangles(vertices * rng.choice([1e-3, 1.0, 1e3]), faces, bool(rng.random() < 0.5))
    use(Obstacle("thing", made, np.eye(4)), (ToolShape(made, np.eye(4)),))
