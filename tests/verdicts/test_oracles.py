"""The oracles and the referee, to which verdicts are held: are they right themselves?"""

from dataclasses import replace

import numpy as np
import plain
import puma_oracle
import pytest
import referee
import ur5_oracle
from asked import STORED, names, question, stored, tables_of, verdict_of
from oracle_cases import Answer, Problem, net, read
from plain import tools
from samples import sampled, spread

from coverable import Answer as Said
from coverable import Evidence, load_robot

ARMS = ("puma560", "ur5", "panda", "kinova", "xarm7", "z1", "so101", "talos_left")


def paper_case(name):
    asked, made = question(name), tables_of(name)["surface"]
    size = tuple(made[key] for key in ("radius", "flare") if key in made)
    u, v = (tuple(made[key] if key in made else made[f"{key}_deg"]) for key in "uv")
    limits = np.degrees(np.column_stack([asked.robot.lower, asked.robot.upper]))
    pose = tuple(made.get("position", (0.0, 0.0, 0.0))), (0.0, 0.0, 0.0), "inside"
    work = (9, 10), asked.task.standoff, asked.task.cone_deg
    return Problem(made["kind"], size, u, v, *pose, *work, tuple(map(tuple, limits)))


@pytest.mark.parametrize("name", ARMS)
def test_the_referees_arms_stand_where_pinocchios_do(name):
    robot = load_robot(name)
    low, high = np.maximum(robot.lower, -3.0), np.minimum(robot.upper, 3.0)
    q = np.random.default_rng(0).uniform(low, high, (20, robot.n))
    points, axes, _ = plain.arm_of(robot).tool(q)
    for mine, theirs in zip((points, axes), tools(robot, q), strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-9)


@pytest.mark.parametrize("name", [
    "torus", "bowl", "egg", "funnel", "hood", "waist", "plate", "paper 4a", "paper 4c",
])  # fmt: skip
def test_no_sample_of_a_surface_is_nearer_than_the_referees_nearest_place(name):
    form, rng = plain.surface_of(question(name).cells.surface), np.random.default_rng(1)
    # Where the border is nearest each parameter is brought into its range by itself.
    u, v = (ends[0] + (ends[1] - ends[0]) * rng.uniform(0.2, 0.8, 60) for ends in (form.u, form.v))
    places = form.at(u, v)
    points = places.points + rng.normal(scale=0.01, size=(60, 3))
    found = form.at(*form.nearest(points))
    least = np.linalg.norm(found.points - points, axis=1)
    grid = (np.linspace(*ends, 200) for ends in (form.u, form.v))
    many = form.at(*(x.ravel() for x in np.meshgrid(*grid, indexing="ij"))).points
    nearest = np.linalg.norm(points[:, None] - many, axis=2).min(axis=1)
    assert (least <= nearest + 1e-9).all()
    step = 1e-5 * (form.v[1] - form.v[0])
    inner = np.clip(v, form.v[0] + step, form.v[1] - step)
    across = form.at(u, inner + step).points - form.at(u, inner - step).points
    leaning = (across * form.at(u, inner).normals).sum(axis=1)
    assert np.abs(leaning / np.linalg.norm(across, axis=1)).max() < 1e-4
    assert np.abs((places.along * places.normals).sum(axis=1)).max() < 1e-6


def test_the_referee_says_what_is_wrong():
    """Else no motion would be refused by it."""
    verdict = verdict_of("plate")
    q, marks = verdict.witness.q, verdict.witness.cell
    arm = plain.arm_of(verdict.robot)
    narrow = replace(arm, limits=np.column_stack([arm.limits[:, 0], q.max(axis=0) - 1e-9]))
    form = plain.surface_of(verdict.cells.surface)
    asked = plain.asked_of(verdict.task, verdict.cells)
    aims = plain.targets_of(verdict.cells, verdict.task)
    for made, said in (
        ((narrow, form, asked, q, aims, marks), "limits"),
        ((arm, form, asked._replace(tolerance=1e-5), q, aims, marks), "tolerance"),
        ((arm, form, asked._replace(cone=0.01), q, aims, marks), "cone"),
        ((arm, form, asked._replace(roll=(3.0, 3.1)), q, aims, marks), "roll"),
        ((arm, form, asked, q[:9], aims, marks[:9]), "coverage"),
        ((arm, form, asked, q[:9], aims), "coverage"),
        ((arm, form, asked, q, aims, np.roll(marks, 1)), "marks"),
        ((arm, form, asked, q * np.nan, aims, marks), "limits"),
    ):
        assert any(fault.startswith(said) for fault in referee.judge(*made)), said
    assert referee.judge(arm, form, asked, q, aims, marks) == []
    ball = referee.Shape(None, referee.placement((0.5, 0.0, 0.35)), ("sphere", 0.15))
    bodies = referee.link_bodies(verdict.robot.urdf, verdict.robot.package_dirs)
    scene = referee.Scene(arm, bodies | {"ball": [ball]}, [("wrist_3_link", "ball", 0.0)])
    faults = referee.judge(arm, form, asked, q, aims, marks, scene)
    assert [fault.split(":")[0] for fault in faults] == ["clearance"]


