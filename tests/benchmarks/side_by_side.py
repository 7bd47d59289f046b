"""The table of tools side by side, as Markdown: python tests/benchmarks/side_by_side.py.

Each tool answers in a process of its own: a ur5, tool down, over squares of 90 poses. What it
returns is replayed by the referee of the tests, which knows nothing of any of them. The other tools
come with the extra `benchmarks`; one that is not installed has a row that says so.
"""

import json
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from importlib.metadata import PackageNotFoundError, version
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "shared")]
from referee import TAU, Arm, closely, joints_of, placement

from coverable import Task, check, load_robot, plane, poses

Floats = NDArray[np.float64]
Answer = tuple[str, Floats | None]  # what the tool says, and its joint values (k, 6) rad
ROWS, COLUMNS, REPEATS, PATIENCE = 9, 10, 5, 600.0  # cells, answers, [s] for one of them
ROLLS = 24  # that a tool tries where the roll is free and it has to be told some
TIP, BASE, GROUP = "tool0", "base_link", "manipulator"
LINE = 1e-3  # [m] that the tool point may leave the straight lines by, for tools that ask
TILT_DEG = 1.0  # of the tool, where its roll is free
WIDE, LIFT = (-180.0, 180.0), (-120.0, 0.0)
BEHIND = (WIDE, LIFT, None, WIDE, WIDE, WIDE)  # limits of the six joints; None as in the URDF


class Square(NamedTuple):
    """One question. Where the roll is fixed, the tool's x axis is along that of the base."""

    name: str
    side: float
    centre: tuple[float, float, float]
    limits_deg: Sequence[tuple[float, float] | None]
    fixed: bool

    def points(self) -> Floats:
        """(90, 3) m, centres of 9 x 10 cells in the frame of the base, run to and fro."""
        u, v = (self.side * ((np.arange(n) + 0.5) / n - 0.5) for n in (ROWS, COLUMNS))
        flat = [(x, y, 0.0) for row, x in enumerate(u) for y in (v if row % 2 == 0 else v[::-1])]
        return np.array(flat) + self.centre

    def turns(self) -> Floats:
        """(k, 4, 4) of the tool: the one that is asked for, or samples where the roll is free."""
        rolls = range(1 if self.fixed else ROLLS)
        return np.array([placement(rpy=(np.pi, 0.0, TAU * roll / ROLLS)) for roll in rolls])


SQUARES = [
    Square(f"{name}, roll {'fixed' if fixed else 'free'}", side, centre, limits, fixed)
    for name, side, centre, limits in (
        ("0.15 m in front", 0.15, (0.5, 0.0, 0.1), (None,) * 6),
        ("0.4 m in front", 0.4, (0.5, 0.0, 0.1), (None,) * 6),
        ("0.4 m behind, narrower limits", 0.4, (-0.5, 0.0, 0.1), BEHIND),
    )
    for fixed in (False, True)
]


def bare_urdf(square: Square, file: Path) -> Arm:
    """Write the URDF without shapes, collisions being nobody's question, and with the limits."""
    robot = ElementTree.parse(load_robot("ur5").urdf).getroot()
    robot[:] = [part for part in robot if part.tag in ("link", "joint")]
    for link in robot.iter("link"):
        link[:] = link.findall("inertial")
    turning = [j for j in robot.iter("joint") if j.get("type") == "revolute"]
    for joint, ends in zip(turning, square.limits_deg, strict=True):
        for end, value in zip(("lower", "upper"), ends or (), strict=ends is not None):
            joint.find("limit").set(end, repr(math.radians(value)))
    file.write_text(ElementTree.tostring(robot, encoding="unicode"))
    names = [str(j.get("name")) for j in turning]
    return Arm(joints_of(file), TIP, names, seen_from=BASE)


def measured(arm: Arm, q: Floats, square: Square) -> dict[str, object]:
    """The largest of each along a motion that is straight in joint space between its rows."""
    looked, points = closely(q, math.radians(0.2)), square.points()
    tool, axis, x = arm.tool(looked)
    off = np.full(len(tool), np.inf)
    for here, there in pairwise(points):
        share = np.clip((tool - here) @ (there - here) / ((there - here) @ (there - here)), 0, 1)
        off = np.minimum(off, np.linalg.norm(tool - here - share[:, None] * (there - here), axis=1))
    low, high = np.asarray(arm.limits).T
    missed = max(np.linalg.norm(tool - point, axis=1).min() for point in points)
    found = {
        "missed mm": 1e3 * missed,
        "off the lines mm": 1e3 * off.max(),
        "off the square mm": 1e3 * np.abs(tool[:, 2] - points[0, 2]).max(),
        "tilt deg": np.degrees(np.arctan2(np.linalg.norm(axis[:, :2], axis=1), -axis[:, 2]).max()),
        "roll deg": np.degrees(np.abs(np.arctan2(x[:, 1], x[:, 0])).max()),
        "largest step of a joint deg": np.degrees(np.abs(np.diff(q, axis=0)).max(initial=0.0)),
        "beyond limits deg": np.degrees(max((low - looked).max(), (looked - high).max(), 0.0)),
    }
    return {name: round(float(value), 3) + 0.0 for name, value in found.items()} | (
        {} if square.fixed else {"roll deg": "free"}
    )


