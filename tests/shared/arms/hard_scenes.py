"""Arms among random objects, with what python-fcl says of them: poses, walls, clear boxes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pinocchio as pin
import trimesh
from foreign_clearances import ForeignScene
from random_arms import tilted
from referee import unit

import coverable
from coverable import Axis, Cells, Collision, Obstacle, Robot, Task, ToolShape, load_robot, plane
from feasibility.certification.collisions.every_pose import Collides, never_clear
from feasibility.collisions.asked_bodies import gather
from feasibility.collisions.problem_bodies import Bodies
from robots.kinematics import Kinematics
from robots.shapes.bodies import Triangles
from robots.shapes.solids import checked_triangles

ARMS = ("ur5", "panda", "kinova", "xarm7", "puma560", "puma560 on a rail")
CLEARANCE = 0.005  # m, that is asked for
UR5 = load_robot("ur5")
PLATE = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0.0, 0.0, 0.3))
CELLS = PLATE.cells(1, 1)
NOZZLE = ToolShape.cylinder(0.01, 0.1, position=(0.0, 0.0, -0.05))


@cache
def arm(name: str) -> Robot:
    if name != "puma560 on a rail":
        return load_robot(name)
    return load_robot("puma560", axes=[Axis("rail", "prismatic", (0, 1, 0), limits=(-0.5, 0.5))])


def within_a_turn(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """The limits, at most half a turn to either side."""
    return np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)


def a_plate(rng: np.random.Generator, robot: Robot) -> tuple[Cells, Task]:
    """A plate that looks up, or at the arm, or between, somewhere around the arm."""
    reach = min(robot.reach, 1.0)
    away, turn = rng.uniform(0.4, 0.65) * reach, rng.uniform(-60.0, 60.0)
    tilt, height = rng.uniform(0.0, 90.0), rng.uniform(0.0, 0.4) * reach
    position = (away * np.cos(np.radians(turn)), away * np.sin(np.radians(turn)), height)
    half, place = rng.uniform(0.08, 0.15) * reach, tuple(np.array(position) + robot.base_point)
    plate = plane((-half, half), (-half, half), "outside", place, (0.0, -tilt, turn))
    return plate.cells(3, 4), Task(standoff=0.05, cone_deg=float(rng.uniform(15.0, 40.0)))


def random_object(rng: np.random.Generator, name: str, around: np.ndarray) -> Obstacle:
    """A body of a size of 5 to 30 cm near a place."""
    position = tuple(around + rng.uniform(-0.15, 0.15, 3))
    turn, size = tuple(rng.uniform(-180.0, 180.0, 3)), rng.uniform(0.05, 0.3, 3).tolist()
    made = (
        lambda: Obstacle.box(name, size, position, turn),
        lambda: Obstacle.cylinder(name, size[0] / 2, size[1], position, turn),
        lambda: Obstacle.sphere(name, size[0] / 2, position),
        lambda: Obstacle.capsule(name, size[0] / 2, size[1], position, turn),
        lambda: Obstacle.halfspace(name, position, turn),
    )
    return made[int(rng.integers(5))]()


def bracket() -> Triangles:
    """An L of 0.2 m: not convex."""
    ell = np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 0.05], [0.05, 0.05], [0.05, 0.2], [0.0, 0.2]])
    bottom, top = (np.column_stack([ell, np.full(6, z)]) for z in (0.0, 0.1))
    caps = [[0, 3, 1], [1, 3, 2], [0, 4, 3], [0, 5, 4]]
    upper = [[a + 6, c + 6, b + 6] for a, b, c in caps]
    walls = [[k, (k + 1) % 6, (k + 1) % 6 + 6] for k in range(6)]
    walls += [[k, (k + 1) % 6 + 6, k + 6] for k in range(6)]
    return checked_triangles(np.vstack([bottom, top]), np.array(caps + upper + walls))


@dataclass(frozen=True)
class Over:
    robot: Robot
    surface: coverable.Surface
    task: Task
    point: np.ndarray
    approach: np.ndarray

    @classmethod
    def cell(cls, robot: Robot, cells: Cells, task: Task, cell: int = 0) -> Over:
        targets = task.targets(cells)
        return cls(robot, cells.surface, task, targets.points[cell], targets.approaches[cell])

    @property
    def bodies(self) -> Bodies:
        return gather(self.robot, self.surface, self.task.collision, self.task.standoff)

    def proved(self, most: int = 4000) -> Collides:
        """Does the tool collide in every pose? With as many boxes as the search has for a cell."""
        numbers = self.task.cone, self.task.effective_tolerance
        return never_clear(self.robot, self.bodies, *numbers, self.point, self.approach, most=most)

    def clear_pose(self, count: int, rng: np.random.Generator) -> bool:
        """Is one of so many random poses inside cone and tolerance clear of all that is at rest?"""
        scene = ToolPoses(self.robot, self.bodies)
        frame = self.robot.model.frames[self.robot.tool_frame_id].placement
        axis = frame.rotation @ self.robot.approach_axis
        onto = pin.Quaternion.FromTwoVectors(axis, self.approach).toRotationMatrix()
        for k in range(count):
            tilt = unit(np.cross(self.approach, rng.normal(size=3)))
            tilt *= self.task.cone * (1.0 if k % 2 else np.sqrt(rng.uniform()))
            turn = pin.exp3(tilt) @ pin.exp3(rng.uniform(-np.pi, np.pi) * self.approach) @ onto
            size = self.task.effective_tolerance * rng.uniform() ** 0.1
            off = size * unit(rng.normal(size=3))
            if scene.clear(pin.SE3(turn, self.point + off - turn @ frame.translation)):
                return True
        return False


class ToolPoses(ForeignScene):
    """The tool among what is at rest, for fcl; only pairs of these are asked for."""

    def __init__(self, robot: Robot, bodies: Bodies) -> None:
        super().__init__(robot, bodies)
        joint = {owner: shapes[0][0].link or 0 for owner, shapes in self.bodies.items()}
        self.pairs = [one for one in self.pairs if {joint[one[0]], joint[one[1]]} == {0, robot.n}]
        self.meshes = {
            one.owner: one
            for one in bodies.scene
            if isinstance(one.geometry, Triangles) and one.geometry.closed
        }

    def _frames(self, q: np.ndarray) -> dict:
        return {self.robot.n: self.pose.homogeneous[None]}

    def clear(self, pose: pin.SE3) -> bool:
        """Is no pair too near? Of meshes, fcl knows the triangles: what is inside is asked for."""
        self.pose = pose
        if any(self._swallowed(pose, *pair[:2]) for pair in self.pairs):
            return False
        return all(
            self.distances(np.zeros(1), [k])[0] >= max(pair[2], 1e-12)
            for k, pair in enumerate(self.pairs)
        )

    def _swallowed(self, pose: pin.SE3, first: str, second: str) -> bool:
        """Is a corner or the middle of what moves inside a closed mesh of the scene?"""
        mesh = self.meshes.get(first) or self.meshes.get(second)
        if mesh is None:
            return False
        solid = trimesh.Trimesh(mesh.geometry.vertices, mesh.geometry.faces, process=False)
        for one in self.asked.solids:
            if one.joint == self.robot.n and one.owner in (first, second):
                own = np.zeros(3)
                if isinstance(one.geometry, Triangles):
                    own = one.geometry.vertices[one.geometry.faces[0, 0]]
                middle = pose.homogeneous @ one.placement @ np.append(own, 1.0)
                there = (middle[:3] - mesh.placement[:3, 3]) @ mesh.placement[:3, :3]
                if bool(solid.contains(there[None])[0]):
                    return True
        return False


def over(
    *scene: Obstacle, tool: ToolShape = NOZZLE, cone_deg: float = 30.0, clearance: float = 0.0
) -> Over:
    """The tool alone, without the links, among objects."""
    allow = tuple((name, one.name) for name in UR5.link_names for one in scene)
    asked = Collision(False, False, clearance=clearance, scene=scene, tool=(tool,), allow=allow)
    return Over.cell(UR5, CELLS, Task(0.02, cone_deg, 0.001, collision=asked))


def random_over(seed: int) -> Over:
    """One or two objects near the target, and a tool of one shape; links are left out."""
    rng = np.random.default_rng(seed)
    around = np.array([0.5, 0.0, 0.37])
    scene = tuple(random_object(rng, f"object{k}", around) for k in range(rng.integers(1, 3)))
    clearance = float(rng.choice([0.0, 0.01]))
    tools = [
        NOZZLE,
        ToolShape.box((0.03, 0.02, 0.1), position=(0.01, 0.0, -0.05)),
        ToolShape.capsule(0.015, 0.08, position=(0.0, 0.0, -0.06)),
        ToolShape.sphere(0.04, position=(0.0, 0.0, -0.05)),
    ]
    tool, cone_deg = tools[int(rng.integers(4))], float(rng.uniform(1, 90))
    return over(*scene, tool=tool, cone_deg=cone_deg, clearance=clearance)


def planted_over(name: str, seed: int) -> Over | None:
    """A pose of an arm and a target that it covers, among objects; None if it collides.

    It is off the target by up to 1 mm, and by up to the cone.
    """
    rng, robot = np.random.default_rng([seed, 1]), arm(name)
    q, cone_deg = rng.uniform(*within_a_turn(robot)), float(rng.uniform(1.0, 60.0))
    point, axis = Kinematics(robot).tool(q)
    approach = tilted(axis, np.radians(cone_deg) * rng.uniform(), rng)
    point = point + 0.001 * rng.uniform() * unit(rng.normal(size=3))
    scene = tuple(random_object(rng, f"object{k}", point) for k in range(rng.integers(1, 4)))
    asked = Collision(surface=False, clearance=float(rng.choice([0.0, 0.005])), scene=scene)
    over = Over(robot, PLATE, Task(0.02, cone_deg, 0.001, collision=asked), point, approach)
    frames = Kinematics(robot).joints(q[None])
    pose = pin.SE3(frames.rotations[0, -1], frames.points[0, -1])
    return over if ToolPoses(robot, over.bodies).clear(pose) else None


def behind_a_wall(name: str, seed: int) -> tuple[Robot, Cells, Task]:
    """A plate, and a wall before it that nothing reaches around."""
    rng, robot = np.random.default_rng([seed, 3]), arm(name)
    reach, base = min(robot.reach, 1.0), np.array(robot.base_point)
    away, up = rng.uniform(0.6, 0.7), rng.uniform(-0.1, 0.3)
    at = tuple(base + reach * np.array([away, rng.uniform(-0.2, 0.2), up]))
    ends, tilt = (-0.08 * reach, 0.08 * reach), -rng.uniform(0.0, 60.0)
    plate = plane(ends, ends, "outside", at, (0.0, tilt, 0.0))
    thick = rng.uniform(0.18, 0.25)
    place = tuple(base + np.array([reach * rng.uniform(0.28, 0.32), 0.0, 0.0]))
    wall = Obstacle.box("wall", (thick, 5.0, 5.0), place, (0.0, rng.uniform(-8.0, 8.0), 0.0))
    asked = Collision(clearance=CLEARANCE, scene=(wall,))
    return robot, plate.cells(1, 1), Task(0.02, float(rng.uniform(5, 25)), 0.001, collision=asked)