@sampled("name", spread(names("paper"), 1))
def test_the_papers_cases_have_their_known_answers(name):
    best = {"paper 4d": 60, "paper 4f": 6}.get(name, 90)
    assert puma_oracle.solve(paper_case(name)) == Answer(best == 90, best, best)


def test_every_branch_places_the_tool_where_pinocchio_says_and_all_are_branches():
    robot, rng = load_robot("puma560"), np.random.default_rng(0)
    q = rng.uniform(-np.pi, np.pi, (300, 6))
    points, axes = tools(robot, q)
    assert (puma_oracle.slack(points) >= -1e-12).all()
    for row, point, axis, branches in zip(q, points, axes, puma_oracle.arms(points), strict=True):
        off = (branches - row[:3] + np.pi) % (2 * np.pi) - np.pi
        assert np.abs(off).max(axis=-1).min() < 1e-6
        wrist = np.column_stack([branches, np.tile(row[3:], (4, 1))])
        np.testing.assert_allclose(tools(robot, wrist)[0], np.tile(point, (4, 1)), atol=1e-9)
        c4, s4, c5, s5 = np.cos(row[3]), np.sin(row[3]), np.cos(row[4]), np.sin(row[4])
        seen = puma_oracle.in_link3(row[:3], axis)
        np.testing.assert_allclose(seen, [-s5 * c4, c5, s5 * s4], atol=1e-9)


def test_every_ur5_configuration_is_found_from_its_tool_and_two_wrist_angles():
    robot, rng = load_robot("ur5"), np.random.default_rng(4)
    q = rng.uniform(-np.pi, np.pi, (400, 6))
    points, axes = tools(robot, q)
    far = np.hypot(points[:, 0], points[:, 1]) > ur5_oracle.CLEARANCE
    assert far.sum() > 200
    for row, point, axis in zip(q[far], points[far], axes[far], strict=True):
        psi, c5, s5 = row[1] + row[2] + row[3], np.cos(row[4]), np.sin(row[4])
        out = np.array([np.cos(row[0]), np.sin(row[0]), 0.0])
        along = np.array([-np.sin(row[0]), np.cos(row[0]), 0.0])
        seen = s5 * np.cos(psi) * out + c5 * along - s5 * np.sin(psi) * np.array([0.0, 0.0, 1.0])
        np.testing.assert_allclose(axis, seen, atol=1e-9)
        branches = [ur5_oracle.arm(point, ur5_oracle.SIGNS, e, row[4], psi)[0] for e in (1, -1)]
        off = (np.array(branches) - row[:4] + np.pi) % (2 * np.pi) - np.pi
        assert np.abs(off).max(axis=-1).min() < 1e-6


@sampled(("arm", "oracle"), [("puma560", puma_oracle), ("ur5", ur5_oracle)])
def test_stored_answers_are_the_oracles(arm, oracle):
    problems = read(arm)
    for number in spread([2, 0, 1, *range(3, len(problems))], 2):  # the first takes long
        problem, said = problems[number]
        assert oracle.solve(problem) == said
        cells, task = question(f"{arm} {number}")[3:5]
        aims = problem.targets(*net(problem, 4).uv[: len(cells)].T)
        for mine, theirs in zip(aims, task.targets(cells)[:2], strict=True):
            np.testing.assert_allclose(mine, theirs, atol=1e-12)


@sampled("file", STORED)
def test_few_stored_problems_are_left_undecided_or_unproved(file):
    """That no answer is wrong, and no more cells are covered than there are, the table holds."""
    found = [verdict_of(name) for name in spread(stored(file), STORED[file])]
    undecided = sum(verdict.answer is Said.UNDECIDED for verdict in found)
    unproved = sum(verdict.evidence is Evidence.EXHAUSTED for verdict in found)
    # "Not infeasible" and "not feasible" problems hang by a hair, or nobody knows.
    most = {"by_a_hair": 1.0, "panda_apart": 0.5, "puma560": 0.0, "ur5": 0.0}.get(file, 0.05)
    assert undecided <= most * len(found) + 1
    assert unproved <= (0.0 if file in ("puma560", "ur5") else 0.1) * len(found) + 1
