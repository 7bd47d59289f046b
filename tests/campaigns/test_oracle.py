"""The oracles that the complete search is held to: are they right themselves?"""

import numpy as np
import pinocchio as pin
import puma_motion
import puma_oracle
import pytest
import ur5_oracle
from oracle_build import built
from oracle_cases import Answer, Problem, net, patch
from random_cases import TABLE_1, read

from robots import load_robot

SPHERE = ("sphere", (1.0,), (10, 90), (10, 180))
CYLINDER = ("cylinder", (0.5,), (-60, 60), (0, 0.9))
HYPERBOLOID = ("hyperboloid", (0.5, 0.5), (130, 220), (0, 0.5))
CENTRED = (0.0, 0.0, 0.0)
PAPER = {
    "4a": (SPHERE, CENTRED, 45, 1, 90),
    "4b": (SPHERE, CENTRED, 45, 2, 90),
    "4c": (CYLINDER, CENTRED, 45, 1, 90),
    "4d": (CYLINDER, CENTRED, 45, 3, 60),
    "4e": (HYPERBOLOID, CENTRED, 45, 1, 90),
    "4f": (HYPERBOLOID, CENTRED, 45, 4, 6),
    "5a": (SPHERE, CENTRED, 5, 1, 90),
    "5b": (SPHERE, (0.005, 0.0, 0.0), 10, 1, 90),
    "5c": (CYLINDER, (0.0, 0.055, 0.0), 5, 1, 90),
    "5d": (CYLINDER, (0.0, 0.055, 0.0), 10, 1, 90),
    "5e": (HYPERBOLOID, (1.095, 0.0, 0.0), 10, 1, 90),
    "5f": (HYPERBOLOID, (1.15, 0.0, 0.0), 20, 1, 90),
}
STORED = read("puma560")
STORED_UR5 = read("ur5")
AGAIN = np.random.default_rng(5).choice(len(STORED), 10, replace=False)


def paper_case(name: str) -> Problem:
    surface, position, cone, limits, _ = PAPER[name]
    return Problem(
        *surface, position, CENTRED, "inside", (9, 10), 0.005, cone, TABLE_1[limits - 1]
    )  # fmt: skip


@pytest.fixture(scope="module")
def puma():
    return load_robot("puma560", limits="set-1")


@pytest.fixture(scope="module")
def ur5():
    return load_robot("ur5")


@pytest.mark.parametrize("on", ["patch", "net"])
@pytest.mark.parametrize("name", PAPER)
def test_the_papers_cases_have_their_known_answers(name, on):
    best = PAPER[name][-1]
    assert puma_oracle.solve(paper_case(name), on) == Answer(best == 90, best, best)


def test_every_branch_places_the_tool_where_pinocchio_says(puma):
    rng = np.random.default_rng(0)
    points = rng.uniform(-1.4, 1.4, (4000, 3))
    points = points[(puma_oracle.slack(points) >= 0.0).all(axis=1)]
    assert len(points) > 500
    data = puma.model.createData()
    frame = puma.tool_frame_id
    for point, branches in zip(points[:200], puma_oracle.arms(points), strict=False):
        for theta in branches:
            wrist = rng.uniform(-np.pi, np.pi, 3)
            pin.framesForwardKinematics(puma.model, data, np.concatenate([theta, wrist]))
            placed = data.oMf[frame]
            np.testing.assert_allclose(placed.translation, point, atol=1e-9)
            c4, s4, c5, s5 = np.cos(wrist[0]), np.sin(wrist[0]), np.cos(wrist[1]), np.sin(wrist[1])
            np.testing.assert_allclose(
                puma_oracle.in_link3(theta, placed.rotation[:, 2]),
                [-s5 * c4, c5, s5 * s4],
                atol=1e-12,
            )


def test_every_configuration_is_on_a_branch(puma):
    rng = np.random.default_rng(1)
    data = puma.model.createData()
    for q in rng.uniform(-np.pi, np.pi, (300, 6)):
        pin.framesForwardKinematics(puma.model, data, q)
        point = data.oMf[puma.tool_frame_id].translation[None]
        off = (puma_oracle.arms(point)[0] - q[:3] + np.pi) % (2 * np.pi) - np.pi
        assert np.abs(off).max(axis=-1).min() < 1e-6


def test_points_without_slack_are_out_of_reach(puma):
    rng = np.random.default_rng(2)
    data = puma.model.createData()
    reached = []
    for q in rng.uniform(-np.pi, np.pi, (2000, 6)):
        pin.framesForwardKinematics(puma.model, data, q)
        reached.append(data.oMf[puma.tool_frame_id].translation.copy())
    left = puma_oracle.slack(np.array(reached))
    assert (left >= -1e-12).all()
    assert (left.min(axis=0) < 0.01).all()  # the bound is met, not merely kept


def test_every_ur5_configuration_is_found_from_its_tool_and_two_wrist_angles(ur5):
    rng = np.random.default_rng(4)
    data = ur5.model.createData()
    seen = 0
    for q in rng.uniform(-np.pi, np.pi, (600, 6)):
        pin.framesForwardKinematics(ur5.model, data, q)
        placed = data.oMf[ur5.tool_frame_id]
        if np.hypot(*placed.translation[:2]) < ur5_oracle.CLEARANCE:
            continue
        seen += 1
        psi, c5, s5 = q[1] + q[2] + q[3], np.cos(q[4]), np.sin(q[4])
        outward = np.array([np.cos(q[0]), np.sin(q[0]), 0.0])
        along = np.array([-np.sin(q[0]), np.cos(q[0]), 0.0])
        np.testing.assert_allclose(
            placed.rotation[:, 2],
            s5 * np.cos(psi) * outward + c5 * along - s5 * np.sin(psi) * np.array([0.0, 0.0, 1.0]),
            atol=1e-9,
        )
        off = np.empty((2, 2, 4))
        for s, e in np.ndindex(2, 2):
            sign = 1.0 - 2.0 * s, 1.0 - 2.0 * e
            ur5_oracle.arm(*placed.translation, *sign, q[4], psi, off[s, e])
        off = (off - q[:4] + np.pi) % (2 * np.pi) - np.pi
        assert np.abs(off).max(axis=-1).min() < 1e-6
    assert seen > 300