def coverable(square: Square, file: Path, in_order: bool = True) -> Callable[[], Answer]:
    """Along the poses in their order, or over the square as a surface of 90 cells in any order."""
    robot, half = load_robot(file, tool_frame=TIP), 0.5 * square.side
    up, along = (np.tile(axis, (90, 1)) for axis in ([0.0, 0, 1], [1.0, 0, 0]))
    ways = poses(square.points(), up, tangents=along)
    patch = plane((-half, half), (-half, half), "outside", square.centre)
    cells = ways if in_order else patch.cells(ROWS, COLUMNS)
    roll = {"roll_deg": (0.0, 0.0), "roll_reference": (1.0, 0.0, 0.0)} if square.fixed else {}
    task = Task(0.0, 0.0 if square.fixed else TILT_DEG, tolerance=LINE, **roll)

    def answer() -> Answer:
        verdict = check(robot, cells, task)
        said = f"{verdict.answer} ({verdict.evidence}), {verdict.n_covered} of 90"
        return said, None if verdict.witness is None else verdict.witness.q

    return answer


def eaik(square: Square, file: Path) -> Callable[[], Answer]:
    """The ladder that many write: closed-form IK at every pose, and a shortest path in joints."""
    from eaik.IK_URDF import UrdfRobot

    robot, arm = UrdfRobot(str(file)), bare_urdf(square, file)
    low, high = np.asarray(arm.limits).T
    zero = np.zeros(6)
    offset = np.linalg.inv(arm.placed(zero)[0]) @ robot.fwdKin(zero)  # EAIK's own last frame

    def answer() -> Answer:
        rungs = []
        for point in square.points():
            at = square.turns()
            at[:, :3, 3] = point
            found = [np.empty((0, 6))]
            for one in robot.IK_batched(at @ offset):
                found.append(np.reshape(one.Q, (-1, 6))[~np.array(one.is_LS, dtype=bool)])
            q = np.pi - np.mod(np.pi - np.concatenate(found), TAU)
            rungs.append(q[((q >= low) & (q <= high)).all(axis=1)])
        missing = sum(len(rung) == 0 for rung in rungs)
        if missing:
            return f"no solution at {missing} of 90 poses", None
        cost, before = np.zeros(len(rungs[0])), []
        for here, there in pairwise(rungs):
            apart = np.linalg.norm(there[:, None] - here[None], axis=2) + cost
            before.append(apart.argmin(axis=1))
            cost = apart.min(axis=1)
        way = [int(cost.argmin())]
        for back in reversed(before):
            way.append(int(back[way[-1]]))
        q = np.array([rung[k] for rung, k in zip(rungs, way[::-1], strict=True)])
        return f"a path, rungs {np.degrees(np.abs(np.diff(q, axis=0)).max()):.3g} deg apart", q

    return answer


