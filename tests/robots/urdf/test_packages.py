"""Packages are found by the name in their package.xml, and lead nowhere else."""

from __future__ import annotations

from pathlib import Path

import pytest

from feasibility.cli.main import main
from robots.urdf import UrdfError, check_urdf

HEAD = '<robot name="ur" xmlns:xacro="http://www.ros.org/wiki/xacro">'
TOP = f"""{HEAD}<xacro:arg name="ur_type" default="ur5x"/>
<xacro:include filename="$(find ur_description)/urdf/ur_macro.xacro"/>
<xacro:ur_robot file="$(find ur_description)/config/$(arg ur_type)/limits.yaml"/></robot>"""
MACRO = f"""{HEAD}<xacro:macro name="ur_robot" params="file">
<xacro:property name="turn" value="${{xacro.load_yaml(file)['turn']}}"/>
<link name="base"/><link name="tool0"><collision><geometry>
<mesh filename="package://ur_description/meshes/body.obj"/></geometry></collision></link>
<joint name="j" type="revolute"><parent link="base"/><child link="tool0"/><axis xyz="0 0 1"/>
<limit lower="${{-turn}}" upper="${{turn}}" effort="1" velocity="1"/></joint>
</xacro:macro></robot>"""
PLAIN = """<robot name="mine"><link name="base"><collision><geometry>
<mesh filename="package://{}"/></geometry></collision></link></robot>"""
BODY = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def cloned(folder: Path) -> Path:
    """A package like the maker's own, in a folder that is called otherwise."""
    files = {
        "package.xml": '<?xml version="1.0"?><package format="3"><!-- <name>no</name> -->'
        "<name> ur_description </name><version>2.1.5</version></package>",
        "urdf/ur.urdf.xacro": TOP,
        "urdf/ur_macro.xacro": MACRO,
        "config/ur5e/limits.yaml": "turn: 3",
        "meshes/body.obj": BODY,
    }
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def mesh_of(path: Path, *package_dirs: Path) -> str:
    checked = check_urdf(path, package_dirs)
    assert checked.collisions.faults == ()
    (shape,) = checked.collisions.shapes
    return shape.geometry.path


def test_the_makers_own_description_loads_from_any_folder(tmp_path, monkeypatch, capsys):
    clone = cloned(tmp_path / "Downloads" / "clone-main")
    monkeypatch.chdir(tmp_path)
    Path("case.toml").write_text(
        '[robot]\nurdf = "Downloads/clone-main/urdf/ur.urdf.xacro"\n'
        'xacro_args = { ur_type = "ur5e" }\n[surface]\nkind = "plane"\nu = [0, 1]\nv = [0, 1]\n'
        "cells = [1, 1]\n[task]\nstandoff = 0.1\ncone_deg = 10\n[collision]\nsurface = false\n"
    )
    assert main(["check", "case.toml"]) == 1  # one joint covers nothing
    assert "infeasible" in capsys.readouterr().out
    beside = tmp_path / "Downloads" / "mine.urdf"
    beside.write_text(PLAIN.format("ur_description/meshes/body.obj"))
    assert mesh_of(beside) == str(clone / "meshes" / "body.obj")


@pytest.mark.parametrize("place", ["src/clone", "src/group/clone"])
def test_packages_lie_beside_that_of_the_urdf_or_below_package_dirs(tmp_path, place):
    clone = cloned(tmp_path / place)
    own = tmp_path / "src" / "cell" / "urdf" / "cell.urdf.xacro"
    own.parent.mkdir(parents=True)
    own.write_text(TOP.replace("ur5x", "ur5e"))
    (own.parents[1] / "package.xml").write_text("<package><name>cell</name></package>")
    if place == "src/clone":
        assert mesh_of(own) == str(clone / "meshes" / "body.obj")
        return
    with pytest.raises(UrdfError, match=r"'ur_description', which is not found.*seen: cell\)"):
        check_urdf(own)
    assert mesh_of(own, tmp_path) == str(clone / "meshes" / "body.obj")


def test_no_name_leads_out_of_its_package(tmp_path):
    clone = cloned(tmp_path / "clone")
    (tmp_path / "away").mkdir()
    (tmp_path / "away" / "secret.obj").write_text(BODY)
    path = clone / "urdf" / "one.urdf"
    (clone / "meshes" / "link.obj").symlink_to(tmp_path / "away" / "secret.obj")
    other = cloned(tmp_path / "away" / "other")
    (other / "package.xml").write_text("<package><name>other</name></package>")
    (clone / "urdf" / "linked").symlink_to(other)
    for name, words in {
        "ur_description/../away/secret.obj": "lies outside the folders",
        "ur_description/meshes/link.obj": "lies outside the folders",
        "other/meshes/body.obj": "is not found; add the folder above its package to package_dirs "
        "(packages seen: ur_description)",
    }.items():
        path.write_text(PLAIN.format(name))
        (fault,) = check_urdf(path).collisions.faults
        assert words in str(fault)


@pytest.mark.parametrize(
    "text",
    [
        '<!DOCTYPE p [<!ENTITY n "ur_description">]><package><name>&n;</name></package>',
        "<package><name>ur_description</name>" + " " * 2**16 + "</package>",
        "<robot><name>ur_description</name></robot>",
        "<package><name>../ur_description</name></package>",
        "not XML",
    ],
    ids=["entity", "large", "other", "path", "text"],
)
def test_a_package_xml_that_is_none_names_nothing(tmp_path, text):
    clone = cloned(tmp_path / "clone")
    (clone / "package.xml").write_text(text)
    with pytest.raises(UrdfError, match=r"'ur_description', which is not found.*no package was"):
        check_urdf(clone / "urdf" / "ur.urdf.xacro")
