"""Who is asked to stay clear of whom, and who is left out for which reason."""

from __future__ import annotations

import pytest

from coverable_errors import ArgumentError
from feasibility.collisions import Bodies, Collision, Obstacle, ToolShape, gather
from robots import load_robot
from surfaces import plane

PLATE = plane((0.4, 0.6), (-0.1, 0.1), position=(0.0, 0.0, 0.3), side="outside")
SHELF = Obstacle.box("shelf", (0.4, 0.4, 0.02), (0.5, 0.0, 0.8), clearance=0.02)
POST = Obstacle.cylinder("post", 0.05, 1.0, (0.0, 0.6, 0.5))


def bodies_of(robot: str = "ur5", standoff: float = 0.02, **asked: object) -> Bodies:
    """The bodies of an arm over the plate."""
    found = gather(load_robot(robot), PLATE, Collision(**asked), standoff)  # type: ignore[arg-type]
    assert found is not None
    return found


def clearances(bodies: Bodies) -> dict[frozenset[str], float]:
    """What is asked for, by pair."""
    asked = {frozenset((pair.first, pair.second)): pair.clearance for pair in bodies.pairs}
    assert len(asked) == len(bodies.pairs), "a pair is asked for twice"
    return asked


def test_nothing_is_gathered_where_nothing_is_asked() -> None:
    robot = load_robot("ur5")
    assert gather(robot, PLATE, None, 0.02) is None
    assert gather(robot, PLATE, Collision(self_=False, surface=False), 0.02) is None


def test_every_pair_is_asked_for_or_left_out_with_a_reason() -> None:
    bodies = bodies_of(scene=(SHELF, POST))
    owners = sorted({solid.owner for solid in bodies.solids})
    own = {frozenset((a, b)) for a in owners for b in owners if a < b}
    others = {frozenset((a, b)) for a in owners for b in ("shelf", "post", "surface")}
    left = {frozenset((one.first, one.second)) for one in bodies.left_out}
    asked = set(clearances(bodies))
    assert asked | left == own | others
    assert not asked & left


def test_what_stands_still_is_not_asked_for_with_the_scene() -> None:
    """The base stands on its table: no motion changes that."""
    bodies = bodies_of(scene=(SHELF,))
    still = {solid.owner for solid in bodies.solids if solid.joint == 0}
    assert still
    for owner in still:
        whys = {one.second: one.why for one in bodies.left_out if one.first == owner}
        assert whys["shelf"] == whys["surface"] == "rigid"


def test_each_pair_has_its_own_clearance() -> None:
    bodies = bodies_of(
        scene=(SHELF, POST),
        clearance=0.005,
        tool_clearance=0.001,
        clearances=(("forearm_link", "post", 0.03), ("forearm_link", "upper_arm_link", 0.0)),
    )
    asked = clearances(bodies)
    assert asked[frozenset(("forearm_link", "post"))] == 0.03
    assert asked[frozenset(("wrist_1_link", "post"))] == 0.005
    assert asked[frozenset(("forearm_link", "shelf"))] == 0.02  # the object's own
    assert asked[frozenset(("wrist_1_link", "surface"))] == 0.005
    tool = {solid.owner for solid in bodies.solids if solid.joint == 6}
    assert {asked[frozenset((owner, "surface"))] for owner in tool} == {0.001}


def test_named_links_are_the_tool() -> None:
    asked = clearances(bodies_of(clearance=0.005, tool_links=("wrist_2_link",)))
    assert asked[frozenset(("wrist_2_link", "surface"))] == 0.0
    assert asked[frozenset(("wrist_3_link", "surface"))] == 0.005


def test_a_tool_of_the_case_is_asked_for() -> None:
    nozzle = ToolShape.cylinder(0.02, 0.1, (0.0, 0.0, -0.06))
    bodies = bodies_of(clearance=0.005, tool=(nozzle,), scene=(POST,))
    asked = clearances(bodies)
    assert asked[frozenset(("tool", "surface"))] == 0.0
    assert asked[frozenset(("tool", "post"))] == 0.005
    assert asked[frozenset(("tool", "forearm_link"))] == 0.005
    # What is mounted on the flange moves with it.
    whys = {one.second: one.why for one in bodies.left_out if one.first == "wrist_3_link"}
    whys |= {one.first: one.why for one in bodies.left_out if one.second == "wrist_3_link"}
    assert whys["tool"] == "rigid"


def test_a_tool_that_touches_is_left_out() -> None:
    bodies = bodies_of(standoff=0.0)
    contact = {one.first for one in bodies.left_out if one.why == "contact"}
    assert contact == {solid.owner for solid in bodies.solids if solid.joint == 6}
    assert frozenset(("forearm_link", "surface")) in clearances(bodies)


def test_what_is_allowed_is_left_out() -> None:
    allow = (
        ("surface", "forearm_link"),
        ("forearm_link", "shoulder_link"),
        ("post", "wrist_1_link"),
    )
    bodies = bodies_of(scene=(POST,), allow=allow)
    allowed = {frozenset((o.first, o.second)) for o in bodies.left_out if o.why == "allowed"}
    assert allowed == {frozenset(pair) for pair in allow}


def test_all_names_that_are_nothing_are_refused_at_once() -> None:
    with pytest.raises(ArgumentError) as caught:
        bodies_of(
            allow=(("link9", "surface"),),
            clearances=(("forearm_link", "shelve", 0.1),),
            tool_links=("hand",),
            scene=(SHELF,),
        )
    text = str(caught.value)
    assert all(name in text for name in ("link9", "shelve", "hand"))
    assert "collision.allow[0]" in text


def test_shapes_that_reach_past_the_standoff_are_named() -> None:
    """panda's fingers reach 9.5 mm beyond its tool point."""
    near = [note for note in bodies_of("panda", 0.005).notes if "9.5 mm beyond" in note]
    assert {note.split()[2] for note in near} == {"panda_leftfinger", "panda_rightfinger"}
    assert not [note for note in bodies_of("panda", 0.01).notes if "beyond" in note]


def test_the_surface_may_be_thick() -> None:
    thin, thick = (bodies_of(thickness=t).soups[0] for t in (0.0, 0.01))
    assert thin.triangles[..., 2].min() == pytest.approx(0.3)
    assert thick.triangles[..., 2].min() == pytest.approx(0.29)  # away from the side worked on
