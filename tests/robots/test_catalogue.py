"""Arms that git fetches: the whole way through a local repository that git is redirected to."""

import json
import shutil
import subprocess

import numpy as np
import pytest
from approved import refused
from jobs import run_coverable

from coverable import as_yourdfpy, list_robots, load_robot
from robots.catalogue import source
from robots.library import flange_axis

URL = "https://github.com/UniversalRobots/Universal_Robots_ROS2_Description.git"
PACKAGE = "<package><name>ur_description</name></package>"
# From the base outwards: origins and turns as a UR10e has them.
JOINTS = (
    (".0 0 .181", "0 0 0"), ("0 0 0", "1.5708 0 0"), ("-.613 0 0", "0 0 0"),
    ("-.572 0 .174", "0 0 0"), ("0 -.12 0", "1.5708 0 0"), ("0 .117 0", "1.5708 3.1416 3.1416"),
)  # fmt: skip
XACRO = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="$(arg name)">
<xacro:arg name="ur_type" default=""/><xacro:arg name="name" default="ur"/>
<xacro:include filename="$(find ur_description)/urdf/inc/$(arg ur_type).xacro"/></robot>"""
CASE = """robot.name = "ur10e"
task = { standoff = 0.02, cone_deg = 30 }
[surface]
kind = "plane"
u = [0.5, 0.6]
v = [0, 0.1]
cells = [1, 2]
position = [0, 0, 0.3]
side = "outside"
"""


def git(folder, *words):
    named = ("-c", "user.name=a", "-c", "user.email=a@b", *words)
    done = subprocess.run(["git", *named], cwd=folder, check=True, capture_output=True, text=True)
    return done.stdout.strip()


@pytest.fixture
def redirected(tmp_path, monkeypatch):
    """The repository of the UR arms, as git finds it in this environment."""
    far = tmp_path / "far"
    (far / "urdf/inc").mkdir(parents=True)
    links = [f'<link name="{name}"/>' for name in ("tool0", *map("l{}".format, range(7)))]
    joints = [
        f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/><axis '
        f'xyz="0 0 1"/><origin xyz="{xyz}" rpy="{rpy}"/><limit lower="-6" upper="6"/></joint>'
        for k, (xyz, rpy) in enumerate(JOINTS)
    ]
    joints += ['<joint name="t" type="fixed"><parent link="l6"/><child link="tool0"/></joint>']
    (far / "package.xml").write_text(PACKAGE)
    (far / "urdf/ur.urdf.xacro").write_text(XACRO)
    (far / "urdf/inc/ur10e.xacro").write_text(f"<robot>{''.join(links + joints)}</robot>")
    git(far, "init", "-q")
    git(far, "add", ".")
    git(far, "commit", "-qm", "all")
    monkeypatch.setenv("ROBOT_DESCRIPTION_COMMIT", git(far, "rev-parse", "HEAD"))
    monkeypatch.setenv("ROBOT_DESCRIPTIONS_CACHE", str(tmp_path / "cache"))
    for key, value in (("COUNT", "1"), ("KEY_0", f"url.{far}.insteadOf"), ("VALUE_0", URL)):
        monkeypatch.setenv(f"GIT_CONFIG_{key}", value)
    return far


def test_a_case_is_decided_with_an_arm_that_is_fetched_for_it(redirected, tmp_path):
    place = source("ur10e_description")
    assert (place.url, place.is_here) == (URL, False)
    (tmp_path / "case.toml").write_text(CASE)
    first = run_coverable("check", tmp_path / "case.toml", "--json", "--save", tmp_path / "found")
    fetched = f"fetching {URL} at {place.commit[:12]} into {place.folder}, once"
    assert (first.status, first.err.count(fetched), place.is_here) == (0, 1, True)
    assert json.loads(first.out)["verdict"] == "feasible"
    again = run_coverable("verify", tmp_path / "found", "--json")
    assert (again.status, "fetching" in again.err) == (0, False)
    arm, same = load_robot("ur10e"), load_robot("ur10e_description")
    assert (arm.name, arm.urdf, arm.n) == (same.name, same.urdf, 6)
    assert arm.urdf == str(place.folder / "urdf" / "ur.urdf.xacro")
    tool = as_yourdfpy(arm, np.zeros(6)).get_transform("tool0")
    np.testing.assert_allclose(tool[:3, 3], [-1.185, -0.291, 0.061], atol=1e-4)
    row = next(row for row in json.loads(run_coverable("robots", "--json").out)["robots"]
               if row["name"] == "ur10e")  # fmt: skip
    assert (row["here"], row["payload_kg"], row["source"]) == (True, 12.5, "robot_descriptions")


def test_what_is_said_where_it_cannot_be_fetched_and_a_half_clone_is_finished(
    redirected, tmp_path, monkeypatch
):
    away = shutil.move(redirected, tmp_path / "away")
    said = refused(load_robot, "ur10e")
    assert "cannot be fetched from" in said
    (tmp_path / "case.toml").write_text(CASE)
    assert run_coverable("check", tmp_path / "case.toml").err.count("fetching") == 1
    assert "does not appear to be a git repository" in said
    assert f"git clone {URL} {source('ur10e_description').folder}" in said
    shutil.move(away, redirected)  # what the first attempt left is a repository without a commit
    assert load_robot("ur10e").n == 6
    monkeypatch.setenv("ROBOT_DESCRIPTIONS_CACHE", str(tmp_path / "another"))
    monkeypatch.setenv("PATH", str(tmp_path))
    assert "(git is not installed)" in refused(load_robot, "ur10e")
    monkeypatch.setenv("ROBOT_DESCRIPTIONS_CACHE", str(redirected / "package.xml"))
    assert "Not a directory" in refused(load_robot, "ur10e")
    monkeypatch.setattr("robots.catalogue.find_spec", lambda name: None)
    assert "pip install 'coverable[arms]'" in refused(load_robot, "ur10e")


def test_the_table_names_descriptions_of_the_catalogue_and_no_arm_that_comes_first():
    from robot_descriptions import DESCRIPTIONS

    arms = [info for info in list_robots(catalogue=True) if info.module]
    assert len(arms) >= 40
    assert not {info.name for info in arms} & {info.name for info in list_robots()}
    for info in arms:
        listed = DESCRIPTIONS[info.module]
        assert listed.has_urdf
        assert info.licence in (listed.license_spdx, "Universal Robots'")
        assert listed.dof in (None, info.joints, 2 * info.joints + 2)  # two arms, two grippers
    assert load_robot("panda").name == "panda"  # needs no network
    assert flange_axis("omy_3m") == (0, -1, 0)