def test_the_ur5_oracle_refuses_what_it_cannot_judge():
    problem, _ = STORED_UR5[0]
    plain = problem.plain() | {"kind": "plane", "size": (), "u": (-0.1, 0.1), "v": (-0.1, 0.1)}
    plain |= {"position": CENTRED, "rpy_deg": CENTRED}
    with pytest.raises(ValueError, match="first axis"):
        ur5_oracle.solve(Problem.read(plain))


@pytest.mark.parametrize("cone", [3.0, 20.0, 60.0, 90.0, 130.0])
def test_the_wrists_intervals_are_the_wrists_mask(cone):
    rng = np.random.default_rng(3)
    seen = rng.normal(size=(40, 3))
    seen[0] = (0.0, 1.0, 0.0)  # the approach direction along the axis of joint 4
    seen /= np.linalg.norm(seen, axis=1, keepdims=True)
    low, high = np.radians((-200.0, 230.0))
    rows, theta4 = np.radians(np.linspace(-200.0, 200.0, 81)), np.linspace(low, high, 1441)
    spans = puma_oracle._intervals(seen, rows, np.cos(np.radians(cone)), low, high, 3)
    c5, s5 = np.cos(rows)[:, None], np.sin(rows)[:, None]
    axis = np.stack(np.broadcast_arrays(-s5 * np.cos(theta4), c5, s5 * np.sin(theta4)), -1)
    over = np.einsum("rtk,pk->prt", axis, seen) - np.cos(np.radians(cone))
    inside = ((theta4 >= spans[..., :1]) & (theta4 <= spans[..., 1:])).any(axis=2)
    clear = np.abs(over) > 1e-9
    assert (inside == (over > 0.0))[clear].all()
    assert inside.any()
    gaps = spans[:, :, 1:, 0] - spans[:, :, :-1, 1]
    used = spans[:, :, 1:, 0] <= spans[:, :, 1:, 1]
    assert (gaps[used] > 0.0).all()  # intervals of one row do not touch


@pytest.mark.parametrize("number", range(0, len(STORED), 9))
def test_problems_are_the_projects_cells(puma, number):
    problem = STORED[number][0]
    _, cells, task = built(problem, puma)
    points, approaches = problem.targets(*net(problem, 4).uv[: len(cells)].T)
    found = task.targets(cells)
    np.testing.assert_allclose(found.points, points, atol=1e-12)
    np.testing.assert_allclose(found.approaches, approaches, atol=1e-12)


def test_both_domains_hold_the_centres_and_join_the_neighbours():
    problem = paper_case("4a")
    line, grid = net(problem, 5), patch(problem, 3)
    np.testing.assert_allclose(line.uv[line.centres], grid.uv[grid.centres], atol=1e-12)
    assert len(line.links) == 305 * 5
    assert len(grid.uv) == 90 * 9
    steps = np.abs(np.diff(grid.uv[grid.links], axis=1)).max(axis=(0, 1))
    np.testing.assert_allclose(steps, np.radians([80 / 27, 170 / 30]), atol=1e-12)


@pytest.mark.parametrize("number", AGAIN)
def test_stored_answers_are_the_oracles(number):
    problem, said = STORED[number]
    assert puma_oracle.solve(problem) == said
    wider = puma_oracle.solve(problem.varied(cone=1.2, limits_deg=5.0))
    assert wider.covered >= said.covered
    assert wider.reachable >= said.reachable


@pytest.mark.parametrize("number", [0, -1])
def test_stored_ur5_answers_are_the_oracles(number):
    problem, said = STORED_UR5[number]
    assert ur5_oracle.solve(problem, "net") == said


def test_stored_cases_are_of_every_sort():
    assert len(STORED_UR5) >= 30
    feasible = sum(said.feasible for _, said in STORED)
    apart = sum(
        said.reachable == np.prod(problem.cells) and not said.feasible for problem, said in STORED
    )
    assert len(STORED) >= 200
    assert min(feasible, apart, len(STORED) - feasible - apart) >= len(STORED) // 4
    assert {problem.kind for problem, _ in STORED} == {
        "sphere", "cylinder", "hyperboloid", "plane",
    }  # fmt: skip


@pytest.mark.parametrize("number", range(4, len(STORED), 20))
def test_what_the_oracle_joins_is_joined_by_a_motion(number):
    problem, said = STORED[number]
    motions = puma_motion.spanning(problem.varied(cone=0.99, limits_deg=-0.25), fine=70)
    assert len(motions) == said.covered
    starts = [motion.q[0] for motion in motions.values()]
    assert np.ptp(starts, axis=0).max() < 1e-9
    for cell, motion in motions.items():
        kept = puma_motion.measure(problem, motion)
        assert kept.cone >= 0.0
        assert kept.limits >= 0.0
        assert kept.jump < 0.1
        centre = net(problem, 1).uv[cell]
        np.testing.assert_allclose(motion.uv[-1], centre, atol=1e-12)