def descartes(square: Square, file: Path) -> Callable[[], Answer]:
    """The ladder planner of Tesseract, by its Python wrapper and its own IK for this arm."""
    from tesseract_robotics import tesseract_command_language as language
    from tesseract_robotics import tesseract_common as common
    from tesseract_robotics import tesseract_motion_planners_descartes as planners
    from tesseract_robotics.tesseract_environment import Environment
    from tesseract_robotics.tesseract_motion_planners import PlannerRequest

    chain = f"base_link: {BASE}, tip_link: {TIP}"
    plugin = "  {kind}_kin_plugins:\n    {group}:\n      default: {name}\n      plugins:\n        {name}:\n          class: {name}Factory\n          config: {{{chain}}}\n"  # noqa: E501
    file.with_name("kinematics.yaml").write_text(
        "kinematic_plugins:\n  search_libraries: [tesseract_kinematics_kdl_factories, "
        "tesseract_kinematics_ur_factory]\n"
        + plugin.format(kind="fwd", group=GROUP, name="KDLFwdKinChain", chain=chain)
        + plugin.format(kind="inv", group=GROUP, name="URInvKin", chain=f"{chain}, model: UR5")
    )
    urdf, locator, environment = file.read_text(), common.GeneralResourceLocator(), Environment()
    srdf = (
        f'<robot name="{ElementTree.fromstring(urdf).get("name")}" version="1.0.0"><group '
        f'name="{GROUP}"><chain base_link="{BASE}" tip_link="{TIP}"/></group>'
        f'<kinematics_plugin_config filename="file://{file.parent}/kinematics.yaml"/></robot>'
    )
    if not environment.init(urdf, srdf, locator):
        raise RuntimeError("Tesseract cannot read the arm")
    manipulator = common.ManipulatorInfo()
    manipulator.tcp_frame, manipulator.working_frame = TIP, BASE
    manipulator.manipulator = GROUP
    profile = planners.DescartesDefaultPlanProfileD()
    profile.target_pose_fixed = square.fixed
    profile.target_pose_sample_axis = np.array([0.0, 0.0, 1.0])
    profile.target_pose_sample_resolution = TAU / ROLLS
    profile.target_pose_sample_min = -np.pi
    profile.target_pose_sample_max = np.pi - TAU / ROLLS
    profile.allow_collision = True
    profile.enable_collision = profile.enable_edge_collision = False
    profiles = language.ProfileDictionary()
    profiles.addProfile("DEFAULT", "DEFAULT", planners.cast_DescartesPlanProfileD(profile))
    planner = planners.DescartesMotionPlannerD("DEFAULT")
    kept = [locator, environment, profile]  # the wrapper's values are parts of these

    def answer() -> Answer:
        program = language.CompositeInstruction("DEFAULT")
        program.setManipulatorInfo(manipulator)
        for x, y, z in square.points():
            down = common.Isometry3d.Identity() * common.Translation3d(x, y, z)
            down *= common.Quaterniond(0.0, 1.0, 0.0, 0.0)
            waypoint = language.CartesianWaypointPoly_wrap_CartesianWaypoint(
                language.CartesianWaypoint(down)
            )
            move = language.MoveInstruction(
                waypoint, language.MoveInstructionType_LINEAR, "DEFAULT"
            )
            program.appendMoveInstruction(language.MoveInstructionPoly_wrap_MoveInstruction(move))
        request = PlannerRequest()
        request.instructions, request.env, request.profiles = program, environment, profiles
        response = planner.solve(request)
        if not response.successful:
            return str(response.message), None
        kept[3:] = [request, response, flat := response.results.flatten()]
        rows = []
        for k in range(len(flat)):
            move = language.InstructionPoly_as_MoveInstructionPoly(flat[k])
            state = language.WaypointPoly_as_StateWaypointPoly(move.getWaypoint())
            kept.extend([move, state])
            rows.append(np.array(state.getPosition(), dtype=float).ravel())
        return str(response.message), np.array(rows)

    return answer


TOOLS: dict[str, tuple[str, Callable[..., Callable[[], Answer]]]] = {
    "coverable, in order": ("coverable", coverable),
    "coverable, as a surface": ("coverable", lambda *given: coverable(*given, in_order=False)),
    "Descartes": ("tesseract-robotics", descartes),
    "EAIK and a ladder": ("eaik", eaik),
}


def measure(tool: str, square: Square, folder: Path) -> dict[str, object]:
    """Ask one tool one question; least processor time of some answers, after one that loads all."""
    arm = bare_urdf(square, folder / "arm.urdf")
    answer = TOOLS[tool][1](square, folder / "arm.urdf")
    (said, q), taken = answer(), []
    for _ in range(REPEATS):
        began = time.process_time()
        said, q = answer()
        taken.append(1e3 * (time.process_time() - began))
    seen = {} if q is None else {"rows": len(q), **measured(arm, q, square)}
    return {"answer": said, "CPU ms": round(min(taken), 1), **seen}


def main() -> None:
    """Ask every tool in a process of its own, and print the table."""
    rows = []
    for number, square in enumerate(SQUARES):
        for tool, (package, _) in TOOLS.items():
            row: dict[str, object] = {"square": square.name, "tool": tool}
            try:
                row["answer"] = f"{package} {version(package)}"
                asked = [sys.executable, __file__, tool, str(number)]
                done = subprocess.run(asked, capture_output=True, text=True, timeout=PATIENCE)
                row |= json.loads(done.stdout.splitlines()[-1]) if done.returncode == 0 else {
                    "answer": f"failed: {(done.stderr.splitlines() or ['?'])[-1]}"
                }  # fmt: skip
            except PackageNotFoundError:
                row["answer"] = f"{package} is not installed"
            rows.append(row)
            print(f"{square.name}: {tool}", file=sys.stderr)
    names = list(dict.fromkeys(name for row in rows for name in row))
    filled = [[row.get(name, "") for name in names] for row in rows]
    for line in (names, ["---"] * len(names), *filled):
        print("|", " | ".join(map(str, line)), "|")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        with tempfile.TemporaryDirectory() as folder:
            print(json.dumps(measure(sys.argv[1], SQUARES[int(sys.argv[2])], Path(folder))))
    else:
        main()
