"""Arms that git fetches: the whole way through a local repository that git is redirected to."""

import json
import shutil
import subprocess

import numpy as np
import pytest
from approved import refused
from arm_urdfs import arm, joint
from jobs import PLATE, run_coverable

from coverable import as_yourdfpy, list_robots, load_robot
from robots.catalogue import source
from robots.library import flange_axis

ARM = "ur10e_description"
PACKAGE = "<package><name>ur_description</name></package>"
TOOL0 = (
    '<link name="tool0"/><joint name="end" type="fixed"><parent link="l6"/><child link="tool0"/>'
    "</joint>"
)
TURN = np.pi / 2
JOINTS = [  # as a UR10e has them
    joint(1, xyz=(0, 0, 0.181)), joint(2, rpy=(TURN, 0, 0)), joint(3, xyz=(-0.613, 0, 0)),
    joint(4, xyz=(-0.572, 0, 0.174)), joint(5, xyz=(0, -0.12, 0), rpy=(TURN, 0, 0)),
    joint(6, xyz=(0, 0.117, 0), rpy=(TURN, np.pi, np.pi)),
]  # fmt: skip
XACRO = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="$(arg name)">
<xacro:arg name="ur_type" default=""/><xacro:arg name="name" default="ur"/>
<xacro:include filename="$(find ur_description)/urdf/inc/$(arg ur_type).xacro"/></robot>"""
CASE = PLATE.replace('"ur5"', '"ur10e"').replace("[3, 4]", "[1, 2]")


def git(folder, *words):
    named = ("-c", "user.name=a", "-c", "user.email=a@b", *words)
    done = subprocess.run(["git", *named], cwd=folder, check=True, capture_output=True, text=True)
    return done.stdout.strip()


@pytest.fixture
def redirected(tmp_path, monkeypatch):
    """The repository of the UR arms, as git finds it in this environment."""
    far = tmp_path / "far"
    (far / "urdf/inc").mkdir(parents=True)
    (far / "package.xml").write_text(PACKAGE)
    (far / "urdf/ur.urdf.xacro").write_text(XACRO)
    (far / "urdf/inc/ur10e.xacro").write_text(arm(JOINTS, TOOL0))
    git(far, "init", "-q")
    git(far, "add", ".")
    git(far, "commit", "-qm", "all")
    monkeypatch.setenv("ROBOT_DESCRIPTION_COMMIT", git(far, "rev-parse", "HEAD"))
    monkeypatch.setenv("ROBOT_DESCRIPTIONS_CACHE", str(tmp_path / "cache"))
    url = source(ARM).url
    for key, value in (("COUNT", "1"), ("KEY_0", f"url.{far}.insteadOf"), ("VALUE_0", url)):
        monkeypatch.setenv(f"GIT_CONFIG_{key}", value)
    return far


def test_a_case_is_decided_with_an_arm_that_is_fetched_for_it(redirected, tmp_path):
    place = source(ARM)
    assert not place.is_here
    (tmp_path / "case.toml").write_text(CASE)
    first = run_coverable("check", tmp_path / "case.toml", "--json", "--save", tmp_path / "found")
    fetched = f"fetching {place.url} at {place.commit[:12]} into {place.folder}, once"
    assert (first.status, first.err.count(fetched), place.is_here) == (0, 1, True)
    assert json.loads(first.out)["verdict"] == "feasible"
    again = run_coverable("verify", tmp_path / "found", "--json")
    assert (again.status, "fetching" in again.err) == (0, False)
    robot, same = load_robot("ur10e"), load_robot(ARM)
    assert (robot.name, robot.urdf, robot.n) == (same.name, same.urdf, 6)
    assert robot.urdf == str(place.folder / "urdf" / "ur.urdf.xacro")
    tool = as_yourdfpy(robot, np.zeros(6)).get_transform("tool0")
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
    assert f"git clone {source(ARM).url} {source(ARM).folder}" in said
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
