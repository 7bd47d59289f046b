"""The <collision> elements of a URDF: read like visuals, and none lost without a word."""

import re

import numpy as np
import pytest

from robots.urdf import Box, Capsule, Cylinder, MeshFile, Sphere, check_urdf

ARM = '<robot name="arm"><link name="base">{}</link><link name="second">{}</link>{}</robot>'
JOINT = (
    '<joint name="j" type="continuous"><parent link="base"/><child link="second"/>'
    '<axis xyz="0 0 1"/></joint>'
)
BALL = '<{0}><geometry><sphere radius="0.1"/></geometry></{0}>'


def checked(folder, base, second=""):
    path = folder / "arm.urdf"
    path.write_text(ARM.format(base, second, JOINT))
    return check_urdf(path)


@pytest.mark.parametrize(
    ("shape", "geometry"),
    [
        ('<box size="1 2 3"/>', Box((1.0, 2.0, 3.0))),
        ('<sphere radius="0.5"/>', Sphere(0.5)),
        ('<cylinder radius="0.5" length="2"/>', Cylinder(0.5, 2.0)),
        ('<capsule radius="0.5" length="2"/>', Capsule(0.5, 2.0)),
        (
            '<mesh filename="part.stl" scale="1 1 2"/>',
            MeshFile("{folder}/part.stl", (1.0, 1.0, 2.0)),
        ),
    ],
)
def test_shapes_are_read_as_those_of_visuals_are(tmp_path, shape, geometry):
    (tmp_path / "part.stl").write_bytes(b"solid")
    inside = f'<origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/><geometry>{shape}</geometry>'
    found = checked(tmp_path, f"<collision>{inside}</collision><visual>{inside}</visual>")
    (body,), (drawn,) = found.collisions.shapes, found.visuals
    if isinstance(geometry, MeshFile):
        geometry = MeshFile(str((tmp_path / "part.stl").resolve()), geometry.scale)
    assert body.geometry == drawn.geometry == geometry
    assert (body.link, drawn.link) == ("base", "base")
    np.testing.assert_array_equal(body.origin, drawn.origin)
    np.testing.assert_allclose(body.origin @ [1, 0, 0, 1], [1, 3, 3, 1], atol=1e-15)
    assert found.collisions.faults == ()


@pytest.mark.parametrize(
    ("inside", "words"),
    [
        ("", "must hold one <geometry> with one shape"),
        ("<geometry/>", "must hold one <geometry> with one shape"),
        ('<geometry><sphere radius="1"/><sphere radius="1"/></geometry>', "with one shape"),
        ('<geometry><sphere radius="-1"/></geometry>', "radius must be above zero"),
        ('<geometry><sphere radius="nan"/></geometry>', "must be 1 finite number"),
        ('<geometry><box size="1 2"/></geometry>', "must be 3 finite numbers"),
        ("<geometry><box/></geometry>", "a <box> has no size"),
        ('<geometry><torus radius="1"/></geometry>', "is no shape of URDF"),
        ('<geometry><mesh filename="lost.stl"/></geometry>', "is not found"),
        ('<geometry><mesh filename="../../etc/a.stl"/></geometry>', "lies outside the folders"),
        ('<geometry><mesh filename="package://../a.stl"/></geometry>', "lies outside|not found"),
        ('<geometry><mesh filename="part.step"/></geometry>', "is not one of .stl"),
        ('<geometry><mesh filename="http://x/a.stl"/></geometry>', "is not a file"),
        ('<geometry><mesh filename="a.stl" scale="0 1 1"/></geometry>', "has scale 0"),
        ('<origin xyz="a"/><geometry><sphere radius="1"/></geometry>', "must be 3 finite numbers"),
    ],
)
def test_a_shape_that_cannot_be_used_is_listed_with_its_link(tmp_path, inside, words):
    found = checked(tmp_path, "", f"<collision>{inside}</collision>" + BALL.format("collision"))
    (fault,) = found.collisions.faults
    assert fault.link == "second"
    assert fault.why.startswith("line 1: ")
    assert re.search(words, fault.why)
    assert [shape.link for shape in found.collisions.shapes] == ["second"]
    assert found.warnings == (), "who does not ask for collisions is told nothing"


def test_visuals_that_cannot_be_drawn_are_listed_by_link(tmp_path):
    lost = '<visual><geometry><mesh filename="lost.stl"/></geometry></visual>'
    found = checked(tmp_path, lost, lost + BALL.format("visual"))
    assert [fault.link for fault in found.visual_faults] == ["base", "second"]
    assert len(found.warnings) == 1


def test_shapes_beyond_the_cap_are_faults_of_their_links(tmp_path):
    found = checked(tmp_path, BALL.format("collision") * 2001, BALL.format("collision"))
    assert len(found.collisions.shapes) == 2000
    assert [(fault.link, fault.why) for fault in found.collisions.faults] == [
        ("base", "there are more than 2,000 shapes"),
        ("second", "there are more than 2,000 shapes"),
    ]
